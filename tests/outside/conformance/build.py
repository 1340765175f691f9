"""Makes the set: DNGs by the programs, and beside each what is in it, by scene.py."""

import csv
import dataclasses
import json

import numpy as np

from programs import CLASSES, write_planes

from . import tags
from .scene import D65_XY, F_NUMBER, SCENES, Camera, white_of, xyz_of

CAMERAS = {
    12: Camera(12, 0.2, 256, 4.0),
    14: Camera(14, 0.5, 512, 4.0),
    16: Camera(16, 1.5, 2048, 4.0),
}
# Photosites of a patch, and those at its edge that no mean takes: filters of converters reach there.
PATCH, EDGE = 48, 10
# Exposure: what the brightest signal but for overexposed patches is of the range.
SHARE = 0.8


@dataclasses.dataclass(frozen=True)
class File:
    """A file of the set."""

    name: str
    about: str
    scene: str = "chart"
    pattern: str = "rggb"
    bits: int = 14
    noisy: bool = False
    # X, Y, width and height of a part of the frame.
    crop: tuple = ()
    # What each of the 2×2 sites of the stored image's corner has above the bias.
    sites: tuple = (0, 0, 0, 0)
    # White level, if it is not the last code.
    white: int = 0
    # Full well, where it lies below the last code, e⁻.
    full_well_e: float = 0
    # Masked photosites: left, top, right, bottom.
    masked: tuple = (0, 0, 0, 0)
    # What converters show of the active area: X, Y, width and height.
    shown: tuple = ()

    @property
    def camera(self):
        camera = CAMERAS[self.bits]
        return dataclasses.replace(camera, full_well_e=self.full_well_e) if self.full_well_e else camera

    @property
    def white_level(self):
        camera = self.camera
        return self.white or min(2**self.bits - 1, int(camera.bias + camera.adu_per_e * camera.full_well_e))

    @property
    def blacks(self):
        """Black by site at the corner of the stored image."""
        return self.camera.bias + np.array(self.sites, float).reshape(2, 2)

    @property
    def range_adu(self):
        """What signals are divided by: white less the largest black (DNG, Mapping Raw Values to Linear Reference Values)."""
        return self.white_level - self.blacks.max()

    @property
    def grid(self):
        """Names, columns and radiances of the patches."""
        return SCENES[self.scene]()


def patterns():
    return [File(f"chart-{pattern}", f"pattern {pattern.upper()}", pattern=pattern) for pattern in CLASSES]


FILES = [
    *patterns(),
    File("chart-odd", "281x183 from an odd column and row of the sensor", crop=(3, 5, 281, 183)),
    File("chart-sites", "black by site, whole numbers", sites=(0, 18, 7, -12)),
    File("chart-fraction", "black by site, with fractions", pattern="gbrg", sites=(0.25, 3.5, -2.75, 1.5)),
    File("chart-white", "white level 9000 of 16383", white=9000),
    File("chart-masked", "masked border, default crop", masked=(12, 8, 6, 4), shown=(4, 6, 280, 180)),
    File("chart-masked-odd", "masked border of odd width, black by site", pattern="grbg", masked=(9, 5, 0, 3), sites=(0, 9, 20, 31)),
    File("chart-12", "12 bits", bits=12),
    File("chart-16", "16 bits", bits=16),
    File("chart-noisy", "noise", noisy=True),
    File("ramp-14", "grays from black to twice the white", scene="ramp"),
    File("ramp-white", "the same, white level 9000 of 16383", scene="ramp", white=9000),
    File("ramp-full", "the same, full well at code 12512 of 16383", scene="ramp", full_well_e=24000),
    *(File(f"ramp-{bits}-noisy", f"grays, noise, {bits} bits", scene="ramp", bits=bits, noisy=True) for bits in (12, 14, 16)),
    File("sky-14", "skies", scene="sky"),
    File("sky-14-noisy", "skies, noise", scene="sky", noisy=True),
]


class Truth:
    """What a file holds, patch by patch."""

    def __init__(self, file):
        names, columns, radiances = file.grid
        camera = file.camera
        self.file = file
        self.columns, self.rows = columns, len(names) // columns
        self.xyz = xyz_of(radiances)
        rates = self.xyz @ camera.electrons_per_xyz.T
        below = np.array([not name.endswith(" 2") for name in names])
        white = file.range_adu / camera.adu_per_e
        self.exposure_s = float(f"{SHARE * white / rates[below].max():.6g}")
        self.electrons = rates * self.exposure_s
        self.names = names
        # Y of the white by which the first class reaches the white level.
        self.saturation = white / (camera.electrons_per_xyz @ white_of(D65_XY)).max() / self.exposure_s
        self.relative_xyz = self.xyz / self.saturation
        self.signal = self.electrons * camera.adu_per_e / file.range_adu
        self.clipped = self.signal > 1
        self.variance = (camera.adu_per_e**2 * (self.electrons + camera.read_noise_e**2) + 1 / 12) / file.range_adu**2
        self.xyz_from_signal = np.linalg.inv(camera.camera_from_xyz)

    @property
    def covariance(self):
        """Of relative X, Y, Z by one photosite of each class."""
        return np.einsum("ij,pj,kj->pik", self.xyz_from_signal, self.variance, self.xyz_from_signal)

    def regions(self):
        """X, Y, width and height of each patch without its edge, in the stored image; none of patches that are cut off."""
        file = self.file
        left, top, *size = file.crop or (0, 0, self.columns * PATCH, self.rows * PATCH)
        found = []
        for index in range(len(self.names)):
            x, y = index % self.columns * PATCH + EDGE - left, index // self.columns * PATCH + EDGE - top
            inside = min(x, y) >= EDGE - 1 and x + PATCH - EDGE <= size[0] and y + PATCH - EDGE <= size[1]
            side = PATCH - 2 * EDGE
            found.append((x + file.masked[0], y + file.masked[1], side, side) if inside else None)
        return found

    def size(self):
        """Columns and rows of the stored image."""
        size = self.file.crop[2:] or (self.columns * PATCH, self.rows * PATCH)
        left, top, right, bottom = self.file.masked
        return size[0] + left + right, size[1] + top + bottom

    def area(self):
        """X, Y, width and height of the active area."""
        left, top, right, bottom = self.file.masked
        width, height = self.size()
        return left, top, width - left - right, height - top - bottom

    def pattern(self):
        """The classes of the 2×2 sites at the stored image's corner, 0 to 2."""
        left, top = self.file.crop[:2] or (0, 0)
        letters = np.array(CLASSES[self.file.pattern])
        letters = np.roll(letters, (self.file.masked[1] - top, self.file.masked[0] - left), (0, 1))
        return np.vectorize("RGB".index)(letters)

    def codes(self):
        """The codes without noise: [patch, site]."""
        signal = self.electrons[:, self.pattern().ravel()] * self.file.camera.adu_per_e
        plain = np.minimum(np.round(signal + self.file.camera.bias), 2**self.file.bits - 1)
        return np.clip(np.round(plain + np.array(self.file.sites)), 0, self.file.white_level)

    def coded_xyz(self):
        """Relative XYZ of the codes without noise, which rounding moves from those of the scene."""
        signals = (self.codes() - self.file.blacks.ravel()) / self.file.range_adu
        classes = self.pattern().ravel()
        means = np.stack([signals[:, classes == index].mean(1) for index in range(3)], -1)
        return means @ self.xyz_from_signal.T

    def write(self, path):
        """The table of the patches."""
        head = ["patch", "x", "y", "width", "height", "X", "Y", "Z", "relative_X", "relative_Y", "relative_Z"]
        head += [f"{what}_{name}" for what in ("electrons", "signal", "variance") for name in "RGB"]
        head += [f"covariance_{pair}" for pair in ("XX", "XY", "XZ", "YY", "YZ", "ZZ")]
        head += ["coded_X", "coded_Y", "coded_Z", "clipped"]
        upper = np.triu_indices(3)
        variance, covariance, coded = self.variance, self.covariance, self.coded_xyz()
        if not self.file.noisy:
            variance, covariance = 0 * variance, 0 * covariance
        with open(path, "w", encoding="utf-8", newline="") as out:
            table = csv.writer(out, lineterminator="\n")
            table.writerow(head)
            for index, region in enumerate(self.regions()):
                if region is None:
                    continue
                numbers = [self.xyz[index], self.relative_xyz[index], self.electrons[index], self.signal[index]]
                numbers += [variance[index], covariance[index][upper], coded[index]]
                clipped = "".join(name for name, is_so in zip("RGB", self.clipped[index]) if is_so)
                table.writerow([self.names[index], *region, *(f"{x:.9g}" for x in np.concatenate(numbers)), clipped])


def expected_tags(file, truth):
    """What the tags should say."""
    left, top, width, height = truth.area()
    signal = file.camera.adu_per_e / file.range_adu
    offset = (file.camera.adu_per_e**2 * file.camera.read_noise_e**2 + 1 / 12) / file.range_adu**2
    shift = (-top, -left)
    return {
        "ActiveArea": [top, left, top + height, left + width],
        "DefaultCropOrigin": list(file.shown[:2] or (0, 0)),
        "DefaultCropSize": list(file.shown[2:] or (width, height)),
        "CFAPattern": np.roll(truth.pattern(), shift, (0, 1)).ravel().tolist(),
        "BlackLevel": np.roll(file.blacks, shift, (0, 1)).ravel().tolist(),
        "WhiteLevel": file.white_level,
        "ColorMatrix1": file.camera.camera_from_xyz.ravel().tolist(),
        "AsShotNeutral": (file.camera.camera_from_xyz @ white_of(D65_XY)).tolist(),
        "NoiseProfile": [signal, offset] * 3 if file.noisy else None,
        "ExposureTime": truth.exposure_s,
        "FNumber": F_NUMBER,
    }


def make(file, directory, run, seed):
    """Makes a file and what belongs to it by `run`, which runs a program in the directory; gives what is in it."""
    truth = Truth(file)
    radiance = directory / f"{file.scene}.exr"
    if not radiance.exists():
        spectra = file.grid[2].reshape(truth.rows, truth.columns, -1).astype(np.float32)
        planes = {f"S0.{360 + index}nm": spectra[..., index] for index in range(spectra.shape[-1])}
        write_planes(radiance, planes, emissiveUnits="W.cm^-2.sr^-1.nm^-1")
    sensor = file.camera.write(directory)
    codes = directory / f"{file.name}.dng"
    patch = ["--patch", f"{PATCH}x{PATCH}", "--cfa", file.pattern, "-q"]
    light = ["--exposure", repr(truth.exposure_s), "--f-number", F_NUMBER, "--sensor", sensor.name]
    run(["render-radiance", radiance.name, *patch, *light, "-o", "light.exr"])
    run(["add-noise", "light.exr", "-q", *(["--seed", seed] if file.noisy else ["--clean"]), "-o", "charge.exr"])
    crop = ["--crop", ",".join(map(str, file.crop))] if file.crop else []
    run(["digitize", "charge.exr", "-q", *crop, "-o", codes.name])
    if any(file.sites) or file.white or any(file.masked):
        change(file, truth, codes, run)
    truth.write(directory / f"{file.name}.csv")
    about = {"file": codes.name, "about": file.about, "scene": file.scene, "noise": file.noisy}
    about |= {"bits": file.bits, "size": truth.size(), "saturation_cd_per_m2": truth.saturation}
    return truth, about | {"tags": expected_tags(file, truth)}


def change(file, truth, path, run):
    """Levels by site, a white level and a masked border in a file that has none; what is written is written by `import-raw`."""
    found = tags.Tags(path)
    left, top, right, bottom = file.masked
    samples = found.samples().astype(int)
    size = truth.size()
    rows, columns = np.indices((size[1], size[0]))
    added = np.array(file.sites).reshape(2, 2)[rows % 2, columns % 2]
    # The border is charge-free and as noisy as nothing: bias alone.
    samples = np.pad(samples, ((top, bottom), (left, right)), constant_values=file.camera.bias)
    samples = np.clip(np.round(samples + added), 0, file.white_level).astype("<u2")
    metadata = directory_of(path, "metadata.yaml")
    blacks = ", ".join(map(repr, file.blacks.ravel().tolist()))
    lines = (path.parent / f"{path.name}.yaml").read_text(encoding="utf-8").split("\nsamples:")[0].splitlines()
    levels = {"black_level_adu": f"[{blacks}]", "white_level_adu": str(file.white_level)}
    levels["cfa"] = "".join("rgb"[index] for index in truth.pattern().ravel())
    lines = [f"{key}: {levels[key]}" if (key := line.split(":")[0]) in levels else line for line in lines]
    metadata.write_text("\n".join(lines) + "\n", encoding="utf-8")
    plain = directory_of(path, "plain.dng")
    write_plain(plain, samples)
    run(["import-raw", plain.name, "--metadata", metadata.name, "-q", "-o", path.name])
    for extra in (metadata, plain):
        extra.unlink()
    if any(file.masked):
        found = tags.Tags(path)
        expected = expected_tags(file, truth)
        found.put(tags.ACTIVE_AREA, expected["ActiveArea"])
        found.put(tags.CROP_ORIGIN, expected["DefaultCropOrigin"])
        found.put(tags.CROP_SIZE, expected["DefaultCropSize"])
        found.put(tags.CFA_PATTERN, expected["CFAPattern"])
        if len(found.value(tags.BLACK_LEVEL)) == 4:
            ratios = np.array(found.raw(tags.BLACK_LEVEL)).reshape(2, 2, 2)
            found.put(tags.BLACK_LEVEL, np.roll(ratios, (-top, -left), (0, 1)).ravel().tolist())
        found.write()
        # It describes the image before it had a border.
        (path.parent / f"{path.name}.yaml").unlink()


def directory_of(path, name):
    return path.parent / f"{path.stem}-{name}"


def write_plain(path, samples):
    """Codes alone, in the least that is a DNG."""
    from test_raw import write_dng

    write_dng(path, samples, 16)


def make_all(directory, run, files=FILES):
    """Makes the files; gives what is in each by its name."""
    directory.mkdir(parents=True, exist_ok=True)
    made, index = {}, []
    for file in files:
        made[file.name], about = make(file, directory, run, FILES.index(file))
        index.append(about)
    for name in ("light.exr", "light.exr.yaml", "charge.exr", "charge.exr.yaml"):
        (directory / name).unlink()
    (directory / "set.json").write_text(json.dumps(index, indent=1) + "\n", encoding="utf-8")
    return made
