"""The whole chain without noise: spectral radiance in, absolute XYZ out, beside sums with the CIE 1931 observer."""

import csv
import unittest

import numpy as np

from programs import ProgramCase, read_planes, read_table, sample_data
from test_radiance import Sensor

# Short enough that no sky of the library fills a photosite.
EXPOSURE_S = 0.002
# Effective-color interpolation looks three photosites around.
PATCH, MARGIN = 10, 3
WITHOUT_NOISE = ["add-noise", "--without", "dcsn,dcnu,ssn,prnu,ron"]


def library_radiance(name="sky912"):
    channels = read_planes(sample_data(f"skies/{name}.exr"))
    return np.stack([channels[f"S0.{nm},000000nm"] for nm in range(360, 831)], axis=-1).astype(np.float64)


def tristimulus(radiance):
    """Absolute XYZ, Y in cd/m², of radiance in W/(cm² sr nm) at 360 … 830 nm."""
    observer = read_table(sample_data("observers/cie1931_2deg_1nm.csv"))
    matching = np.stack([observer[name] for name in ("xbar", "ybar", "zbar")], axis=-1)
    return 683 * 1e4 * radiance @ matching


def chromaticity(xyz):
    return xyz[..., :2] / xyz.sum(axis=-1, keepdims=True)


class Chain(ProgramCase):
    def setUp(self):
        super().setUp()
        self.library = sample_data("skies/sky912.exr")
        self.radiance = library_radiance()
        self.truth = tristimulus(self.radiance)
        self.run_program(["fit-matrix", self.library, "--sensor", "kaf-5101ce", "-o", "matrix.yaml"])

    def measured(self, exposure_s, method):
        """XYZ of each sky: the mean of the inner photosites of its patch."""
        planes = self.frame(
            ["render-radiance", self.library, "--patch", f"{PATCH}x{PATCH}", "--exposure", exposure_s],
            WITHOUT_NOISE,
            ["digitize"],
            ["mosaic"],
            ["demosaic", "--method", method],
            ["to-xyz", "--matrix", "matrix.yaml"],
        )
        self.assertEqual(sorted(set(planes) - {"mask"}), ["B", "G", "R"])
        # No sample is near full well; the metadata know no brightest one, so that there is a layer of marks, and it is empty.
        self.assertFalse(planes["mask"].any())
        xyz = np.stack([planes[name].astype(np.float64) for name in "RGB"], axis=-1)
        patches = xyz.reshape(24, PATCH, 38, PATCH, 3)
        return patches[:, MARGIN:-MARGIN, :, MARGIN:-MARGIN].mean(axis=(1, 3))

    def bright(self, exposure_s):
        """Skies that reach 1000 electrons in each class: rounding to codes then matters by less than 1 %."""
        electrons = Sensor().electrons(self.radiance, exposure_s)
        levels = np.stack([electrons[name] for name in "RGB"], axis=-1)
        self.assertLess(levels.max(), 39000)
        used = levels.min(axis=-1) > 1000
        self.assertGreater(np.count_nonzero(used), 100)
        return used

    def test_sky_library_comes_back(self):
        # Least squares over all 912 skies leaves at most 1.4 % in X and 0.0018 in xy (median 0.3 % and 0.0002); rounding
        # to codes adds up to 1 %.
        for method in ("bi", "eci"):
            xyz = self.measured(EXPOSURE_S, method)
            used = self.bright(EXPOSURE_S)
            error = np.abs(xyz / self.truth - 1)[used]
            self.assertLess(error.max(), 0.05, method)
            self.assertLess(np.median(error, axis=0).max(), 0.01, method)
            xy = np.abs(chromaticity(xyz) - chromaticity(self.truth))[used]
            self.assertLess(xy.max(), 0.006, method)

    def test_exposure_does_not_change_the_color(self):
        long, short = (self.measured(exposure, "bi") for exposure in (EXPOSURE_S, EXPOSURE_S * 0.6))
        used = self.bright(EXPOSURE_S * 0.6)
        self.assertLess(np.median(np.abs(short / long - 1)[used]), 0.01)


def library_meta(name):
    path = sample_data(f"skies/{name}_meta.csv")
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


class Reference(unittest.TestCase):
    def agrees_with_its_table(self, name, width, height):
        radiance, meta = library_radiance(name), library_meta(name)
        self.assertEqual(radiance.shape, (height, width, 471))
        self.assertTrue(np.isfinite(radiance).all() and (radiance > 0).all())
        self.assertEqual([int(row["id"]) for row in meta], list(range(width * height)))
        xyz = tristimulus(radiance).reshape(width * height, 3)
        np.testing.assert_allclose(xyz[:, 1], [float(row["Y_cd_m2"]) for row in meta], rtol=2e-5)
        stated = [[float(row["x"]), float(row["y"])] for row in meta]
        np.testing.assert_allclose(chromaticity(xyz), stated, atol=1e-5)

    def test_luminance_and_chromaticity_of_the_library(self):
        self.agrees_with_its_table("sky912", 38, 24)

    def test_luminance_and_chromaticity_of_the_measured_library(self):
        self.agrees_with_its_table("kider2014", 80, 20)

    def test_measured_library_leaves_the_first_direction_of_each_scan_out(self):
        originals = [int(row["original_id"]) for row in library_meta("kider2014")]
        self.assertEqual(originals, [81 * scan + direction for scan in range(20) for direction in range(1, 81)])

    def test_measured_library_keeps_all_digits(self):
        # A spectrum of the same set that stands beside the library as text.
        lines = sample_data("skies/measured_blue.csv").read_text(encoding="utf-8").splitlines()
        self.assertTrue(lines[0].startswith("# Sky radiance, measured; id 1432 of the original set"))
        digits = [line.split(",")[1] for line in lines if line[0].isdigit()]
        (number,) = (int(row["id"]) for row in library_meta("kider2014") if row["original_id"] == "1432")
        spectrum = library_radiance("kider2014").reshape(-1, 471)[number]
        self.assertEqual([f"{value:.4e}" for value in spectrum], digits)
