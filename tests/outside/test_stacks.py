"""Stacks as xarray and zarr read them, and arrays of theirs as frames."""

import json
import unittest
import warnings

import numpy as np
import OpenImageIO as oiio
import xarray
import yaml
import zarr

from programs import ProgramCase, sample_data


def pixels(path):
    """Samples of a file, row by column by channel, and the names of the channels."""
    image = oiio.ImageBuf(str(path))
    return image.get_pixels(oiio.FLOAT), list(image.spec().channelnames)


class Stacks(ProgramCase):
    def setUp(self):
        super().setUp()
        self.scene = self.directory / "scene.exr"
        self.run_program(["render-radiance", "--electrons", "9000,39900,5000", "--size", "40x30", "-o", self.scene])

    def stack(self, name, chain):
        """A stack of what a chain makes of seven exposures, and the files of the same frames."""
        frames = self.run_program(["add-noise", self.scene, "--seed", "9", "--frames", "0..7"])
        for line in chain:
            frames = self.run_program(line, stdin=frames)
        made = self.directory / name
        self.run_program(["stack-frames", "-o", made], stdin=frames)
        self.run_program(["stack-frames", "-o", self.directory / (name + "-{index}.exr")], stdin=frames)
        return made, [self.directory / f"{name}-{index}.exr" for index in range(7)]

    def test_xarray_reads_what_files_hold(self):
        matrix = self.directory / "matrix.yaml"
        self.run_program(["fit-matrix", sample_data("skies/sky912.exr"), "-o", matrix])
        to_xyz = ["to-xyz", "--matrix", matrix, "--sigma"]
        for name, chain, stored in [
            ("codes.zarr", [["digitize"]], "uint16"),
            ("xyz.zarr", [["digitize"], ["mosaic"], ["demosaic", "--sigma"], to_xyz], "float32"),
        ]:
            made, files = self.stack(name, chain)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                found = xarray.open_zarr(made).load()
            self.assertEqual(found.samples.dims, ("frame", "row", "column", "channel"))
            self.assertEqual(found.samples.dtype, stored)
            self.assertEqual(found.attrs["schema"], "cyanometer-stack/1")
            arrays = [found.samples.values]
            if "sigma" in found:
                self.assertEqual(list(found.channel.values), ["X", "Y", "Z"])
                self.assertEqual(found.sigma.dims, ("frame", "row", "column", "layer"))
                self.assertEqual(list(found.layer.values)[0], "covariance.XX")
                arrays += [found.sigma.values, found.mask.values[..., np.newaxis]]
                self.assertGreater(np.count_nonzero(found.mask.values), 0)
            together = np.concatenate([array.astype(np.float32) for array in arrays], axis=3)
            for index, path in enumerate(files):
                expected, names = pixels(path)
                # OpenImageIO has R, G, B first, and other channels by name.
                order = [names.index(name) for name in found.attrs["channels"]]
                np.testing.assert_array_equal(together[index], expected[..., order])
                said = yaml.safe_load(str(found.metadata.values[index]))
                self.assertEqual(said["noise"]["frame"], index)
                self.assertEqual(said["quantity"], found.attrs["quantity"])

    def refused(self, path, *wanted):
        done = self.attempt(["stack-frames", path])
        said = done.stderr.decode()
        self.assertEqual(done.returncode, 1, said)
        self.assertEqual(len(said.splitlines()), 1, said)
        for words in (path.name, *wanted):
            self.assertIn(words, said)

    def measured(self, path):
        stream = self.run_program(["stack-frames", path])
        lines = self.run_program(["measure", "--output-format", "json"], stdin=stream).decode()
        return [json.loads(line) for line in lines.splitlines()]

    def test_arrays_of_others_are_frames(self):
        random = np.random.default_rng(3)
        whole = random.integers(0, 60000, (5, 12, 14, 3), dtype=np.uint16)
        zarr.open_group(self.directory / "theirs.zarr", mode="w")
        cases = {
            "plain": (whole, {}),
            "named": (whole[..., 0], {"dimension_names": ("time", "y", "x")}),
            "pixels": (whole[0], {"dimension_names": ("y", "x", "channel")}),
            "one": (whole[0, ..., 0].astype(np.float64) / 7, {}),
            "odd": (whole, {"chunks": (2, 5, 4, 2)}),
            "sharded": (whole, {"chunks": (1, 4, 7, 3), "shards": (2, 8, 14, 3)}),
            "signed": ((whole.astype(np.int32) - 30000).astype(np.int16), {"compressors": None}),
            "half": ((whole / 60000).astype(np.float16), {}),
            "old": (whole, {"zarr_format": 2}),
        }
        for name, (values, options) in cases.items():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                made = zarr.create_array(self.directory / "theirs.zarr" / name, shape=values.shape, dtype=values.dtype,
                                         **({"chunks": values.shape} | options))
            made[...] = values
            expected = values.astype(np.float32)
            frames = expected if expected.ndim == 4 else expected[..., np.newaxis]
            if name in ("pixels", "one"):
                frames = expected.reshape(1, 12, 14, -1)
            path = self.directory / "theirs.zarr" / name
            target = self.directory / (name + "-{index}.exr")
            self.run_program(["stack-frames", path, "-o", target])
            for index, frame in enumerate(frames):
                found, names = pixels(self.directory / f"{name}-{index}.exr")
                order = [names.index(channel) for channel in (["R", "G", "B"] if frame.shape[2] == 3 else ["Y"])]
                np.testing.assert_array_equal(found[..., order], frame, err_msg=name)
        self.assertEqual(len(self.measured(self.directory / "theirs.zarr" / "plain")), 5)
        self.refused(self.directory / "theirs.zarr", "name one of them", "sharded")

    def test_arrays_that_are_no_frames_are_refused(self):
        for name, values, options, wanted in [
            ("five", np.zeros((1, 1, 2, 3, 1), np.float32), {}, ["it has 5 axes"]),
            ("turned", np.zeros((2, 3), np.float32), {"dimension_names": ("x", "y")}, ("x, y", "in this order")),
            ("complex", np.zeros((2, 3), np.complex64), {}, ["type complex64"]),
            ("flat", np.zeros((6,), np.float32), {}, ["a single axis"]),
            ("huge", np.full((2, 3), 1e300), {}, ["beyond 3.4e38"]),
            ("none", np.zeros((0, 3), np.float32), {"chunks": (1, 3)}, ["no frame"]),
        ]:
            made = zarr.create_array(self.directory / f"{name}.zarr", shape=values.shape, dtype=values.dtype,
                                     **({"chunks": values.shape} | options))
            if values.size:
                made[...] = values
                # What is zero is not stored.
            self.refused(self.directory / f"{name}.zarr", *wanted)


if __name__ == "__main__":
    unittest.main()
