"""Frames of every stage, with and without --viewable, and the colors that a viewer may show of them."""

import dataclasses
import pathlib

import numpy as np
import OpenImageIO as oiio
import yaml

from conformance.converters import call
from programs import BINARIES, SAMPLE_DATA

from .viewers import PROFILE

PATCH = 16
# IEC 61966-2-1.
SRGB_FROM_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
SCENE = ["render-radiance", SAMPLE_DATA / "skies/sky912.exr", "--patch", f"{PATCH}x{PATCH}", "--expose-to", 0.75]
WHITE = ["--white-luminance", 30000]

# Name, words, and the command that makes it from the stage before.
STAGES = [
    ("rates", "expected electrons", SCENE),
    ("noisy", "electrons", ["add-noise", "--seed", 7, "{rates}"]),
    ("codes", "codes of three planes", ["digitize", "{noisy}"]),
    ("mosaic", "codes of a filter array", ["mosaic", "{codes}"]),
    ("rgb", "sensor RGB", ["demosaic", "--method", "eci", "{mosaic}"]),
    ("xyz", "XYZ", ["to-xyz", "--matrix", "matrix.yaml", *WHITE, "{rgb}"]),
    ("linear", "linear sRGB", ["to-xyz", "--matrix", "matrix.yaml", *WHITE, "--space", "linear-srgb", "{rgb}"]),
    ("srgb", "sRGB", ["to-xyz", "--matrix", "matrix.yaml", *WHITE, "--space", "srgb", "{rgb}"]),
]


@dataclasses.dataclass
class Frame:
    """One file, and the mean colors of its patches by what a viewer may make of it."""

    path: pathlib.Path
    words: str
    viewable: bool
    readings: dict


def ours(command, directory):
    return call([BINARIES / command[0], *command[1:], "--quiet"], directory)


def make_all(directory):
    """Makes the frames; gives each with its readings as soon as it is there."""
    ours(["fit-matrix", SAMPLE_DATA / "skies/sky912.exr", "-o", "matrix.yaml"], directory)
    for name, _, command in STAGES:
        ours([str(word).format(**{stage: f"{stage}.exr" for stage, _, _ in STAGES}) for word in command]
             + ["-o", f"{name}.{'tiff' if name == 'srgb' else 'exr'}"], directory)
    picture = patches_of_file(directory, "srgb.tiff")
    profile = oiio.ImageInput.open(str(directory / "srgb.tiff")).spec().getattribute("ICCProfile")
    (directory / PROFILE).write_bytes(bytes(profile))
    for name, words, command in STAGES:
        previewed = preview(directory, f"{name}.{'tiff' if name == 'srgb' else 'exr'}")
        formats = ["tiff"] if name == "srgb" else ["exr", "tiff"]
        for end in formats:
            for viewable in [False] if name == "srgb" else [False, True]:
                path = directory / f"{name}{'-viewable' if viewable else ''}.{end}"
                line = [str(word).format(**{stage: f"{stage}.exr" for stage, _, _ in STAGES}) for word in command]
                if end == "tiff" or viewable:
                    ours(line + ["-o", path.name] + ["--viewable"] * viewable, directory)
                stored = np.clip(patches_of_file(directory, path.name), 0, 1)
                managed = of_camera(directory, previewed) if name in ("codes", "rgb") else picture
                readings = {"as preview": previewed, "managed": managed, "no curve": stored, "curve": encode(stored)}
                yield Frame(path, words, viewable, readings)


def preview(directory, name):
    ours(["preview", name, "-o", "shown.png"], directory)
    return patches_of_file(directory, "shown.png")


def of_camera(directory, previewed):
    """The colors of sensor RGB by the matrix of its sensor: what `preview` shows as R, G and B through it to sRGB, Y = 1 at white."""
    metadata = yaml.safe_load((directory / "rgb.exr.yaml").read_text(encoding="utf-8"))
    matrix = np.array(metadata["sensor"]["xyz_from_camera"])
    linear = decode(previewed) @ (SRGB_FROM_XYZ @ matrix / matrix.sum(axis=1)[1]).T
    return encode(linear)


def decode(encoded):
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def encode(linear):
    """The curve of sRGB [IEC 61966-2-1]."""
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def patches_of_file(directory, name):
    """Mean colors of the patches of a file, integers as shares of full scale, gray as three alike."""
    buffer = oiio.ImageBuf(str(directory / name))
    if buffer.has_error:
        raise ValueError(buffer.geterror())
    pixels = np.asarray(buffer.get_pixels(oiio.FLOAT), dtype=float)
    return patches(pixels)


def patches(pixels):
    pixels = pixels.reshape(*pixels.shape[:2], -1)
    pixels = np.repeat(pixels[..., :1], 3, axis=2) if pixels.shape[2] < 3 else pixels[..., :3]
    rows, columns = (side // PATCH for side in pixels.shape[:2])
    cut = pixels[: rows * PATCH, : columns * PATCH].reshape(rows, PATCH, columns, PATCH, 3)
    return cut.mean(axis=(1, 3))
