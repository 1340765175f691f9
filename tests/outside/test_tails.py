"""Hot pixels and random telegraph signals beside an independent computation: own draws by numpy, and integrals by scipy."""

import json
import unittest

import numpy as np
from scipy import integrate

from programs import ProgramCase

READOUT = {
    "width": 400, "height": 300, "cfa": "grbg", "full_well_e": 9000, "dark_current_e_per_s": 400, "temperature_k": 300,
    "dcnu": 0.15, "prnu": 0.01, "read_noise_e": 6.0, "hot_pixel_share": 0.08, "hot_pixel_dark_current_e_per_s": 60_000,
    "rts_share": 0.2, "rts_amplitude_e": 25.0, "bits": 14, "bias_adu": 900, "adu_per_e": 0.6,
}
EXPOSURE_S = 0.033
ELECTRONS = (300.0, 2500.0, 8700.0)


class Tails(ProgramCase):
    def sensor(self, **changes):
        lines = "".join(f"  {key}: {value}\n" for key, value in {**READOUT, **changes}.items())
        path = self.directory / "tails.yaml"
        path.write_text(f"schema: cyanometer-sensor/2\nname: tails\nreadout:\n{lines}", encoding="utf-8")
        return path

    def predicted(self, sensor):
        electrons = ",".join(str(signal) for signal in ELECTRONS)
        done = self.run_program(
            ["predict-noise", "--sensor", sensor, "--electrons", electrons, "--exposure", EXPOSURE_S, "--method", "eci",
             "--output-format", "json"]
        )
        return {stage["stage"]: stage for stage in json.loads(done)["stages"]}

    def test_moments_of_own_draws(self):
        """Means and variances of 4 million photosites, within 5 standard errors, of which the sample's fourth moment tells."""
        stages = self.predicted(self.sensor())
        random, r, n = np.random.default_rng(20), READOUT, 4_000_000
        for channel, signal in enumerate(ELECTRONS):
            dark = r["dark_current_e_per_s"] * EXPOSURE_S
            hot = r["hot_pixel_dark_current_e_per_s"] * EXPOSURE_S * random.exponential(size=n)
            hot *= random.random(n) < r["hot_pixel_share"]
            relative = 1 + r["dcnu"] * random.standard_normal(n) * dark / (dark + hot)
            charge = random.poisson(signal, n) * (1 + r["prnu"] * random.standard_normal(n))
            charge += random.poisson(dark + hot) * np.maximum(relative, 0)
            jump = r["rts_amplitude_e"] * random.exponential(size=n) * (random.random(n) < r["rts_share"])
            jump *= random.choice([-1, 0, 0, 1], n)
            electrons = np.minimum(charge, r["full_well_e"]) + r["read_noise_e"] * random.standard_normal(n) + jump
            codes = np.clip(np.rint(r["bias_adu"] + r["adu_per_e"] * electrons), 0, 2**14 - 1)
            for stage, samples in [("electrons", electrons), ("adu", codes)]:
                mean, variance = samples.mean(), samples.var()
                fourth = ((samples - mean) ** 4).mean()
                predicted = stages[stage]
                z = (predicted["mean"][channel] - mean) / np.sqrt(variance / n)
                self.assertLess(abs(z), 5, f"mean, {stage}, {signal}")
                z = (predicted["std"][channel] ** 2 - variance) / np.sqrt((fourth - variance**2) / n)
                self.assertLess(abs(z), 5, f"variance, {stage}, {signal}")

    def test_a_full_well_by_quadrature(self):
        """Without patterns and counts that matter: the mean charge of hot pixels that full well cuts off, H (1 − e^(−W/H))."""
        hot = READOUT["hot_pixel_dark_current_e_per_s"] * EXPOSURE_S * 10
        sensor = self.sensor(dcnu=0, prnu=0, rts_share=1e-9, rts_amplitude_e=1e-9, hot_pixel_share=1, dark_current_e_per_s=0,
                             hot_pixel_dark_current_e_per_s=hot / EXPOSURE_S)
        found = self.predicted(sensor)["electrons"]
        full, signal = READOUT["full_well_e"], ELECTRONS[0]

        def moment(power):
            below, _ = integrate.quad(lambda h: np.exp(-h / hot) / hot * (signal + h) ** power, 0, full - signal)
            return below + full**power * np.exp(-(full - signal) / hot)

        mean, square = moment(1), moment(2)
        # Shot noise √W about the well takes W/2H of a mean of W², √W a thousandth of W, and adds that of what is below.
        self.assertAlmostEqual(found["mean"][0] / mean, 1, delta=1e-3)
        self.assertAlmostEqual(found["std"][0] / np.sqrt(square - mean**2), 1, delta=3e-3)


if __name__ == "__main__":
    unittest.main()
