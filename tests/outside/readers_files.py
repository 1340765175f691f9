"""Files that pages of docs call the reader's own, for the hidden set-up of their commands (scripts/test-docs)."""

import pathlib

import numpy as np

from conformance.tags import Tags
from test_makers import nef


def as_of_a_camera(*paths):
    """Leaves a DNG of ours its tags alone, and takes its sidecar away, so that it is read as a camera's file."""
    for path in map(pathlib.Path, paths):
        tags = Tags(path)
        tags.forget_metadata()
        tags.write()
        pathlib.Path(f"{path}.yaml").unlink(missing_ok=True)


def nefs(directory, count):
    """Files laid out as Nikon's, of gray light."""
    pathlib.Path(directory).mkdir(exist_ok=True)
    for number in range(1, count + 1):
        samples = np.random.default_rng(number).normal(1500, 40, (48, 64)).clip(0, 4095).round().astype(int)
        (pathlib.Path(directory) / f"{number}.nef").write_bytes(nef(samples))
