"""Matrices from charts beside scipy, spaces and adaptation beside formulas written down again here, and a real chart."""

import json
import unittest

import numpy as np
import rawpy
import tifffile
from scipy.optimize import brentq, minimize

from programs import ProgramCase, read_planes, read_table, sample_data, write_planes
from test_raw import beside

XYZ_YAML = "schema: cyanometer/1\nquantity: xyz\nunit: cd m-2\n"
D50, D65, A = (0.3457, 0.3585), (0.3127, 0.3290), (0.44757, 0.40745)
CORNERS = "715,624,1250,614,1258,922,702,930"


def white(xy, luminance=1.0):
    return luminance * np.array([xy[0], xy[1], 1 - xy[0] - xy[1]]) / xy[1]


def curve(t):
    return np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)


def lab(xyz, about):
    x, y, z = curve(xyz / about).T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def xyz_of_lab(values, about):
    """The inverse, for colors whose f is on the cube root."""
    y = (values[:, 0] + 16) / 116
    return about * np.stack([y + values[:, 1] / 500, y, y - values[:, 2] / 200], axis=-1) ** 3


def luv(xyz, about):
    def prime(v):
        x, y, z = v.T
        return np.stack([4 * x, 9 * y], axis=-1) / (x + 15 * y + 3 * z)[..., None]

    lightness = 116 * curve(xyz[:, 1] / about[1]) - 16
    chroma = 13 * lightness[:, None] * (prime(xyz) - prime(about[None]))
    return np.column_stack([lightness, chroma])


CONES = {
    "bradford": [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]],
    "cat16": [[0.401288, 0.650173, -0.051461], [-0.250268, 1.204414, 0.045854], [-0.002079, 0.048952, 0.953127]],
    "von-kries": [[0.40024, 0.70760, -0.08081], [-0.22630, 1.16532, 0.04570], [0, 0, 0.91822]],
}


def adaptation(name, before, after):
    cones = np.array(CONES[name])
    return np.linalg.inv(cones) @ np.diag((cones @ white(after)) / (cones @ white(before))) @ cones


def reference(name):
    """L*a*b* of a chart of sample_data."""
    lines = sample_data(f"charts/{name}.csv").read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in lines if not line.startswith("#")][1:]
    return [row[0] for row in rows], np.array([[float(cell) for cell in row[1:]] for row in rows])


class Spaces(ProgramCase):
    def setUp(self):
        super().setUp()
        chance = np.random.default_rng(11)
        self.xyz = (chance.uniform(1, 100, (40, 3)) * [0.95, 1, 1.09]).astype(np.float32).astype(np.float64)
        self.colors(self.xyz)

    def colors(self, xyz):
        planes = {name: xyz[None, :, i].astype(np.float32) for i, name in enumerate("RGB")}
        write_planes(self.path("xyz.exr"), planes)
        (self.directory / "xyz.yaml").write_text(XYZ_YAML)

    def converted(self, channels, *options):
        words = ["to-xyz", "xyz.exr", "--metadata", "xyz.yaml", *options, "-o", "out.exr"]
        self.run_program(words)
        planes = read_planes(self.path("out.exr"))
        return np.stack([planes[name][0] for name in channels], axis=-1).astype(np.float64)

    def test_lab_luv_and_srgb_are_their_formulas(self):
        about = white(D65, 80)
        options = ["--white-luminance", 80]
        # Samples have seven digits.
        np.testing.assert_allclose(
            self.converted("Lab", "--space", "lab", *options), lab(self.xyz, about), rtol=1e-6, atol=1e-5
        )
        np.testing.assert_allclose(
            self.converted("Luv", "--space", "luv", *options), luv(self.xyz, about), rtol=1e-6, atol=1e-5
        )
        primaries = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])
        columns = np.array([white(xy) for xy in primaries]).T
        xyz_from_srgb = columns * np.linalg.solve(columns, white(D65))
        linear = np.linalg.solve(xyz_from_srgb, self.xyz.T / 80).T
        # The four decimals of the matrix of IEC 61966-2-1.
        found = self.converted("RGB", "--space", "linear-srgb", *options)
        np.testing.assert_allclose(found, linear, atol=4e-4)
        self.assertLess(found.min(), -0.05)

    def test_adaptation_is_its_matrix(self):
        for name in CONES:
            options = ["--adapt-to", "a", "--scene-white", "0.3127,0.3290", "--adaptation", name]
            found = self.converted("RGB", *options)
            np.testing.assert_allclose(found, self.xyz @ adaptation(name, D65, A).T, rtol=1e-6, atol=1e-5)

    def test_temperatures_are_those_published(self):
        # ANSI C78.377: nominal temperature, x, y and Duv of white light sources. Half a digit of x and y is up to 6 K.
        table = np.array(
            [
                [2725, 0.4578, 0.4101, 0.000],
                [3045, 0.4338, 0.4030, 0.000],
                [3465, 0.4073, 0.3917, 0.000],
                [3985, 0.3818, 0.3797, 0.001],
                [4503, 0.3611, 0.3658, 0.001],
                [5028, 0.3447, 0.3553, 0.002],
                [5665, 0.3287, 0.3417, 0.002],
                [6530, 0.3123, 0.3282, 0.003],
            ]
        )
        self.colors(np.array([white(xy, 50) for xy in table[:, 1:3]]))
        found = self.converted(["CCT", "Duv", "Y"], "--space", "cct")
        np.testing.assert_allclose(found[:, 0], table[:, 0], atol=6)
        np.testing.assert_allclose(found[:, 1], table[:, 3], atol=6e-4)
        np.testing.assert_allclose(found[:, 2], 50, rtol=1e-6)
        # The example of the documentation of colour-science: u, v of 0.1978, 0.3122 by Ohno's method of 2013.
        u, v = 0.1978, 0.3122
        self.colors(np.array([white(np.array([3 * u, 2 * v]) / (2 * u - 8 * v + 4), 50)]))
        ((kelvin, duv, _),) = self.converted(["CCT", "Duv", "Y"], "--space", "cct")
        self.assertAlmostEqual(kelvin, 6507.47, delta=1.0)
        self.assertAlmostEqual(duv, 0.003223, delta=2e-6)


class Uncertainty(ProgramCase):
    """By way of XYZ and their covariances the same colors and deviations come out as at once."""

    def test_it_comes_along_with_xyz(self):
        self.run_program(["fit-matrix", sample_data("skies/sky912.exr"), "-o", "m.yaml"])
        chain = [
            ["render-radiance", sample_data("skies/rural25_horizon.csv"), "--size", "40x30", "--expose-to", 0.5],
            ["add-noise", "--seed", 3],
            ["digitize"],
            ["mosaic"],
            ["demosaic", "-o", "rgb.exr"],
        ]
        self.run_pipe(*chain)
        self.run_program(["to-xyz", "rgb.exr", "--matrix", "m.yaml", "--sigma", "-o", "xyz.exr"])
        for space in ("xyy", "lab", "luv", "cct", "linear-srgb"):
            at_once = self.frame(["to-xyz", "rgb.exr", "--matrix", "m.yaml", "--sigma", "--space", space])
            by_way = self.frame(["to-xyz", "xyz.exr", "--space", space])
            self.assertEqual(sorted(at_once), sorted(by_way))
            for name, samples in at_once.items():
                self.assertTrue(np.isfinite(samples).all(), name)
                # XYZ and covariances are stored with seven digits; temperatures change fastest with them.
                off = np.abs(samples - by_way[name]).max() / np.abs(samples).max()
                self.assertLess(off, 2e-4 if name == "sigma.CCT" else 2e-5, f"{space} {name}")
        # Bluer than any black body: no temperature, and no deviation of one; luminance has both.
        self.run_pipe(*[[words if words != sample_data("skies/rural25_horizon.csv") else sample_data("skies/clear_zenith.csv")
                         for words in command] for command in chain])
        self.run_program(["to-xyz", "rgb.exr", "--matrix", "m.yaml", "--sigma", "-o", "xyz.exr"])
        deviation = self.frame(["to-xyz", "rgb.exr", "--matrix", "m.yaml", "--sigma"])["sigma.G"]
        for source in (["rgb.exr", "--matrix", "m.yaml", "--sigma"], ["xyz.exr"]):
            found = self.frame(["to-xyz", *source, "--space", "cct"])
            without = np.isnan(found["CCT"])
            self.assertGreater(without.mean(), 0.5)
            self.assertTrue((np.isnan(found["sigma.CCT"]) == without).all() and (np.isnan(found["sigma.Duv"]) == without).all())
            np.testing.assert_allclose(found["sigma.Y"], deviation, rtol=1e-5)
        refused = self.attempt(["to-xyz", "xyz.exr", "--space", "srgb", "--sigma"])
        self.assertEqual(refused.returncode, 2)


class Fits(ProgramCase):
    def setUp(self):
        super().setUp()
        self.names, values = reference("colorchecker")
        self.white = white(D50)
        self.xyz = xyz_of_lab(values, self.white)
        self.matrix = np.array([[0.9, 0.4, 0.25], [0.35, 1.0, -0.1], [0.02, -0.2, 1.6]])
        chance = np.random.default_rng(5)
        self.signals = np.linalg.solve(self.matrix, self.xyz.T).T
        self.covariances = []
        for signal in self.signals:
            mixed = np.eye(3) + chance.uniform(-0.3, 0.3, (3, 3))
            self.covariances.append(mixed @ np.diag(np.abs(signal) * 2e-5 + 1e-7) @ mixed.T)
        noise = [chance.multivariate_normal(np.zeros(3), covariance) for covariance in self.covariances]
        self.signals = self.signals + noise
        self.write()

    def write(self):
        head = "name,R,G,B,std_R,std_G,std_B,cov_RG,cov_RB,cov_GB"
        rows = [head]
        for name, signal, s in zip(self.names, self.signals, self.covariances):
            numbers = [*signal, *np.sqrt(np.diag(s)), s[0, 1], s[0, 2], s[1, 2]]
            rows.append(",".join([name.replace(" ", "_").upper(), *[repr(float(number)) for number in numbers]]))
        (self.directory / "patches.csv").write_text("\n".join(reversed(rows[1:])).join([head + "\n", "\n"]))

    def found(self, *options):
        words = ["fit-matrix", "--patches", "patches.csv", *options, "--output-format", "json", "-o", "m.yaml"]
        return json.loads(self.run_program(words))

    def cost(self, elements, variance):
        matrix = elements.reshape(3, 3)
        total = 0.0
        for signal, covariance, xyz in zip(self.signals, self.covariances, self.xyz):
            residual = xyz - matrix @ signal
            total += residual @ np.linalg.solve(matrix @ covariance @ matrix.T + variance * np.eye(3), residual)
        return total

    def least(self, variance):
        """Minimum and where it is, by a method that knows nothing of the true signals."""
        start = self.matrix.ravel()
        options = {"xatol": 1e-12, "fatol": 1e-12, "maxiter": 100000, "maxfev": 100000}
        first = minimize(self.cost, start, args=(variance,), method="BFGS")
        return minimize(self.cost, first.x, args=(variance,), method="Nelder-Mead", options=options)

    def test_the_minimum_is_that_of_scipy(self):
        report = self.found("--no-misfit")
        best = self.least(0.0)
        # A minimum is flat: 10⁻¹² of the cost is 10⁻⁶ of a standard error.
        errors = np.array(report["uncertainty"]["standard_error"])
        off = (np.array(report["matrix"]) - best.x.reshape(3, 3)) / errors
        self.assertLess(np.abs(off).max(), 1e-4)
        self.assertAlmostEqual(report["chart"]["chi_squared_per_degree"] * 63, best.fun, delta=1e-8 * best.fun)
        self.assertEqual(report["chart"]["misfit"], 0.0)
        # The covariance beside that of curvature: half the Hessian of the cost, which counts residuals too: some per cent.
        step = errors.ravel() * 1e-2
        hessian = np.empty((9, 9))
        for i in range(9):
            for j in range(9):
                total = 0.0
                for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                    shift = np.zeros(9)
                    shift[i] += a * step[i]
                    shift[j] += b * step[j]
                    total += a * b * self.cost(best.x + shift, 0.0)
                hessian[i, j] = total / (4 * step[i] * step[j])
        of_curvature = np.linalg.inv(hessian / 2)
        element = np.array(report["uncertainty"]["element_covariance"])
        np.testing.assert_allclose(np.diag(element), np.diag(of_curvature), rtol=0.15)

    def test_the_misfit_makes_the_residuals_what_is_expected(self):
        chance = np.random.default_rng(6)
        shifted = self.xyz + chance.normal(0, 0.01, self.xyz.shape)
        rows = ["name,X,Y,Z", *(",".join([n, *map(repr, map(float, v))]) for n, v in zip(self.names, shifted))]
        (self.directory / "reference.csv").write_text("\n".join(rows) + "\n")
        self.xyz = shifted
        report = self.found("--reference", "reference.csv")
        variance = np.exp(brentq(lambda log: self.least(np.exp(log)).fun - 63, np.log(1e-5), np.log(1e-3), xtol=1e-4))
        self.assertAlmostEqual(report["chart"]["misfit"] / np.sqrt(variance), 1.0, delta=1e-3)
        best = self.least(report["chart"]["misfit"] ** 2)
        errors = np.array(report["uncertainty"]["standard_error"])
        off = (np.array(report["matrix"]) - best.x.reshape(3, 3)) / errors
        self.assertLess(np.abs(off).max(), 1e-4)

    def test_reflectances_are_seen_in_the_light(self):
        wavelength = np.arange(380, 781, 5.0)
        chance = np.random.default_rng(8)
        waves = [0.5 + 0.4 * np.sin(wavelength / chance.uniform(20, 80) + chance.uniform(0, 6)) for _ in range(24)]
        rows = [",".join(["wavelength_nm", *[f"p{i}" for i in range(24)]])]
        rows += [",".join(map(repr, map(float, [nm, *(wave[k] for wave in waves)]))) for k, nm in enumerate(wavelength)]
        (self.directory / "reflectances.csv").write_text("\n".join(rows) + "\n")
        grid = np.arange(360, 831.0)
        observer = read_table(sample_data("observers/cie1931_2deg_1nm.csv"))
        matching = np.stack([observer[name] for name in ("xbar", "ybar", "zbar")], axis=-1)
        light = grid**-5.0 / np.expm1(1.435e7 / (2848 * grid))
        seen = np.stack([np.interp(grid, wavelength, wave, left=0, right=0) for wave in waves])
        xyz = (seen * light) @ matching / (light @ matching[:, 1])
        signals = np.linalg.solve(self.matrix, xyz.T).T
        rows = ["name,R,G,B", *(",".join([f"p{i}", *map(repr, map(float, s))]) for i, s in enumerate(signals))]
        (self.directory / "patches.csv").write_text("\n".join(rows) + "\n")
        report = self.found("--reference", "reflectances.csv", "--illuminant", "a")
        np.testing.assert_allclose(report["matrix"], self.matrix, atol=1e-8)
        np.testing.assert_allclose(report["white_xy"], A, atol=2e-5)


class RealChart(ProgramCase):
    """The ColorChecker Passport of a Canon Kiss X4."""

    def setUp(self):
        super().setUp()
        self.raw = beside("data/raw/colorchart_kissx4_ml_uncompressed14.dng")

    def test_the_matrix_makes_the_chart_what_it_is(self):
        words = ["fit-matrix", "--chart", self.raw, "--corners", CORNERS, "-o", "m.yaml", "--output-format", "json"]
        report = json.loads(self.run_program(words))
        self.assertEqual(len(report["patches"]), 24)
        self.assertLess(report["evaluation"]["delta_e_2000"]["mean"], 3.1)
        self.assertLess(report["evaluation"]["delta_e_2000"]["max"], 8.5)
        self.run_program(["demosaic", self.raw, "-o", "rgb.exr"])
        self.run_program(["to-xyz", "rgb.exr", "--matrix", "m.yaml", "-o", "xyz.exr"])
        planes = read_planes(self.path("xyz.exr"))
        names, values = reference("colorchecker")
        # Means of XYZ: L*a*b* of noisy pixels are not noisy L*a*b*, being curved.
        for name, (x, y) in {"white": (702, 930), "neutral 8": (813, 929), "yellow": (1034, 821)}.items():
            mean = np.array([planes[c][y - 15 : y + 15, x - 15 : x + 15].mean() for c in "RGB"])
            off = lab(mean[None], white(D50))[0] - values[names.index(name)]
            self.assertLess(np.linalg.norm(off), 3.0, name)

    def test_colors_stay_in_a_dng(self):
        self.run_program(["import-raw", self.raw, "-o", "copy.dng"])
        with rawpy.imread(str(self.raw)) as before, rawpy.imread(self.path("copy.dng")) as after:
            balances = [np.array(raw.camera_whitebalance[:3]) for raw in (before, after)]
        balances = [balance / balance[1] for balance in balances]
        np.testing.assert_allclose(balances[1], balances[0], rtol=1e-4)
        with tifffile.TiffFile(str(self.raw)) as before, tifffile.TiffFile(self.path("copy.dng")) as after:
            matrices = [np.array(file.pages[0].tags[50721].value, dtype=float) for file in (before, after)]
            self.assertEqual(after.pages[0].tags[50778].value, 0)
        matrices = [(numbers[0::2] / numbers[1::2]) for numbers in matrices]
        # One matrix of any scale leads to the same colors.
        scaled = [matrix / np.abs(matrix).max() for matrix in matrices]
        np.testing.assert_allclose(scaled[1], scaled[0], atol=1e-6)


if __name__ == "__main__":
    unittest.main()
