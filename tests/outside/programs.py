"""Runs the programs as a shell would, and reads and writes their files with OpenImageIO.

CYANOMETER_BIN names the directory of the binaries; target/release of this checkout by default.
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import OpenImageIO as oiio

ROOT = pathlib.Path(__file__).resolve().parents[2]
BINARIES = pathlib.Path(os.environ.get("CYANOMETER_BIN", ROOT / "target/release")).resolve()
SAMPLE_DATA = ROOT / "sample_data"

# Nothing here takes longer than a few seconds; a program that does hangs.
TIMEOUT_S = 120


class Failure(AssertionError):
    """A program did not do what it should."""


class ProgramCase(unittest.TestCase):
    """A test with a directory of its own, in which the programs run."""

    def setUp(self):
        directory = tempfile.TemporaryDirectory(prefix="cyanometer-")
        self.addCleanup(directory.cleanup)
        self.directory = pathlib.Path(directory.name)

    def path(self, name):
        return str(self.directory / name)

    def attempt(self, command, stdin=b""):
        """Runs one program; gives status, standard output and standard error."""
        command = [str(word) for word in command]
        program = BINARIES / command[0]
        if not program.exists():
            raise Failure(f"no program {command[0]} in {BINARIES}: build it, or set CYANOMETER_BIN")
        return subprocess.run(
            [str(program), *command[1:]],
            input=stdin,
            capture_output=True,
            cwd=self.directory,
            timeout=TIMEOUT_S,
            check=False,
        )

    def run_program(self, command, stdin=b""):
        """Runs one program that should succeed; gives its standard output."""
        done = self.attempt(command, stdin)
        if done.returncode != 0:
            words = " ".join(str(word) for word in command)
            raise Failure(f"`{words}` ended with {done.returncode}: {done.stderr.decode(errors='replace')}")
        return done.stdout

    def run_pipe(self, *commands, stdin=b""):
        """Runs programs one after another, each on the output of the one before; gives the last output."""
        for command in commands:
            stdin = self.run_program(command, stdin)
        return stdin

    def planes(self, data, suffix=".exr"):
        """Gives the channels of a file's bytes."""
        path = self.directory / f"read-back{suffix}"
        path.write_bytes(data)
        return read_planes(path)

    def frame(self, *commands, stdin=b""):
        """Runs programs as run_pipe does and gives the channels of the EXR frame that comes out."""
        return self.planes(self.run_pipe(*commands, stdin=stdin))

    def same_planes(self, actual, expected):
        """Checks that two frames have the same channels and the same samples, to the bit."""
        self.assertEqual(sorted(actual), sorted(expected))
        for name, samples in expected.items():
            self.assertEqual(actual[name].shape, samples.shape, name)
            different = np.count_nonzero(actual[name] != samples)
            self.assertEqual(different, 0, f"{different} samples of channel {name} differ")


def sample_data(name):
    """The path of a file of sample_data/; skips the test where it is missing."""
    path = SAMPLE_DATA / name
    if not path.exists():
        raise unittest.SkipTest(f"sample_data/{name} is missing")
    return path


def read_table(path):
    """Reads a CSV table with # comments: a dictionary of columns."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    names = lines[0].split(",")
    rows = np.array([[float(word) for word in line.split(",")] for line in lines[1:]])
    return {name: rows[:, column] for column, name in enumerate(names)}


def read_spec(path, part=0):
    """The header that OpenImageIO sees."""
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise Failure(f"OpenImageIO cannot open {path}: {oiio.geterror()}")
    if not file.seek_subimage(part, 0):
        raise Failure(f"{path} has no part {part}")
    spec = oiio.ImageSpec(file.spec())
    file.close()
    return spec


def read_planes(path, part=0):
    """The channels that OpenImageIO sees, by name, in the file's own sample type."""
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise Failure(f"OpenImageIO cannot open {path}: {oiio.geterror()}")
    if not file.seek_subimage(part, 0):
        raise Failure(f"{path} has no part {part}")
    spec = oiio.ImageSpec(file.spec())
    # Reading as "unknown" keeps the file's type. Half would come back as raw bits, so it is widened, which is exact.
    wanted = oiio.FLOAT if str(spec.format) == "half" else oiio.UNKNOWN
    samples = file.read_image(part, 0, 0, spec.nchannels, wanted)
    if samples is None:
        raise Failure(f"OpenImageIO cannot read {path}: {file.geterror()}")
    file.close()
    samples = samples.reshape(spec.height, spec.width, spec.nchannels)
    return {name: samples[:, :, index] for index, name in enumerate(spec.channelnames)}


TYPES = {
    "u8": oiio.UINT8,
    "u16": oiio.UINT16,
    "u32": oiio.UINT32,
    "f16": oiio.HALF,
    "f32": oiio.FLOAT,
}


def make_spec(planes, sample_type, origin=(0, 0), tile=None, **attributes):
    """A header for `planes`, a dictionary of channels."""
    height, width = next(iter(planes.values())).shape
    spec = oiio.ImageSpec(width, height, len(planes), TYPES[sample_type])
    spec.channelnames = tuple(planes)
    spec.x, spec.y = origin
    if tile is not None:
        spec.tile_width, spec.tile_height = tile
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    return spec


def write_planes(path, planes, sample_type="f32", **options):
    """Writes channels with OpenImageIO."""
    write_parts(path, [(planes, make_spec(planes, sample_type, **options))])


def write_parts(path, parts):
    """Writes an image of several parts with OpenImageIO: pairs of channels and header."""
    path = str(path)
    file = oiio.ImageOutput.create(path)
    specs = tuple(spec for _, spec in parts)
    opened = file.open(path, specs) if len(parts) > 1 else file.open(path, specs[0])
    for index, (planes, spec) in enumerate(parts):
        if index:
            opened = opened and file.open(path, spec, "AppendSubimage")
        samples = np.stack(list(planes.values()), axis=-1)
        if str(spec.format) == "half":
            samples = samples.astype(np.float32)
        samples = np.ascontiguousarray(samples)
        if spec.tile_width:
            opened = opened and file.write_tiles(
                spec.x, spec.x + spec.width, spec.y, spec.y + spec.height, 0, 1, samples
            )
        else:
            opened = opened and file.write_image(samples)
    if not opened or not file.close():
        raise Failure(f"OpenImageIO cannot write {path}: {file.geterror()}")


def oiiotool(*arguments):
    """Runs oiiotool, which comes with the Python package; gives its standard output."""
    tool = pathlib.Path(sys.executable).parent / "oiiotool"
    if not tool.exists():
        raise unittest.SkipTest("there is no oiiotool beside this Python")
    done = subprocess.run(
        [str(tool), *map(str, arguments)], capture_output=True, text=True, timeout=TIMEOUT_S, check=False
    )
    if done.returncode != 0:
        raise Failure(f"oiiotool {arguments}: {done.stdout} {done.stderr}")
    return done.stdout


CLASSES = {
    "rggb": [["R", "G"], ["G", "B"]],
    "bggr": [["B", "G"], ["G", "R"]],
    "grbg": [["G", "R"], ["B", "G"]],
    "gbrg": [["G", "B"], ["R", "G"]],
}


def class_masks(pattern, height, width, origin=(0, 0)):
    """Where each class of photosites sits, for a frame whose first column and row are `origin`."""
    names = np.array(CLASSES[pattern])
    rows = (np.arange(height) + origin[1]) % 2
    columns = (np.arange(width) + origin[0]) % 2
    sites = names[rows[:, None], columns[None, :]]
    return {name: sites == name for name in "RGB"}


def mosaic(planes, pattern, origin=(0, 0)):
    """Keeps at each photosite the plane of its class."""
    height, width = planes["R"].shape
    masks = class_masks(pattern, height, width, origin)
    return np.select([masks[name] for name in "RGB"], [planes[name] for name in "RGB"])
