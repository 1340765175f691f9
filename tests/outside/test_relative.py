"""A camera's own matrix: from the tags of a DNG to relative XYZ, beside numpy and beside LibRaw (rawpy).

The matrix is worked out here by the specification (DNG 1.7, chapter 6, Mapping Camera Color Space to CIE XYZ Space), with a
correlated color temperature of its own: black bodies summed over the observer's table, the nearest one found by scipy.
"""

import struct
import unittest

import numpy as np
import rawpy
import tifffile
from scipy.ndimage import maximum_filter
from scipy.optimize import minimize_scalar

from conformance.converters import linear_xyz
from programs import ProgramCase, read_planes, read_table, sample_data
from test_raw import RATIO, SHORT, beside, scene, write_dng

SIGNED = 10
D50 = np.array([0.3457, 0.3585])
# Of the numbers that Exif gives to light sources: A, D65, D50, daylight fluorescent, as Adobe's DNG SDK has them.
KELVIN = {17: 2850.0, 21: 6500.0, 23: 5000.0, 12: 6400.0}

WARM = np.array([[0.7034, -0.0804, -0.1014], [-0.4420, 1.2564, 0.2058], [-0.0851, 0.1994, 0.5758]])
COLD = np.array([[0.6461, -0.1164, -0.0857], [-0.3825, 1.1597, 0.2534], [-0.0416, 0.1540, 0.6039]])
CALIBRATIONS = np.array([np.diag([1.02, 1.0, 0.97]), np.diag([0.98, 1.0, 1.01])])


def uv(xy):
    """CIE 1960 u, v."""
    return np.array([4 * xy[0], 6 * xy[1]]) / (12 * xy[1] - 2 * xy[0] + 3)


def chromaticity(xyz):
    """x, y."""
    return xyz[:2] / xyz.sum()


def kelvin_of(xy):
    """Correlated color temperature, 1000 K to 10^6 K."""
    table = read_table(sample_data("observers/cie1931_2deg_1nm.csv"))
    wavelength = table[next(name for name in table if name.startswith("wavelength"))] * 1e-9
    matching = np.array([table[name] for name in ("xbar", "ybar", "zbar")])

    def distance(mired):
        radiance = wavelength**-5 / np.expm1(6.62607015e-34 * 299792458 / (wavelength * 1.380649e-23 * 1e6 / mired))
        return np.hypot(*(uv(chromaticity(matching @ radiance)) - uv(xy)))

    return 1e6 / minimize_scalar(distance, bounds=(1, 1000), method="bounded", options={"xatol": 1e-9}).x


def camera_from_xyz(sets, balance, xy):
    """AB CC CM; each set is (K, CM, CC)."""
    if len(sets) == 1:
        ((_, matrix, calibration),) = sets
    else:
        one, two = sets
        share = (1 / kelvin_of(xy) - 1 / two[0]) / (1 / one[0] - 1 / two[0])
        share = np.clip(share, 0, 1)
        matrix, calibration = (share * one[i] + (1 - share) * two[i] for i in (1, 2))
    return np.diag(balance) @ calibration @ matrix


def relative_matrix(sets, balance=(1, 1, 1), neutral=None, xy=None):
    """The matrix and the white."""
    if xy is None:
        xy = D50
        for _ in range(100):
            before, xy = xy, chromaticity(np.linalg.solve(camera_from_xyz(sets, balance, xy), neutral))
            if np.abs(xy - before).sum() < 1e-10:
                break
    matrix = camera_from_xyz(sets, balance, xy)
    white = np.array([xy[0], xy[1], 1 - xy[0] - xy[1]]) / xy[1]
    return np.linalg.inv(matrix) * (matrix @ white).max(), np.array(xy)


def signed(numbers):
    """SRATIONAL with four decimals."""
    pairs = [part for number in np.ravel(numbers) for part in (round(number * 10000), 10000)]
    return SIGNED, struct.pack(f"<{len(pairs)}i", *pairs)


def ratios(numbers):
    """RATIONAL with four decimals."""
    return RATIO, [part for number in numbers for part in (round(number * 10000), 10000)]


class Relative(ProgramCase):
    """What `import-raw --write-matrix` writes, and what `to-xyz` makes by it."""

    def matrix_of(self, path):
        """xyz_from_camera and white_xy of the matrix file."""
        self.run_program(["import-raw", path, "-o", "plane.exr", "--write-matrix", "m.yaml", "-q"])
        lines = (self.directory / "m.yaml").read_text(encoding="utf-8").splitlines()
        self.assertIn("unit: relative XYZ per (white level - black level)", lines)

        def numbers(key, count):
            start = next(i for i, line in enumerate(lines) if line.startswith(key))
            return [float(line.split()[-1]) for line in lines[start + 1 : start + 1 + count]]

        return np.reshape(numbers("xyz_from_camera", 9), (3, 3)), np.array(numbers("white_xy", 2))

    def check(self, more, *known, **light):
        """A DNG with these tags against the matrix worked out here."""
        path = self.directory / "a.dng"
        write_dng(path, scene(12), 12, more=more)
        found, white = self.matrix_of(path)
        expected, white_xy = relative_matrix(*known, **light)
        # The search ends where a step is below 1e-7.
        np.testing.assert_allclose(white, white_xy, atol=2e-7)
        np.testing.assert_allclose(found, expected, atol=2e-6)

    def test_one_illuminant(self):
        eye = np.eye(3)
        neutral = [0.4038, 1.0, 0.5902]
        self.check({50721: signed(COLD), 50728: ratios(neutral)}, [(0, COLD, eye)], neutral=neutral)
        more = {50721: signed(COLD), 50727: ratios([1.5, 1.0, 0.8]), 50728: ratios(neutral)}
        self.check(more, [(0, COLD, eye)], [1.5, 1.0, 0.8], neutral=neutral)

    def test_two_illuminants(self):
        """Within, at and beyond them, in either order, with calibrations of the camera and gains."""
        balance = [1.2, 1.0, 0.9]
        for first, second in ((17, 21), (21, 17), (23, 17), (12, 23)):
            matrices = {17: WARM, 21: COLD, 23: (WARM + 2 * COLD) / 3, 12: COLD}
            sets = [
                (KELVIN[light], np.round(matrices[light], 4), calibration)
                for light, calibration in zip((first, second), CALIBRATIONS)
            ]
            tags = {
                50721: signed(sets[0][1]),
                50722: signed(sets[1][1]),
                50723: signed(sets[0][2]),
                50724: signed(sets[1][2]),
                50727: ratios(balance),
                50778: (SHORT, [first]),
                50779: (SHORT, [second]),
            }
            for neutral in ([0.40, 1.0, 0.60], [0.62, 1.0, 0.36], [0.8, 1.0, 0.22], [0.36, 1.0, 0.75]):
                with self.subTest(first=first, second=second, neutral=neutral):
                    self.check({**tags, 50728: ratios(neutral)}, sets, balance, neutral=neutral)

    def test_a_white_by_its_chromaticity_and_signatures(self):
        path = self.directory / "a.dng"
        sets = [(2850.0, WARM, np.eye(3)), (6500.0, COLD, np.eye(3))]
        tags = {
            50721: signed(WARM),
            50722: signed(COLD),
            # They were made for another profile, and do not count.
            50723: signed(CALIBRATIONS[0]),
            50724: signed(CALIBRATIONS[1]),
            50931: (2, b"of the camera\0"),
            50932: (2, b"of another\0"),
            50778: (SHORT, [17]),
            50779: (SHORT, [21]),
            50728: None,
            50729: ratios([0.38, 0.38]),
        }
        write_dng(path, scene(12), 12, more=tags)
        found, white = self.matrix_of(path)
        expected, _ = relative_matrix(sets, xy=(0.38, 0.38))
        np.testing.assert_allclose(white, [0.38, 0.38], rtol=1e-15)
        np.testing.assert_allclose(found, expected, atol=2e-6)

    def test_what_is_passed_over_is_told(self):
        path = self.directory / "a.dng"
        both = {50722: signed(WARM), 50778: (SHORT, [21])}
        for more, words in (
            ({50728: None}, "nothing tells the white of the exposure"),
            ({52531: signed(WARM)}, "a third illuminant (ColorMatrix3)"),
            ({50710: (1, [0, 1, 2, 3])}, "its classes are others than R, G and B"),
            ({50728: ratios([0.0, 1.0, 1.0])}, "AsShotNeutral has a number that is not above 0"),
            ({50721: signed(np.ones((3, 3)))}, "singular"),
            ({50721: signed(COLD[:2])}, "its tag ColorMatrix1 has 6 of 9 numbers"),
            ({50727: ratios([1.0, 0.0, 1.0])}, "AnalogBalance has a number that is not above 0"),
        ):
            with self.subTest(words):
                write_dng(path, scene(12), 12, more=more)
                self.run_program(["import-raw", path, "-o", "a.exr"])
                done = self.attempt(["import-raw", path, "-o", "a.exr", "-v"])
                told = done.stderr.decode()
                self.assertIn("its color matrix is passed over: ", told)
                self.assertIn(words, told)
                self.assertNotIn("relative_matrix", (self.directory / "a.exr.yaml").read_text(encoding="utf-8"))
                refused = self.attempt(["import-raw", path, "-o", "b.exr", "--write-matrix", "b.yaml"])
                self.assertEqual(refused.returncode, 1)
                self.assertIn("a.dng: it tells no matrix", refused.stderr.decode())
        # Of two whose illuminants have none the first counts alone.
        write_dng(path, scene(12), 12, more={**both, 50778: (SHORT, [0])})
        told = self.attempt(["import-raw", path, "-o", "a.exr", "-v"]).stderr.decode()
        self.assertIn("its ColorMatrix1 counts alone: the temperatures of the illuminants are not known", told)
        # Of two, one whose illuminant has a temperature counts alone.
        for more in (both, {**both, 50779: (SHORT, [0])}):
            write_dng(path, scene(12), 12, more=more)
            told = self.attempt(["import-raw", path, "-o", "a.exr", "-v"]).stderr.decode()
            self.assertIn("its ColorMatrix1 counts alone: the temperature of the other's illuminant is not known", told)
            self.assertIn("relative_matrix", (self.directory / "a.exr.yaml").read_text(encoding="utf-8"))
        write_dng(path, scene(12), 12, more={50730: (SIGNED, struct.pack("<2i", 1, 4))})
        done = self.attempt(["import-raw", path, "-o", "a.exr", "-v"])
        self.assertIn("its BaselineExposure of 0.25 EV, a hint for pictures, is not applied", done.stderr.decode())

    def test_temperatures_here_are_the_published_ones(self):
        for xy, kelvin in (((0.31272, 0.32903), 6504), ((0.44758, 0.40745), 2856), ((0.34567, 0.35851), 5003)):
            self.assertLess(abs(kelvin_of(np.array(xy)) - kelvin), 1.5)

    def test_libraw_has_the_same_xyz(self):
        """The chart by LibRaw's own way to XYZ, both by bilinear interpolation.

        LibRaw multiplies signals by user_wb, clips them to 16 bits, and goes by a matrix to sRGB whose rows, camera from sRGB,
        were scaled to give 1 for D65; from sRGB it goes to XYZ. The scaling of rows, 1/num, is undone by user_wb = 1/num, whose
        least LibRaw makes 1: what is left is one scale for all. Nothing is white balanced in either. LibRaw drops fractions
        at each of the steps, at most 2 codes of 65535 by coefficients of up to 2.5, and fills the rim in another way.
        """
        path = beside("data/raw") / "colorchart_kissx4_ml_uncompressed14.dng"
        if not path.exists():
            self.skipTest(f"{path.name} is missing")
        with tifffile.TiffFile(path) as file:
            color_matrix = np.reshape(file.pages[0].tags[50721].value, (9, 2))
            neutral = np.reshape(file.pages[0].tags[50728].value, (3, 2))
        color_matrix = (color_matrix[:, 0] / color_matrix[:, 1]).reshape(3, 3)
        found, white = self.matrix_of(path)
        expected, white_xy = relative_matrix([(0, color_matrix, np.eye(3))], neutral=neutral[:, 0] / neutral[:, 1])
        np.testing.assert_allclose(found, expected, rtol=1e-12)
        np.testing.assert_allclose(white, white_xy, rtol=1e-12)
        self.run_program(["demosaic", path, "--method", "bi", "-o", "rgb.exr", "-q"])
        self.run_program(["to-xyz", "rgb.exr", "-o", "xyz.exr", "-q"])
        planes = read_planes(self.path("xyz.exr"))
        ours = np.stack([planes[name] for name in "RGB"], -1).astype(float)
        xyz_from_srgb = np.array(
            [[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]]
        )
        gains = 1 / (color_matrix @ xyz_from_srgb).sum(1)
        with rawpy.imread(str(path)) as raw:
            theirs = linear_xyz(raw, user_wb=[gains[0], gains[1], gains[2], gains[1]]).astype(float)
            dark = maximum_filter(raw.raw_image_visible < raw.black_level_per_channel[0], 3)
        self.assertEqual(ours.shape, theirs.shape)
        ours, theirs, dark = (pixels[2:-2, 2:-2] for pixels in (ours, theirs, dark))
        # Pixels beside a photosite below black, where LibRaw has 0, are left out, as are those near an end of its codes.
        whole = (theirs.min(-1) > 1000) & (theirs.max(-1) < 40000) & ~dark
        self.assertGreater(np.mean(whole), 0.4)
        ours, theirs = ours[whole], theirs[whole]
        scale = np.sum(ours * theirs) / np.sum(ours * ours)
        worst = np.max(np.abs(ours * scale - theirs) - 1e-3 * theirs)
        self.assertLess(worst, 5)
        for channel in range(3):
            ratio = theirs[:, channel].sum() / ours[:, channel].sum()
            self.assertLess(abs(ratio / scale - 1), 2e-4)


if __name__ == "__main__":
    unittest.main()
