"""Raw converters, each told to do no more than levels, white balance as shot, bilinear or like interpolation and the matrix to a
linear color space; what comes out as relative X, Y, Z under D65, Y = 1 where white saturates."""

import pathlib
import re
import shutil
import subprocess
import tempfile

import numpy as np
import tifffile

from . import tags
from .scene import D65_XY, white_of

try:
    import rawpy
except ImportError:
    rawpy = None

TIMEOUT_S = 120
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
D50_OF_PROFILES = np.array([0.9642, 1, 0.8249])


class Refused(Exception):
    """A converter did not take a file; with the status that it ended with, where it did."""

    def __init__(self, text, status=None):
        super().__init__(text)
        self.status = status


def linear_xyz(raw, **white):
    """X, Y, Z of LibRaw in 16 bits, in proportion to light, with such a white balance."""
    return raw.postprocess(
        output_color=rawpy.ColorSpace.XYZ,
        gamma=(1, 1),
        no_auto_bright=True,
        adjust_maximum_thr=0.0,
        output_bps=16,
        demosaic_algorithm=rawpy.DemosaicAlgorithm.LINEAR,
        user_flip=0,
        **white,
    )


def call(command, cwd):
    """Runs a command that should succeed; gives what it says."""
    command = [str(word) for word in command]
    done = subprocess.run(command, cwd=cwd, capture_output=True, timeout=TIMEOUT_S, check=False)
    said = (done.stdout + done.stderr).decode(errors="replace")
    if done.returncode != 0:
        raise Refused(f"{command[0]} ended with {done.returncode}: {said.strip().splitlines()[-1:]}", done.returncode)
    return said


def said(command, pattern):
    """What a program says of its version; none where it is missing."""
    if shutil.which(command[0]) is None:
        return None
    done = subprocess.run(command, capture_output=True, timeout=TIMEOUT_S, check=False)
    found = re.search(pattern, (done.stdout + done.stderr).decode(errors="replace"))
    return found.group(1) if found else "of unknown version"


def pixels_of(path):
    """The samples of a TIFF, codes as shares of the last, and its ICC profile."""
    with tifffile.TiffFile(path) as file:
        samples = file.pages[0].asarray()
        profile = file.pages[0].tags.get(34675)
        profile = profile and bytes(profile.value)
    scale = np.iinfo(samples.dtype).max if samples.dtype.kind == "u" else 1
    return samples[..., :3].astype(float) / scale, profile


def xyz_of_profile(pixels, profile):
    """Relative XYZ under D65 of pixels in the space of an ICC profile of curves and a matrix, whose own XYZ are adapted to D50."""
    entries = {}
    for index in range(int.from_bytes(profile[128:132], "big")):
        entry = profile[132 + 12 * index : 144 + 12 * index]
        start, size = (int.from_bytes(entry[at : at + 4], "big") for at in (4, 8))
        entries[entry[:4]] = profile[start : start + size]
    columns = [np.frombuffer(entries[name][8:20], ">i4") / 65536 for name in (b"rXYZ", b"gXYZ", b"bXYZ")]
    cones = BRADFORD @ np.stack([D50_OF_PROFILES, white_of(D65_XY)], -1)
    to_d65 = np.linalg.inv(BRADFORD) @ np.diag(cones[:, 1] / cones[:, 0]) @ BRADFORD
    return linear(pixels, entries[b"rTRC"]) @ (to_d65 @ np.stack(columns, -1)).T


def linear(pixels, curve):
    """Light of samples by a tone curve of an ICC profile (ICC.1:2022, 10.6 and 10.18): none, a power, or a power above a line."""
    if curve[:4] == b"curv":
        entries = int.from_bytes(curve[8:12], "big")
        if entries > 1:
            raise Refused("the profile of what it wrote has a table for a tone curve")
        return pixels if entries == 0 else pixels ** (int.from_bytes(curve[12:14], "big") / 256)
    kind = int.from_bytes(curve[8:10], "big")
    fixed = np.frombuffer(curve[12:], ">i4") / 65536
    if kind == 0:
        return pixels if fixed[0] == 1 else pixels ** fixed[0]
    if kind not in (3, 4):
        raise Refused(f"the profile of what it wrote has a tone curve of kind {kind}")
    power, a, b, c, d = fixed[:5]
    above, below = fixed[5:7] if kind == 4 else (0, 0)
    return np.where(pixels >= d, np.maximum(a * pixels + b, 0) ** power + above, c * pixels + below)


class Converter:
    """One that gives relative XYZ."""

    is_absolute = False


class Ours(Converter):
    """`demosaic` and `to-xyz`, by all metadata of the file."""

    name = "cyanometer"
    is_absolute = True

    def __init__(self, binaries):
        self.binaries = pathlib.Path(binaries)

    def version(self):
        return said([str(self.binaries / "to-xyz"), "--version"], r"(\d\S+)")

    def develop(self, path, directory):
        return self.xyz(path, directory)

    def xyz(self, path, directory):
        from programs import read_planes

        call([self.binaries / "demosaic", path, "-q", "--method", "bi", "-o", "rgb.exr"], directory)
        call([self.binaries / "to-xyz", "rgb.exr", "-q", "-o", "xyz.exr"], directory)
        planes = read_planes(directory / "xyz.exr")
        return np.stack([planes[name] for name in "RGB"], -1).astype(float)


class OursByTags(Ours):
    """The same of a file whose metadata of ours are gone."""

    name = "cyanometer, by tags alone"
    is_absolute = False

    def develop(self, path, directory):
        alone = tags.Tags(path)
        alone.forget_metadata()
        alone.write(directory / "alone.dng")
        return self.xyz(directory / "alone.dng", directory)


class LibRaw(Converter):
    """rawpy: LibRaw of its own."""

    name = "LibRaw (rawpy)"

    def version(self):
        return ".".join(map(str, rawpy.libraw_version)) if rawpy else None

    def develop(self, path, directory):
        try:
            with rawpy.imread(str(path)) as raw:
                pixels = linear_xyz(raw, use_camera_wb=True)
        except rawpy.LibRawError as error:
            raise Refused(str(error)) from error
        return pixels / 65535


class Dcraw(Converter):
    """dcraw, and what LibRaw has of the same options."""

    name = "dcraw"
    options = ["-4", "-T", "-o", 5, "-q", 0, "-w", "-t", 0]

    def version(self):
        return said(["dcraw"], r'"dcraw" v(\S+)')

    def develop(self, path, directory):
        shutil.copy(path, directory / "a.dng")
        call([self.name, *self.options, "a.dng"], directory)
        return pixels_of(next(directory.glob("a*.tiff")))[0]


class DcrawEmu(Dcraw):
    name = "dcraw_emu"
    options = ["-4", "-T", "-o", 5, "-q", 0, "-w", "-t", 0, "-c", 0, "-W"]

    def version(self):
        package = said(["dpkg-query", "-W", "-f", "${Version}", "libraw-bin"], r"(\d[\d.]*)")
        return package if shutil.which(self.name) and package else said(["dcraw_emu"], r"LibRaw (\d\S+)")


class Darktable(Converter):
    """darktable-cli without a workflow: no module is on but those that every raw file has."""

    name = "darktable"
    settings = {
        "plugins/darkroom/workflow": "none",
        "plugins/darkroom/chromatic-adaptation": "legacy",
        "plugins/imageio/format/tiff/bpp": "32",
        "plugins/imageio/format/tiff/compress": "0",
    }

    def version(self):
        return said(["darktable-cli", "--version"], r"(\d+\.\d+\S*)")

    def develop(self, path, directory):
        words = ["darktable-cli", path, "out.tif", "--icc-type", "LIN_REC2020", "--apply-custom-presets", "0", "--core"]
        words += ["--configdir", directory / "config", "--cachedir", directory / "cache", "--library", ":memory:"]
        for key, value in self.settings.items():
            words += ["--conf", f"{key}={value}"]
        call(words, directory)
        return xyz_of_profile(*pixels_of(directory / "out.tif"))


RAWTHERAPEE = """[Version]
AppVersion=5.9
Version=349

[White Balance]
Enabled=true
Setting=Camera

[Color Management]
InputProfile=(cameraICC)
ToneCurve=false
ApplyLookTable=false
ApplyBaselineExposureOffset=false
ApplyHueSatMap=false
DCPIlluminant=0
WorkingProfile=Rec2020
OutputProfile=RTv4_ACES-AP0
OutputProfileIntent=Relative
OutputBPC=false

[HLRecovery]
Enabled=false

[RAW]
CA=false
HotPixelFilter=false
DeadPixelFilter=false

[RAW Bayer]
Method=fast
Border=4
"""


class RawTherapee(Converter):
    """rawtherapee-cli: neutral values, and a linear profile."""

    name = "RawTherapee"

    def version(self):
        return said(["rawtherapee-cli", "-v"], r"version (\d[\d.]*)")

    def develop(self, path, directory):
        (directory / "linear.pp3").write_text(RAWTHERAPEE, encoding="utf-8")
        call(["rawtherapee-cli", "-o", "out.tif", "-p", "linear.pp3", "-t", "-b32", "-Y", "-c", path], directory)
        if not (directory / "out.tif").exists():
            raise Refused("RawTherapee wrote nothing")
        return xyz_of_profile(*pixels_of(directory / "out.tif"))


def converters(binaries):
    """All that are known; those whose version is none are not there."""
    return [Ours(binaries), OursByTags(binaries), LibRaw(), DcrawEmu(), Dcraw(), Darktable(), RawTherapee()]


def develop(converter, path):
    """Relative XYZ of a file by a converter, in a directory of its own."""
    with tempfile.TemporaryDirectory(prefix="conformance-") as directory:
        return converter.develop(path.resolve(), pathlib.Path(directory))
