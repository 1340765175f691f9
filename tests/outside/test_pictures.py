"""Pictures in R, G, B as scenes: PNG written by Pillow, spectra from the formula of Jakob and Hanika (2019) by scipy."""

import unittest

import numpy as np
from PIL import Image
from scipy.optimize import least_squares

from programs import ProgramCase, read_planes, read_table, sample_data
from test_radiance import Sensor

# XYZ of sRGB's primaries at unit luminance of the white (0.3127, 0.3290), IEC 61966-2-1 worked out in doubles.
XY = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])
D65_XY = np.array([0.3127, 0.3290])

CODES = np.array(
    [[255, 255, 255], [255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0], [200, 40, 90], [12, 30, 80], [3, 2, 1]],
    np.uint8,
)


def xyz_from_srgb():
    columns = np.stack([XY[:, 0], XY[:, 1], 1 - XY.sum(1)])
    white = np.array([*D65_XY, 1 - D65_XY.sum()]) / D65_XY[1]
    return columns * np.linalg.solve(columns, white)


def linear(codes):
    values = codes / 255
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


class Pictures(ProgramCase):
    def setUp(self):
        super().setUp()
        observer = read_table(sample_data("observers/cie1931_2deg_1nm.csv"))
        self.nm = observer["wavelength_nm"]
        self.light = read_table(sample_data("illuminants/cie_d65_1nm.csv"))["D65"]
        self.matching = np.stack([observer[name] for name in ("xbar", "ybar", "zbar")]) * self.light
        self.white = self.matching.sum(1)

    def spectrum(self, wanted):
        """The spectrum of tristimulus values relative to white, by a trust region in wavelengths of 100 nm about 550."""
        place = (self.nm - 550) / 100

        def sigmoid(c):
            x = c[0] * place**2 + c[1] * place + c[2]
            return 0.5 + x / (2 * np.sqrt(1 + x * x))

        # In steps from gray, so that the solver starts near its end.
        c = np.zeros(3)
        for share in np.linspace(0, 1, 9)[1:]:
            aim = 0.25 + share * (wanted - 0.25)
            found = least_squares(
                lambda c: self.matching @ sigmoid(c) / self.white / aim - 1, c, xtol=1e-15, ftol=1e-15, gtol=1e-15
            )
            c = found.x
        assert np.abs(found.fun).max() < 1e-9, found
        return sigmoid(c)

    def test_electrons_of_a_png_are_those_of_the_formula(self):
        Image.fromarray(CODES[None]).save(self.path("in.png"))
        luminance = 321.0
        self.run_program(["render-radiance", "in.png", "--luminance", luminance, "-o", "out.exr"])
        made = np.stack([read_planes(self.path("out.exr"))[name][0] for name in "RGB"])
        # The table's white for the standard's: 10⁻⁵ of each, by von Kries on XYZ here and Bradford there.
        xyz = xyz_from_srgb() @ linear(CODES).T
        relative = xyz / xyz_from_srgb().sum(1)[:, None]
        radiance = self.light * luminance / (683 * 1e4 * self.matching[1].sum())
        for pixel, color in enumerate(relative.T):
            factor = color.max() / 0.25
            spectrum = factor * self.spectrum(color / factor)
            expected = Sensor().electrons(radiance * spectrum)
            for plane, name in enumerate("RGB"):
                electrons = expected[name]
                # Half a digit of the white's chromaticities moves saturated colors by some 10⁻⁴.
                self.assertLess(abs(made[plane, pixel] / electrons - 1), 3e-4, (CODES[pixel], name, made[plane, pixel]))


if __name__ == "__main__":
    unittest.main()
