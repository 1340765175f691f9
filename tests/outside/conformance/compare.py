"""What converters make of the set beside what is in it."""

import dataclasses
import hashlib
import shutil
import subprocess

import numpy as np

from . import tags
from .converters import TIMEOUT_S, Refused, develop, rawpy
from .scene import D65_XY

# Patches whose X, Y and Z reach this share of white count relative to themselves; of darker ones the error itself is told.
DARK = 0.01
# Right is what lies within this share of the truth.
TOLERANCE = 0.01
# Standard errors of a mean that noise may move it by, of a hundred means.
STANDARD_ERRORS = 4


@dataclasses.dataclass
class Found:
    """What a converter makes of a file."""

    converter: str
    file: str
    problem: str = ""
    # What of the image it shows.
    shown: str = ""
    # Largest deviation of X, Y or Z as a share of the truth, in which patch, beyond what noise explains.
    deviation: float = float("nan")
    patch: str = ""
    # Root mean square of errors in standard errors, of the same patches of noisy files: 1 where noise explains them.
    z_rms: float = float("nan")
    # Largest error of darker patches, as a share of white.
    dark_error: float = float("nan")
    # Chromaticity of what is overexposed in all classes.
    overexposed_xy: tuple = ()
    patches: list = dataclasses.field(default_factory=list)

    @property
    def is_right(self):
        return not self.problem and self.deviation <= TOLERANCE


def place(truth, size):
    """Which part of the stored image a picture of a size shows, in words, and the column and row where it begins."""
    left, top, width, height = truth.area()
    x, y, *shown = truth.file.shown or (0, 0, width, height)
    parts = [("active area", left, top, width, height), ("default crop", left + x, top + y, *shown)]
    parts.append(("all that is stored", 0, 0, *truth.size()))
    # LibRaw begins at an even column and row.
    parts.append(("active area from even sites", left + left % 2, top + top % 2, width - left % 2, height - top % 2))
    for name, left, top, width, height in parts:
        for rim in range(9):
            if (width - 2 * rim, height - 2 * rim) == tuple(size):
                return name + (f" less a rim of {rim}" if rim else ""), left + rim, top + rim
    return None


def means(truth, pixels):
    """What is shown, and the mean X, Y and Z of each patch."""
    found = place(truth, pixels.shape[1::-1])
    if found is None:
        raise Refused(f"its picture has {pixels.shape[1]}x{pixels.shape[0]} pixels, of no part of the image")
    name, left, top = found
    result = []
    for region in truth.regions():
        x, y, width, height = (region[0] - left, region[1] - top, *region[2:]) if region else (0, 0, 0, 0)
        result.append(pixels[y : y + height, x : x + width].reshape(-1, 3).mean(0) if region else None)
    return name, result


def standard_errors(truth, region):
    """Of the means of X, Y and Z of each patch by noise, whose photosites are independent."""
    counts = region[2] * region[3] / np.array([4, 2, 4])
    return np.sqrt(np.einsum("ij,pj,ij->pi", truth.xyz_from_signal, truth.variance / counts, truth.xyz_from_signal))


def compare(converter, truth, path, pixels=None):
    """Develops a file and compares its patches with the truth: with its codes' where there is no noise, with the scene's else."""
    result = Found(converter.name, truth.file.name)
    try:
        pixels = develop(converter, path) if pixels is None else pixels
        if converter.is_absolute:
            pixels = pixels / truth.saturation
        result.shown, found = means(truth, pixels)
    except (Refused, subprocess.TimeoutExpired) as error:
        result.problem = str(error)
        return result
    wanted = truth.relative_xyz if truth.file.noisy else truth.coded_xyz()
    region = next(region for region in truth.regions() if region)
    errors = standard_errors(truth, region) * truth.file.noisy
    result.deviation = result.dark_error = 0.0
    z_scores = []
    for index, mean in enumerate(found):
        if mean is None:
            continue
        if truth.clipped[index].any():
            if truth.clipped[index].all() and mean.sum() > 0:
                result.overexposed_xy = tuple(mean[:2] / mean.sum())
            continue
        off = mean - wanted[index]
        result.patches.append((truth.names[index], *mean, *wanted[index], *errors[index]))
        beyond = np.maximum(np.abs(off) - STANDARD_ERRORS * errors[index], 0)
        if wanted[index].min() < DARK:
            result.dark_error = max(result.dark_error, beyond.max())
            continue
        if truth.file.noisy:
            z_scores.extend(off / errors[index])
        if (beyond / wanted[index]).max() >= result.deviation:
            result.deviation = float((beyond / wanted[index]).max())
            result.patch = truth.names[index]
    if z_scores:
        result.z_rms = float(np.sqrt(np.mean(np.square(z_scores))))
    return result


def is_neutral(found):
    """Whether what is overexposed is white: within 0.003 of x and y of D65."""
    return np.abs(np.array(found.overexposed_xy) - D65_XY).max() < 0.003


def digest(samples):
    """The MD5 of the MD5s of tiles of 256×256 samples, as Adobe's SDK takes it of a raw image."""
    height, width = samples.shape
    tiles = [samples[y : y + 256, x : x + 256] for y in range(0, height, 256) for x in range(0, width, 256)]
    return hashlib.md5(b"".join(hashlib.md5(tile.tobytes()).digest() for tile in tiles), usedforsecurity=False).digest()


TAGS = {
    "ActiveArea": tags.ACTIVE_AREA,
    "DefaultCropOrigin": tags.CROP_ORIGIN,
    "DefaultCropSize": tags.CROP_SIZE,
    "CFAPattern": tags.CFA_PATTERN,
    "WhiteLevel": tags.WHITE_LEVEL,
    "BlackLevel": tags.BLACK_LEVEL,
    "ColorMatrix1": tags.COLOR_MATRIX,
    "AsShotNeutral": tags.NEUTRAL,
    "NoiseProfile": tags.NOISE_PROFILE,
    "ExposureTime": tags.EXPOSURE_TIME,
    "FNumber": tags.F_NUMBER,
}


def wrong_tags(path, expected):
    """Tags that say something else than they should, in words."""
    found = tags.Tags(path)
    wrong = []
    for name, tag in TAGS.items():
        if expected[name] is None:
            continue
        wanted = np.ravel(expected[name]).astype(float)
        values = np.array(found.value(tag), float)
        values = np.repeat(values, 4) if name == "BlackLevel" and len(values) == 1 else values
        # Ratios of 32 bits; the matrix passes the sensor file, where it is inverted.
        if values.shape != wanted.shape or not np.allclose(values, wanted, rtol=1e-7, atol=1e-9):
            wrong.append(f"{name} is {values.tolist()}, not {wanted.tolist()}")
    is_of_these = digest(found.samples()) == bytes(found.value(tags.DIGEST))
    return wrong + ([] if is_of_these else ["NewRawImageDigest is that of other samples"])


def libraw_differences(truth, path):
    """What LibRaw reads otherwise than it is: samples, pattern, levels."""
    wrong = []
    left, top, *_ = truth.area()
    with rawpy.imread(str(path)) as raw:
        stored = raw.raw_image.astype(int)
        height, width = stored.shape
        if (width, height) != truth.size():
            return [f"{width}x{height} samples, not {truth.size()}"]
        # What it shows begins at even sites, from where it counts those of the black level.
        skipped = top % 2, left % 2
        corner = np.array(["RGB".index(chr(raw.color_desc[index])) for index in raw.raw_colors[:2, :2].ravel()]).reshape(2, 2)
        if not np.array_equal(corner, truth.pattern()):
            wrong.append(f"pattern {corner.ravel()}")
        black = np.array(raw.black_level_per_channel)[raw.raw_colors[:2, :2]]
        if not np.array_equal(np.roll(black, skipped, (0, 1)), np.floor(truth.file.blacks)):
            wrong.append(f"black {np.roll(black, skipped, (0, 1)).ravel().tolist()}, not {truth.file.blacks.ravel().tolist()}")
        elif any(skipped) and np.ptp(truth.file.blacks):
            wrong.append("black of other sites, as it counts them from the even ones that it shows from")
        if raw.white_level != truth.file.white_level:
            wrong.append(f"white {raw.white_level}, not {truth.file.white_level}")
    if not truth.file.noisy:
        codes = truth.codes().reshape(-1, 2, 2)
        for index, region in enumerate(truth.regions()):
            if region is None:
                continue
            x, y, width, height = region
            sites = codes[index][np.arange(y, y + height)[:, None] % 2, np.arange(x, x + width)[None] % 2]
            if not np.array_equal(stored[y : y + height, x : x + width], sites):
                wrong.append(f"samples of {truth.names[index]}")
    return wrong


def exiftool_warnings(paths):
    """What exiftool -validate complains of, file by file; none where it is missing."""
    if shutil.which("exiftool") is None:
        return None
    command = ["exiftool", "-q", "-validate", "-warning", "-error", "-a", "-s3", *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    lines = [line for line in (done.stdout + done.stderr).splitlines() if line not in ("OK", "") and not line.startswith("=")]
    return sorted(set(lines))


# Signals that are taken together, and all of them.
RANGES = [(0, 0.003), (0.003, 0.03), (0.03, 0.3), (0.3, 1), (0, 1)]


def noise(truth, path):
    """Variance of the stored samples over that of the NoiseProfile, class by class and patch by patch: for each range of signals its
    ends, the mean ratio, the standard error of that, √(2/n), and the degrees of freedom n."""
    found = tags.Tags(path)
    samples = found.samples().astype(float)
    profile = np.array(found.value(tags.NOISE_PROFILE)).reshape(-1, 2)
    black, white = np.ravel(found.value(tags.BLACK_LEVEL)).max(), found.value(tags.WHITE_LEVEL)[0]
    signals, ratios, degrees = [], [], []
    for index, region in enumerate(truth.regions()):
        if region is None:
            continue
        x, y, columns, rows = region
        part = samples[y : y + rows, x : x + columns]
        for row in range(2):
            for column in range(2):
                kind = truth.pattern()[(y + row) % 2, (x + column) % 2]
                values = (part[row::2, column::2] - black) / (white - black)
                told = profile[min(kind, len(profile) - 1)] @ [truth.signal[index, kind], 1]
                if truth.signal[index, kind] + 6 * np.sqrt(told) > 1:
                    continue
                signals.append(truth.signal[index, kind])
                ratios.append(values.var(ddof=1) / told)
                degrees.append(values.size - 1)
    signals, ratios, degrees = map(np.array, (signals, ratios, degrees))
    rows = []
    for low, high in RANGES:
        inside = (signals >= low) & (signals < high)
        if inside.any():
            count = degrees[inside].sum()
            rows.append((low, high, np.average(ratios[inside], weights=degrees[inside]), np.sqrt(2 / count), int(count)))
    return rows


def pooled(noises):
    """Such rows of all files together."""
    rows = []
    for low, high in RANGES:
        found = [row for rows in noises.values() for row in rows if row[:2] == (low, high)]
        if found:
            count = sum(row[4] for row in found)
            rows.append((low, high, sum(row[2] * row[4] for row in found) / count, np.sqrt(2 / count), count))
    return rows
