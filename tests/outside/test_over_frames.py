"""Statistics over frames, and averages of them, beside own analysis of variance by numpy."""

import json
import unittest

import numpy as np
import OpenImageIO as oiio

from programs import ProgramCase

ELECTRONS = "2000,4000,3000"
FRAMES = 24

SENSOR = """schema: cyanometer-sensor/2
name: over frames
readout:
  {width: 120, height: 90, cfa: grbg, full_well_e: 12000, dark_current_e_per_s: 900, temperature_k: 298, dcnu: 0.2,
   prnu: 0.012, read_noise_e: 6, row_noise_e: 2, dsnu_e: 4, dsnu_column_e: 1.5, bits: 14, bias_adu: 400, adu_per_e: 0.8,
   pixel_pitch_um: 3.45}
xyz_from_camera:
  - [8.7e-4, 4.5e-5, 4.4e-5]
  - [3.7e-4, 3.1e-4, -2.6e-5]
  - [1.0e-4, -1.6e-4, 5.3e-4]
"""


def samples(path, names=None):
    """Channels of a file by name, in doubles."""
    image = oiio.ImageBuf(str(path))
    pixels = image.get_pixels(oiio.FLOAT).astype(float)
    found = dict(zip(image.spec().channelnames, np.moveaxis(pixels, 2, 0), strict=True))
    return found if names is None else np.array([found[name] for name in names])


def of_two_ways(stack):
    """Temporal, fixed and mean variances of frames [frame, row, column]."""
    frames, pixels = stack.shape[0], stack[0].size
    flat = stack.reshape(frames, pixels)
    of_pixels, of_frames = flat.mean(axis=0), flat.mean(axis=1)
    residuals = flat - of_pixels - of_frames[:, None] + flat.mean()
    temporal = (residuals**2).sum() / ((frames - 1) * (pixels - 1))
    of_means = of_pixels.var(ddof=1)
    return temporal, of_means - temporal / frames, of_means, of_frames.var(ddof=1)


class OverFrames(ProgramCase):
    def setUp(self):
        super().setUp()
        self.sensor = self.directory / "sensor.yaml"
        self.sensor.write_text(SENSOR, encoding="utf-8")
        scene = self.directory / "scene.exr"
        self.run_program(
            ["render-radiance", "--sensor", self.sensor, "--electrons", ELECTRONS, "--size", "120x90", "--exposure", "0.1",
             "-o", scene]
        )
        noisy = self.directory / "noisy-{frame:02}.exr"
        self.run_program(["add-noise", scene, "--seed", "5", "--frames", f"0..{FRAMES}", "-o", noisy])
        self.names = [f"{frame:02}" for frame in range(FRAMES)]

    def files(self, stem):
        return [self.directory / f"{stem}-{name}.exr" for name in self.names]

    def through(self, program, stem, made, *options):
        pattern = self.directory / (made + "-{stem}.exr")
        self.run_program([program, *options, *self.files(stem), "-o", pattern])
        for old, new in zip(self.files(f"{made}-{stem}"), self.files(made), strict=True):
            old.rename(new)
            old.with_name(old.name + ".yaml").rename(new.with_name(new.name + ".yaml"))

    def make_planes(self):
        self.through("digitize", "noisy", "codes")
        self.through("mosaic", "codes", "plane")

    def test_the_analysis_is_that_of_numpy(self):
        """Electrons of three classes and codes of a plane: T, F, S and Var f to 10⁻⁶, the rounding of means to floats."""
        self.make_planes()
        report = json.loads(
            self.run_program(["measure", "--over", "frames", "--output-format", "json", *self.files("noisy")])
        )
        stack = np.array([samples(path, "RGB") for path in self.files("noisy")])
        for index, channel in enumerate(report["regions"][0]["channels"]):
            self.compare(channel, stack[:, index])
        pixels = self.directory / "pixels.exr"
        report = json.loads(
            self.run_program(
                ["measure", "--over", "frames", "--output-format", "json", "--pixels", pixels, *self.files("plane")]
            )
        )
        stack = np.array([samples(path, "Y")[0] for path in self.files("plane")])
        for channel, site in zip(report["regions"][0]["classes"], [[(0, 1)], [(0, 0), (1, 1)], [(1, 0)]], strict=True):
            parts = [stack[:, y::2, x::2].reshape(FRAMES, -1) for y, x in site]
            self.compare(channel, np.concatenate(parts, axis=1)[:, None])
        made = samples(pixels)
        np.testing.assert_allclose(made["Y"], stack.mean(axis=0), rtol=1e-7)
        np.testing.assert_allclose(made["variance.Y"], stack.var(axis=0, ddof=1), rtol=1e-6)

    def compare(self, channel, stack):
        temporal, fixed, of_means, of_frames = of_two_ways(stack)
        for key, variance in [("temporal_std", temporal), ("fixed_std", fixed), ("std_of_means", of_means),
                              ("std_of_frame_means", of_frames)]:
            self.assertAlmostEqual(channel[key] / np.sqrt(variance), 1, delta=1e-5, msg=f"{channel['name']} {key}")

    def test_predictions_are_those_of_the_model(self):
        """Light ρ, dark signal δ, K = 0.8: v = K² (ρ (1 + s²) + δ (1 + d²) + r²) + 1/12, and fixed K² (ρ² s² + δ² d² + offsets²);
        s² n_r of rows comes apart as frames do. What n rows, or columns, of a class share differs among its N photosites by
        (1 − 1/n) N/(N − 1) of its variance. Exact to what is cut off at zero and rounded: 10⁻⁶."""
        self.make_planes()
        report = json.loads(
            self.run_program(["measure", "--over", "frames", "--output-format", "json", *self.files("plane")])
        )
        dark, square = 90.0, 0.8**2
        shapes = [(45, 60, 2700), (90, 120, 5400), (45, 60, 2700)]
        classes = zip(report["regions"][0]["classes"], [2000.0, 4000.0, 3000.0], shapes, strict=True)
        for channel, light, (rows, columns, sites) in classes:
            of_rows, of_columns = [(1 - 1 / lines) * sites / (sites - 1) for lines in (rows, columns)]
            temporal = square * (light * (1 + 0.012**2) + dark * (1 + 0.2**2) + 6**2 + 2**2 * of_rows) + 1 / 12
            fixed = square * ((light * 0.012) ** 2 + (dark * 0.2) ** 2 + 4**2 + 1.5**2 * of_columns)
            self.assertAlmostEqual(channel["predicted_temporal_std"] ** 2 / temporal, 1, delta=1e-6)
            self.assertAlmostEqual(channel["predicted_fixed_std"] ** 2 / fixed, 1, delta=1e-6)

    def test_averages_are_those_of_numpy(self):
        """Mean and median to the rounding of floats; what three standard deviations leave, by the same rule in numpy."""
        stack = np.array([samples(path, "RGB") for path in self.files("noisy")])
        made = self.directory / "average.exr"
        for combine, expected in [("mean", stack.mean(axis=0)), ("median", np.median(stack, axis=0)),
                                  ("clipped", clipped(stack, 2.5))]:
            limits = ["--clip", "2.5"] if combine == "clipped" else []
            self.run_program(["average-frames", "--combine", combine, *limits, *self.files("noisy"), "-o", made])
            np.testing.assert_allclose(samples(made, "RGB"), expected, rtol=3e-7, err_msg=combine)

    def test_standard_deviations_of_an_average_are_those_of_averages(self):
        """XYZ of the mean of 24: over pixels it scatters as its layers say, and so do its own covariances, within 5 standard errors of
        10 800 pixels of which a tenth are as good as independent; σ/√24 of one frame would be far off."""
        self.make_planes()
        mean, xyz = self.directory / "mean.exr", self.directory / "xyz.exr"
        self.run_program(["average-frames", *self.files("plane"), "-o", mean])
        rgb = self.directory / "rgb.exr"
        self.run_program(["demosaic", "--method", "eci", mean, "-o", rgb])
        self.run_program(["to-xyz", "--sigma", rgb, "-o", xyz])
        before = samples(xyz)
        # The same average of what was converted first.
        self.through("demosaic", "plane", "camera", "--method", "eci")
        self.through("to-xyz", "camera", "color", "--sigma")
        after = self.directory / "after.exr"
        self.run_program(["average-frames", *self.files("color"), "-o", after])
        behind = samples(after)
        self.assertEqual(set(before), set(behind))
        one = samples(self.files("color")[0])
        for name in "RGB":
            np.testing.assert_allclose(behind[name], before[name], rtol=1e-5, atol=1e-3)
            sigma = f"sigma.{name}"
            self.assertAlmostEqual(np.mean(behind[sigma] / before[sigma]), 1, delta=1e-3)
            scatter = before[name][4:-4, 4:-4].std(ddof=1)
            told = np.sqrt(np.mean(before[sigma][4:-4, 4:-4] ** 2))
            self.assertAlmostEqual(scatter / told, 1, delta=5 * np.sqrt(0.5 / (0.1 * before[name].size)))
            self.assertGreater(told, 1.5 * np.sqrt(np.mean(one[sigma] ** 2) / FRAMES))

    def test_an_averaged_dark_frame_counts_as_its_frames(self):
        """A frame less the average of eight dark frames has the samples and the prediction of one less the eight."""
        dark = self.directory / "dark.exr"
        self.run_program(["render-radiance", "--sensor", self.sensor, "--dark", "--size", "120x90", "--exposure", "0.1",
                          "-o", dark])
        darks = []
        for frame in range(100, 108):
            electrons, path = self.directory / "d.exr", self.directory / f"dark-{frame}.exr"
            self.run_program(["add-noise", dark, "--seed", "5", "--frame", frame, "-o", electrons])
            self.run_program(["digitize", electrons, "-o", path])
            darks.append(path)
        self.through("digitize", "noisy", "codes")
        light, master = self.files("codes")[0], self.directory / "master.exr"
        self.run_program(["average-frames", *darks, "-o", master])
        made = [self.directory / "eight.exr", self.directory / "one.exr"]
        given = [option for path in darks for option in ("--dark", path)]
        self.run_program(["correct-frame", light, *given, "-o", made[0]])
        self.run_program(["correct-frame", light, "--dark", master, "-o", made[1]])
        np.testing.assert_allclose(samples(made[0], "RGB"), samples(made[1], "RGB"), atol=1e-3)
        told = [json.loads(self.run_program(["measure", "--output-format", "json", path]))["regions"][0] for path in made]
        for a, b in zip(told[0]["channels"], told[1]["channels"], strict=True):
            self.assertAlmostEqual(a["predicted_std"] / b["predicted_std"], 1, delta=1e-9)
            self.assertLess(abs(a["z_std"]), 5)


def clipped(stack, kappa):
    """The mean of what lies within so many standard deviations (divisor n − 1) of the median, until none is left out."""
    made = np.empty(stack.shape[1:])
    for place in np.ndindex(made.shape):
        kept = stack[(slice(None), *place)]
        while True:
            inside = kept[np.abs(kept - np.median(kept)) <= kappa * kept.std(ddof=1)]
            if len(inside) == len(kept):
                break
            kept = inside
        made[place] = kept.mean()
    return made


if __name__ == "__main__":
    unittest.main()
