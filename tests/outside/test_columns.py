"""Smear and blooming of a CCD beside an independent computation by numpy: column sums, and charge that is poured photosite by photosite."""

import unittest

import numpy as np

from programs import ProgramCase

ROWS, COLUMNS = 60, 34
EXPOSURE_S, SMEAR_S, FULL_E = 0.02, 5e-6, 8000.0
WITHOUT = "dcsn,dcnu,ssn,prnu,ron"
SENSOR = f"""schema: cyanometer-sensor/2
name: columns
readout:
  width: {COLUMNS}
  height: {ROWS}
  cfa: grbg
  full_well_e: {FULL_E}
  dark_current_e_per_s: 0
  temperature_k: 290
  dcnu: 0
  prnu: 0
  read_noise_e: 3
  bits: 14
  bias_adu: 100
  adu_per_e: 1
"""


def pour(wells, charge, way):
    """Fills the wells on the way, the nearest first; gives what is left."""
    for y in way:
        taken = min(charge, FULL_E - wells[y])
        wells[y] += taken
        charge -= taken
    return charge


def spilled(column, share):
    """The wells of a column at last, and what left it at its ends."""
    excess = share * np.maximum(column - FULL_E, 0) / 2
    wells, lost = np.minimum(column, FULL_E), 0.0
    for y in range(ROWS):
        lost += pour(wells, excess[y], range(y + 1, ROWS))
    for y in reversed(range(ROWS)):
        lost += pour(wells, excess[y], reversed(range(y)))
    return wells, lost


class Columns(ProgramCase):
    def expose(self, light, **keys):
        """What is made of expected electrons of a plane, without any noise."""
        light.astype("<f4").tofile(self.directory / "light.raw")
        lines = ["schema: cyanometer/1", "quantity: expected_electrons", "cfa: grbg",
                 f"exposure: {{exposure_s: {EXPOSURE_S}, f_number: 8.0, lens_transmittance: 1.0}}"]
        (self.directory / "light.raw.yaml").write_text("\n".join(lines) + "\n")
        more = "".join(f"  {key}: {value}\n" for key, value in keys.items())
        (self.directory / "ccd.yaml").write_text(SENSOR + more)
        return self.frame(["add-noise", "-q", "light.raw", "--raw", f"{COLUMNS}x{ROWS}:f32le", "--sensor", "ccd.yaml",
                           "--without", WITHOUT])["Y"]

    def test_columns(self):
        chance = np.random.default_rng(16)
        light = chance.uniform(0, 500, (ROWS, COLUMNS)).astype("f4").astype("f8")
        light[chance.random(light.shape) > 0.98] = 50_000
        smeared = light + SMEAR_S / EXPOSURE_S * light.sum(axis=0)
        # Samples and sums of them are single precision.
        close = {"rtol": 1e-6, "atol": 4 * FULL_E * 2.0**-24}
        np.testing.assert_allclose(self.expose(light, smear_line_s=SMEAR_S), np.minimum(smeared, FULL_E), **close)
        for share in (0.2, 1.0):
            wells = [spilled(column, share) for column in smeared.T]
            found = self.expose(light, smear_line_s=SMEAR_S, blooming=share)
            np.testing.assert_allclose(found.T, [well for well, _ in wells], rtol=1e-6, atol=ROWS * FULL_E * 2.0**-23)
            drained = (1 - share) * np.maximum(smeared - FULL_E, 0).sum()
            kept = found.astype("f8").sum() + drained + sum(lost for _, lost in wells)
            self.assertLess(abs(kept - smeared.sum()), ROWS * COLUMNS * FULL_E * 2.0**-23)


if __name__ == "__main__":
    unittest.main()
