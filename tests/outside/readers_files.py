"""Files that pages of docs call the reader's own, for the hidden set-up of their commands (scripts/test-docs)."""

import os
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


def color_chart(path):
    """A picture of a ColorChecker, a pixel a patch, linear in the primaries of BT.2020; black and white are its own."""
    import OpenImageIO as oiio

    table = pathlib.Path(os.environ["TREE"], "sample_data/charts/colorchecker.csv").read_text().splitlines()
    rows = [line.split(",") for line in table if line and not line.startswith("#")]
    at = [rows[0].index(name) for name in ("L", "a", "b")]
    L, a, b = np.array([[float(row[n]) for n in at] for row in rows[1:]]).T
    f = np.stack([(L + 16) / 116 + a / 500, (L + 16) / 116, (L + 16) / 116 - b / 200])
    relative = np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))
    # The colors as shares of white stand for those under D65, as in von Kries' adaptation of X, Y and Z.
    xyz = relative * np.array([[0.95047], [1.0], [1.08883]])
    primaries = np.array([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]])
    columns = np.stack([primaries[:, 0], primaries[:, 1], 1 - primaries.sum(axis=1)]) / primaries[:, 1]
    scale = np.linalg.solve(columns, [0.95047, 1.0, 1.08883])
    rgb = np.linalg.solve(columns * scale, xyz).T.reshape(4, 6, 3).astype("f4")
    image = oiio.ImageOutput.create(path)
    image.open(path, oiio.ImageSpec(6, 4, 3, oiio.FLOAT))
    image.write_image(np.ascontiguousarray(rgb))
    image.close()
