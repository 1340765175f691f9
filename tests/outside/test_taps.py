"""Amplifiers and drift of the black level beside own draws by numpy."""

import json
import math
import unittest

import numpy as np

from programs import ProgramCase

READOUT = {
    "width": 96, "height": 80, "cfa": "grbg", "full_well_e": 20000, "dark_current_e_per_s": 300, "temperature_k": 300,
    "dcnu": 0.15, "prnu": 0.01, "read_noise_e": 6.0, "bits": 14, "bias_adu": 600, "adu_per_e": 0.6,
}
EXPOSURE_S = 0.033
ELECTRONS = (300.0, 2500.0, 8700.0)
GAIN, OFFSET_E, NOISE_E = (1.0, 1.02, 0.96, 1.01), (0.0, 12.0, -9.0, 4.0), (6.0, 9.0, 7.0, 12.0)


class Taps(ProgramCase):
    def sensor(self, more):
        lines = "".join(f"  {key}: {value}\n" for key, value in {**READOUT, **more}.items())
        path = self.directory / "taps.yaml"
        path.write_text(f"schema: cyanometer-sensor/2\nname: taps\nreadout:\n{lines}", encoding="utf-8")
        return path

    def arguments(self, sensor):
        return ["--sensor", sensor, "--electrons", ",".join(map(str, ELECTRONS)), "--exposure", EXPOSURE_S]

    def predicted(self, sensor, *options):
        done = self.run_program(["predict-noise", *self.arguments(sensor), *options, "--output-format", "json"])
        return json.loads(done)

    def test_the_mixture_of_four_taps(self):
        """Means and variances of 4 million photosites, a quarter behind each tap, within 5 standard errors."""
        lists = {"gain": GAIN, "offset_e": OFFSET_E, "read_noise_e": NOISE_E}
        taps = "{layout: quadrants, " + ", ".join(f"{key}: {list(value)}" for key, value in lists.items()) + "}"
        found = self.predicted(self.sensor({"taps": taps}))
        self.assertNotIn("no_pixels", found)
        stages = {stage["stage"]: stage for stage in found["stages"]}
        random, r, n = np.random.default_rng(21), READOUT, 1_000_000
        for channel, signal in enumerate(ELECTRONS):
            charges, codes = [], []
            for gain, offset_e, noise_e in zip(GAIN, OFFSET_E, NOISE_E):
                charge = random.poisson(signal, n) * (1 + r["prnu"] * random.standard_normal(n))
                dark = r["dark_current_e_per_s"] * EXPOSURE_S
                charge += random.poisson(dark, n) * np.maximum(1 + r["dcnu"] * random.standard_normal(n), 0)
                charges.append(charge + noise_e * random.standard_normal(n))
                codes.append(np.rint(r["bias_adu"] + r["adu_per_e"] * gain * (charges[-1] + offset_e)))
            for stage, groups in [("electrons", charges), ("adu", codes)]:
                mean = np.mean(groups)
                variance = np.mean([((group - mean) ** 2).mean() for group in groups])
                # Groups are as large as they are: each mean has the error of its own samples.
                error = math.sqrt(sum(group.var() for group in groups) / 16 / n)
                self.assertLess(abs(stages[stage]["mean"][channel] - mean) / error, 5, f"mean, {stage}, {signal}")
                of_squares = [((group - mean) ** 2).var() for group in groups]
                error = math.sqrt(sum(of_squares) / 16 / n)
                z = (stages[stage]["std"][channel] ** 2 - variance) / error
                self.assertLess(abs(z), 5, f"variance, {stage}, {signal}")

    def test_pixels_of_three_taps(self):
        """Bilinear pixels of columns by turns over 600 planes of our own: means of channels apart and covariances over all pixels.

        Each is a mean over frames whose scatter from frame to frame tells its error; bound at 5 of these."""
        columns, rows, frames, r = READOUT["width"], READOUT["height"], 600, READOUT
        lists = {"gain": GAIN[:3], "offset_e": OFFSET_E[:3], "read_noise_e": NOISE_E[:3]}
        taps = "{layout: columns, " + ", ".join(f"{key}: {list(value)}" for key, value in lists.items()) + "}"
        found = self.predicted(self.sensor({"taps": taps}), "--method", "bi")
        stage = {stage["stage"]: stage for stage in found["stages"]}["demosaicked"]
        y, x = np.mgrid[:rows, :columns]
        # G R / B G.
        classes = np.where((x + y) % 2 == 0, 1, np.where(y % 2 == 0, 0, 2))
        tap, signal = x % 3, np.array(ELECTRONS)[classes]
        gain, offset_e, noise_e = (np.array(lists[key])[tap] for key in ("gain", "offset_e", "read_noise_e"))
        random, dark = np.random.default_rng(22), r["dark_current_e_per_s"] * EXPOSURE_S
        cross, corners = np.array([[0, 1, 0], [1, 4, 1], [0, 1, 0]]) / 4, np.array([[1, 2, 1], [2, 4, 2], [1, 2, 1]]) / 4

        def filtered(values, kernel):
            padded = np.pad(values, 1, mode="reflect")
            parts = [
                kernel[j, i] * padded[j : j + rows, i : i + columns] for j in range(3) for i in range(3)
            ]
            return sum(parts)

        means, products = [], []
        for _ in range(frames):
            charge = random.poisson(signal) * (1 + r["prnu"] * random.standard_normal(signal.shape))
            charge += random.poisson(dark, signal.shape) * np.maximum(1 + r["dcnu"] * random.standard_normal(signal.shape), 0)
            charge += noise_e * random.standard_normal(signal.shape)
            codes = np.rint(r["bias_adu"] + r["adu_per_e"] * gain * (charge + offset_e))
            kernels = [corners, cross, corners]
            # Weights of the sites of a class alone, of unit sum wherever the pixel is.
            pixels = [filtered(np.where(classes == c, codes, 0), kernels[c]) for c in range(3)]
            shares = [filtered((classes == c).astype(float), kernels[c]) for c in range(3)]
            pixels = [p / s for p, s in zip(pixels, shares)]
            means.append([p.mean() for p in pixels])
            products.append([[(a * b).mean() for b in pixels] for a in pixels])
        means, products = np.array(means), np.array(products)
        whole = means.mean(axis=0)
        # About the mean of all frames: each frame's mean of (x - m)(y - m).
        about = products - means[:, :, None] * whole[None, None, :] - whole[None, :, None] * means[:, None, :]
        about += whole[:, None] * whole[None, :]
        for i in range(3):
            step = stage["mean"][i] - stage["mean"][0]
            off = means[:, i] - means[:, 0] - step
            if i:
                self.assertLess(abs(off.mean()) / off.std() * math.sqrt(frames), 5, f"mean {i}")
            for j in range(3):
                z = (about[:, i, j].mean() - stage["covariance"][i][j]) / about[:, i, j].std() * math.sqrt(frames)
                self.assertLess(abs(z), 5, f"covariance {i} {j}: {about[:, i, j].mean()} {stage['covariance'][i][j]}")

    def test_the_covariance_of_rows(self):
        """Means of rows of 300 frames without other noise: variance and covariance by the formula, over the places of rows.

        A frame has 80 rows, and 9 knots that are drawn: the mean square of a frame over rows has the relative variance of at most
        2/9 with the neighbors' covariance, so that 300 frames tell it to 3 %; bound at 5 of these."""
        rows, rms, frames = 9.5, 40.0, 300
        sensor = self.sensor({"black_drift_e": rms, "black_drift_rows": rows})
        sources = "dcsn,dcnu,ssn,prnu,ron"
        light = self.run_program(["render-radiance", *self.arguments(sensor), "--size", "4x80"])
        drift = []
        for frame in range(frames):
            planes = self.frame(["add-noise", "--without", sources, "--frame", frame], stdin=light)
            self.assertTrue(all(np.ptp(planes[name], axis=1).max() == 0 for name in "RGB"))
            drift.append(planes["R"][:, 0].astype(float))
        drift = np.array(drift) - np.float32(ELECTRONS[0]) - READOUT["dark_current_e_per_s"] * EXPOSURE_S
        for lag in (0, 2, 5, 9, 13, 25):
            delta = lag / rows
            expected = 0.0
            if delta < 2:
                expected = (1 - delta / 2) * math.cos(math.pi * delta / 2) + math.sin(math.pi * delta / 2) / math.pi
            found = (drift[:, : 80 - lag] * drift[:, lag:]).mean() / rms**2
            self.assertLess(abs(found - expected), 5 * math.sqrt(2 / 9 / frames), f"lag {lag}: {found} {expected}")

    def test_the_mean_of_a_patch(self):
        """Var x̄ = Var/n + rms² Σ C(|y − y'|)/h², the sum over all pairs of rows by hand."""
        rows, rms, (width, height) = 30.0, 5.0, (20, 50)
        plain = self.predicted(self.sensor({}), "--patch", f"{width}x{height}")
        drifting = self.sensor({"black_drift_e": rms, "black_drift_rows": rows})
        found = self.predicted(drifting, "--patch", f"{width}x{height}")
        lag = np.abs(np.subtract.outer(np.arange(height), np.arange(height))) / rows
        covariance = (1 - lag / 2) * np.cos(np.pi * lag / 2) + np.sin(np.pi * lag / 2) / np.pi
        more = rms**2 * np.where(lag < 2, covariance, 0).mean()
        stages = [{stage["stage"]: stage for stage in of["stages"]}["electrons"] for of in (plain, found)]
        for before, after in zip(*(stage["patch_mean_std"] for stage in stages)):
            self.assertAlmostEqual((after**2 - before**2) / more, 1, delta=1e-9)


if __name__ == "__main__":
    unittest.main()
