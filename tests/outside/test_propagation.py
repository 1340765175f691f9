"""predict-noise beside independent computations: site variances from closed formulas, weights by impulses through the
demosaicking in numpy, covariances by sums over sites, and the scatter of simulated frames."""

import json
import math
import unittest

import numpy as np

from programs import CLASSES, ProgramCase, class_masks, sample_data
from test_demosaic import METHODS

SLOPE, BIAS, READ_E, PRNU, DCNU = 0.058824, 1753.0, 15.7, 0.008, 0.2
BOLTZMANN_EV = 8.617333262e-5
ELEMENTARY_CHARGE = 1.602176634e-19
PIXEL_CM2 = 6.8e-4**2


def dark_electrons(temperature_k, exposure_s):
    """Q_DC of Eqs. 6 and 7 with Varshni's band gap."""
    gap = 1.1557 - 7.021e-4 * temperature_k**2 / (1108 + temperature_k)
    current = 2.5e15 * PIXEL_CM2 * 0.068558 * temperature_k**1.5 * math.exp(-gap / (2 * BOLTZMANN_EV * temperature_k))
    return current * exposure_s


def electron_variance(signal, dark, without=()):
    """Var(PN) = λ + λ²s² + λs² for light and dark, and read noise."""
    shot = 0 if "ssn" in without else signal
    dark_shot = 0 if "dcsn" in without else dark
    prnu = 0 if "prnu" in without else PRNU
    dcnu = 0 if "dcnu" in without else DCNU
    read = 0 if "ron" in without else READ_E
    light = shot + (signal * prnu) ** 2 + shot * prnu**2
    return light + dark_shot + (dark * dcnu) ** 2 + dark_shot * dcnu**2 + read**2


def weights(method, pattern, means):
    """For each phase, the derivatives of R, G and B by the samples of a 16×16 array about a uniform scene, and the
    classes of the samples. Central differences of relative step 10⁻⁴ are exact for the linear methods and off by 10⁻⁸ of
    themselves for the ratios of SHTI."""
    size, middle = 16, 8
    masks = class_masks(pattern, size, size)
    level = sum(masks[name] * mean for name, mean in zip("RGB", means))
    classes = sum(masks[name] * index for index, name in enumerate("RGB"))
    derivatives = {phase: np.zeros((3, size, size)) for phase in np.ndindex(2, 2)}
    for y in range(middle - 3, middle + 5):
        for x in range(middle - 3, middle + 5):
            step = 1e-4 * level[y, x]
            made = []
            for sign in (1, -1):
                raised = level.copy()
                raised[y, x] += sign * step
                made.append(METHODS[method](raised, masks))
            for phase in derivatives:
                at = middle + phase[0], middle + phase[1]
                for channel, name in enumerate("RGB"):
                    derivatives[phase][channel, y, x] = (made[0][name][at] - made[1][name][at]) / (2 * step)
    return derivatives, classes


def covariance_of(derivatives, classes, variances):
    spread = np.asarray(variances)[classes]
    return {phase: np.einsum("iyx,jyx,yx->ij", w, w, spread) for phase, w in derivatives.items()}


def patch_mean_weights(derivatives, corner, width, height):
    """The weights of the mean of a patch whose corner (row, column) has that phase, on an array that holds all of it."""
    total = np.zeros((3, height + 16, width + 16))
    for y in range(height):
        for x in range(width):
            phase = (corner[0] + y) % 2, (corner[1] + x) % 2
            # The derivatives of a phase are about its pixel at (8, 8) plus the phase.
            kernel = derivatives[phase][:, 8 + phase[0] - 3 : 8 + phase[0] + 4, 8 + phase[1] - 3 : 8 + phase[1] + 4]
            total[:, y : y + 7, x : x + 7] += kernel
    return total / (width * height)


class Prediction(ProgramCase):
    def setUp(self):
        super().setUp()
        self.chance = np.random.default_rng(58)

    def predict(self, electrons, *options):
        text = ",".join(repr(float(value)) for value in electrons)
        done = self.run_program(["predict-noise", "--electrons", text, "--output-format", "json", *options])
        return {stage["stage"]: stage for stage in json.loads(done)["stages"]}, json.loads(done)

    def close(self, actual, expected, relative, what):
        actual, expected = np.asarray(actual, float), np.asarray(expected, float)
        scale = np.sqrt(np.abs(np.outer(np.diag(expected), np.diag(expected)))) if expected.ndim == 2 else expected
        worst = np.max(np.abs(actual - expected) / np.abs(scale))
        self.assertLess(worst, relative, f"{what}: {actual} for {expected}")

    def test_covariances_of_all_methods(self):
        for trial in range(20):
            electrons = np.exp(self.chance.uniform(math.log(400), math.log(33_000), 3))
            temperature, exposure = self.chance.uniform(280, 340), self.chance.uniform(0.005, 0.05)
            without = [(), ("prnu",), ("dcnu",), ("ssn", "dcsn")][trial % 4]
            method, pattern = list(METHODS)[trial % 4], list(CLASSES)[trial // 4 % 4]
            dark = dark_electrons(temperature, exposure)
            options = ["--method", method, "--pattern", pattern, "--temperature", temperature, "--exposure", exposure]
            if without:
                options += ["--without", ",".join(without)]
            stages, _ = self.predict(electrons, *options)
            site = [electron_variance(signal, dark, without) for signal in electrons]
            what = f"{method} {pattern} {electrons} without {without}"
            self.close(stages["electrons"]["covariance"], np.diag(site), 1e-6, what)
            self.close(stages["electrons"]["mean"], electrons + dark, 1e-6, what)
            # σ is above 1.2 ADU: rounding adds 1/12 to 10⁻¹².
            codes = np.array([SLOPE**2 * variance + 1 / 12 for variance in site])
            self.close(stages["adu"]["covariance"], np.diag(codes), 1e-6, what)
            derivatives, classes = weights(method, pattern, electrons)
            by_phase = covariance_of(derivatives, classes, codes)
            self.close(stages["demosaicked"]["covariance"], sum(by_phase.values()) / 4, 1e-6, what)
            for entry in stages["demosaicked"]["phases"]:
                self.close(entry["covariance"], by_phase[entry["row"], entry["column"]], 1e-6, what)
            causes = np.sum([cause["variance"] for cause in stages["demosaicked"]["causes"]], axis=0)
            self.close(causes, np.diag(stages["demosaicked"]["covariance"]), 1e-9, what)

    def test_patch_means(self):
        electrons, dark = (7000.0, 12_000.0, 19_000.0), dark_electrons(333, 0.033)
        codes = [SLOPE**2 * electron_variance(signal, dark) + 1 / 12 for signal in electrons]
        for method in METHODS:
            derivatives, _ = weights(method, "grbg", electrons)
            for width, height in [(1, 1), (2, 2), (7, 5), (16, 16)]:
                found = []
                for row, column in np.ndindex(2, 2):
                    total = patch_mean_weights(derivatives, (row, column), width, height)
                    rows, columns = np.mgrid[0 : total.shape[1], 0 : total.shape[2]]
                    names = np.array(list(class_masks("grbg", 2, 2)))
                    masks = class_masks("grbg", 2, 2)
                    tile = sum(masks[name].astype(int) * "RGB".index(name) for name in names)
                    # Site (0, 0) of the weights lies three rows and columns before the corner.
                    classes = tile[(rows + row - 3) % 2, (columns + column - 3) % 2]
                    variance = np.sum(total**2 * np.asarray(codes)[classes], axis=(1, 2))
                    stages, _ = self.predict(
                        electrons, "--method", method, "--pattern", "grbg", "--patch", f"{width}x{height}",
                        "--patch-at", f"{column + 20},{row + 20}",
                    )
                    self.close(stages["demosaicked"]["patch_mean_std"], np.sqrt(variance), 1e-6, f"{method} {width}")
                    found.append(variance)
                stages, _ = self.predict(electrons, "--method", method, "--pattern", "grbg", "--patch", f"{width}x{height}")
                self.close(stages["demosaicked"]["patch_mean_std"], np.sqrt(np.mean(found, axis=0)), 1e-6, method)

    ROWS = {"row_noise_e": 9.0, "column_noise_e": 4.0, "dsnu_e": 6.0, "dsnu_row_e": 2.0, "dsnu_column_e": 11.0,
            "prnu_row": 0.003, "prnu_column": 0.005}

    def rows_and_columns(self):
        """A sensor that is read by row and column, otherwise the default one."""
        numbers = {
            "width": 400, "height": 300, "pixel_pitch_um": 6.8, "cfa": "grbg", "full_well_e": 40000,
            "dark_current_na_per_cm2": 0.068558, "temperature_k": 333, "dcnu": DCNU, "prnu": PRNU, "read_noise_e": READ_E,
            "bits": 16, "bias_adu": BIAS, "adu_per_e": SLOPE, **self.ROWS,
        }
        lines = "".join(f"  {key}: {value}\n" for key, value in numbers.items())
        path = self.directory / "rows.yaml"
        path.write_text(f"schema: cyanometer-sensor/2\nname: rows\nreadout:\n{lines}", encoding="utf-8")
        return path

    def test_patch_means_of_rows_and_columns(self):
        """Every pair of sites that share a row or a column, one by one."""
        sensor, rows = self.rows_and_columns(), self.ROWS
        electrons, dark = np.array([7000.0, 12_000.0, 19_000.0]), dark_electrons(333, 0.033)
        temporal_and_fixed = {
            "row": rows["row_noise_e"] ** 2 + rows["dsnu_row_e"] ** 2,
            "column": rows["column_noise_e"] ** 2 + rows["dsnu_column_e"] ** 2,
        }
        shared = {
            axis: SLOPE**2 * (added + np.outer(electrons, electrons) * rows[f"prnu_{axis}"] ** 2)
            for axis, added in temporal_and_fixed.items()
        }
        gains = PRNU**2 + rows["prnu_row"] ** 2 + rows["prnu_column"] ** 2
        added = READ_E**2 + rows["dsnu_e"] ** 2 + sum(temporal_and_fixed.values())
        codes = np.array([
            SLOPE**2 * (signal + (signal**2 + signal) * gains + dark + (dark**2 + dark) * DCNU**2 + added) + 1 / 12
            for signal in electrons
        ])
        own = codes - np.diag(shared["row"]) - np.diag(shared["column"])
        for method in METHODS:
            derivatives, _ = weights(method, "grbg", electrons)
            for (width, height), (row, column) in [((1, 1), (0, 0)), ((2, 3), (1, 0)), ((9, 5), (0, 1)), ((14, 16), (1, 1))]:
                total = patch_mean_weights(derivatives, (row, column), width, height)
                ys, xs = (axis.ravel() for axis in np.mgrid[0 : total.shape[1], 0 : total.shape[2]])
                masks = class_masks("grbg", 2, 2)
                tile = sum(masks[name].astype(int) * index for index, name in enumerate("RGB"))
                classes = tile[(ys + row - 3) % 2, (xs + column - 3) % 2]
                covariance = np.diag(own[classes])
                for axis, places in [("row", ys), ("column", xs)]:
                    is_same = places[:, None] == places[None, :]
                    covariance += is_same * shared[axis][classes[:, None], classes[None, :]]
                total = total.reshape(3, -1)
                expected = total @ covariance @ total.T
                stages, _ = self.predict(
                    electrons, "--sensor", sensor, "--method", method, "--patch", f"{width}x{height}",
                    "--patch-at", f"{column + 20},{row + 20}",
                )
                stage = stages["demosaicked"]
                self.close(stage["patch_mean_covariance"], expected, 1e-6, f"{method} {width}x{height}")
                self.close(stages["adu"]["std"], np.sqrt(codes), 1e-6, "codes")
                causes = np.sum([cause["variance"] for cause in stage["causes"]], axis=0)
                self.close(causes, np.diag(stage["covariance"]), 1e-9, "causes")
                names = {cause["cause"] for cause in stage["causes"]}
                self.assertLessEqual({"row_noise", "column_noise", "dsnu", "dsnu_row", "prnu_column"}, names)

    def test_simulated_patches_of_rows_and_columns(self):
        """Means of 16×16 pixels, one of each of 300 frames of 300 sensors."""
        sensor, electrons = self.rows_and_columns(), (7000.0, 12_000.0, 19_000.0)
        means = []
        for seed in range(300):
            render = ["render-radiance", "--sensor", sensor, "--electrons", "7000,12000,19000", "--size", "24x24", "-q"]
            noisy = ["add-noise", "--seed", seed, "--sensor-seed", seed, "-q"]
            rest = (["digitize", "-q"], ["demosaic", "--method", "eci", "-q"])
            frame = self.planes(self.run_pipe(render, ["mosaic", "-q"], noisy, *rest))
            means.append([frame[name][4:20, 4:20].astype(np.float64).mean() for name in "RGB"])
        stages, _ = self.predict(electrons, "--sensor", sensor, "--patch", "16x16", "--patch-at", "4,4")
        ratio = np.std(means, axis=0, ddof=1) / stages["demosaicked"]["patch_mean_std"]
        # 1/√(2·299) = 0.041.
        self.assertLess(np.max(np.abs(ratio - 1)), 4.5 * 0.041, ratio)

    def matrix(self):
        self.run_program(["fit-matrix", sample_data("skies/sky912.exr"), "-o", "matrix.yaml", "-q"])
        fitted = self.run_program(["fit-matrix", sample_data("skies/sky912.exr"), "--output-format", "json", "-q"])
        return np.asarray(json.loads(fitted)["matrix"])

    def test_colors(self):
        matrix = self.matrix()
        white = np.array([950.0, 1000.0, 1089.0])
        options = ["--matrix", "matrix.yaml", "--white", ",".join(map(str, white))]
        stages, whole = self.predict((7000, 12_000, 19_000), *options)
        camera = np.asarray(stages["demosaicked"]["covariance"])
        per_adu = matrix / (0.033 * math.pi / (4 * 8**2 + 1))
        xyz = per_adu @ camera @ per_adu.T
        self.close(stages["xyz"]["covariance"], xyz, 1e-9, "XYZ")
        mean = per_adu @ (SLOPE * np.array([7000, 12_000, 19_000]))
        self.close(stages["xyz"]["mean"], mean, 1e-7, "XYZ")

        def lab(color):
            ratio = color / white
            f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
            return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])

        # Central differences: relative error (h/x)²/6 · 10/9 with h = 10⁻⁴ x.
        steps = 1e-4 * mean
        jacobian = np.stack(
            [(lab(mean + d) - lab(mean - d)) / (2 * d.sum()) for d in np.diag(steps)], axis=1
        )
        first_order = jacobian @ xyz @ jacobian.T
        is_curved = lambda cause: cause["cause"] in ("curvature", "curved_pattern")
        curvature = np.sum([cause["variance"] for cause in stages["lab"]["causes"] if is_curved(cause)], axis=0)
        without = np.diag(stages["lab"]["covariance"]) - curvature
        self.close(without, np.diag(first_order), 1e-6, "Lab to first order")
        # The second order: a cube root adds 4/3 of the square of noise over signal to its variance, less what skewness takes.
        share = np.max(np.diag(xyz) / mean**2)
        self.close(stages["lab"]["covariance"], first_order, 2 * share, "Lab")
        # The mean of noisy colors and their differences, by drawing a million, as many on each phase of the array: errors
        # of 10⁻³ of a deviation.
        of_phases = [np.asarray(phase["covariance"]) for phase in stages["demosaicked"]["phases"]]
        self.close(np.mean(of_phases, axis=0), camera, 1e-9, "phases")
        draws = np.concatenate(
            [self.chance.multivariate_normal(mean, per_adu @ phase @ per_adu.T, 250_000) for phase in of_phases]
        )
        ratio = np.cbrt(draws / white)
        colors = np.stack(
            [116 * ratio[:, 1] - 16, 500 * (ratio[:, 0] - ratio[:, 1]), 200 * (ratio[:, 1] - ratio[:, 2])], axis=1
        )
        deviation = np.asarray(stages["lab"]["std"])
        self.assertLess(np.max(np.abs(colors.mean(axis=0) - stages["lab"]["mean"]) / deviation), 5e-3)
        distance = np.linalg.norm(colors - lab(mean), axis=1)
        self.assertLess(abs(distance.mean() / whole["noise_delta_e"]["mean"] - 1), 5e-3)
        self.assertLess(abs(distance.std() / whole["noise_delta_e"]["std"] - 1), 1e-2)

    def test_pixels_needed(self):
        stages, _ = self.predict((7000, 12_000, 19_000), "--uncertainty", "0.5%")
        needed = stages["demosaicked"]["pixels_needed"]
        for channel, pixels in enumerate(needed):
            side = math.isqrt(pixels)
            self.assertEqual(side * side, pixels)
            for length, is_enough in [(side, True), (side - 1, False)]:
                if length:
                    patch, _ = self.predict((7000, 12_000, 19_000), "--patch", f"{length}x{length}")
                    stage = patch["demosaicked"]
                    ratio = stage["patch_mean_std"][channel] / stage["mean"][channel]
                    self.assertEqual(ratio <= 0.005, is_enough, f"{channel}: {length} {ratio}")

    def blocks(self, planes, names, size):
        """Means and covariances of blocks of a frame: their scatter gives the error of the whole without any theory."""
        stack = np.stack([planes[name].astype(np.float64) for name in names])
        channels, height, width = stack.shape
        cut = stack.reshape(channels, height // size, size, width // size, size).transpose(1, 3, 0, 2, 4)
        cut = cut.reshape(-1, channels, size * size)
        means = cut.mean(axis=2)
        centered = cut - stack.mean(axis=(1, 2))[None, :, None]
        return means, np.einsum("nix,njx->nij", centered, centered) / size**2

    def test_simulated_frames_scatter_as_predicted(self):
        self.matrix()
        electrons = "8000,12000,20000"
        render = ["render-radiance", "--electrons", electrons, "--size", "1000x1000", "-q"]
        codes = self.run_pipe(render, ["add-noise", "--seed", 11, "--sensor-seed", 12, "-q"], ["digitize", "-q"])
        cfa = self.run_pipe(["mosaic", "-q"], stdin=codes)
        for method in METHODS:
            camera = self.run_pipe(["demosaic", "--method", method, "-q"], stdin=cfa)
            options = ["--method", method, "--matrix", "matrix.yaml"]
            stages, _ = self.predict((8000, 12_000, 20_000), *options)
            colors = [["to-xyz", "--matrix", "matrix.yaml", "--space", space, "-q"] for space in ("xyz", "lab")]
            frames = {"adu": codes, "demosaicked": camera}
            frames["xyz"], frames["lab"] = (self.run_pipe(color, stdin=camera) for color in colors)
            for stage, data in frames.items():
                names = "Lab" if stage == "lab" else "RGB"
                means, covariances = self.blocks(self.planes(data), names, 100)
                n = len(means)
                expected = np.asarray(stages[stage]["covariance"])
                t = (means.mean(axis=0) - stages[stage]["mean"]) / (means.std(axis=0, ddof=1) / math.sqrt(n))
                # 100 blocks: |t| of 99 degrees of freedom exceeds 5.2 with a chance of 10⁻⁶.
                self.assertLess(np.max(np.abs(t)), 5.2, f"{method} {stage}: means {t}")
                error = covariances.std(axis=0, ddof=1) / math.sqrt(n)
                t = (covariances.mean(axis=0) - expected) / error
                self.assertLess(np.max(np.abs(t)), 5.2, f"{method} {stage}: covariances {t}")

    def test_checks_of_whole_chains(self):
        render = ["render-radiance", "--electrons", "8000,12000,20000", "--size", "600x400", "-q"]
        rest = (["add-noise", "-q"], ["digitize", "-q"], ["mosaic", "-q"], ["demosaic", "-q"])
        frame = self.run_pipe(render, *rest)
        self.assertEqual(self.attempt(["measure", "--check"], stdin=frame).returncode, 0)
        paper = self.attempt(["measure", "--check", "--equations", "paper"], stdin=frame)
        self.assertEqual(paper.returncode, 1)
        self.assertEqual(paper.stderr.count(b"\n"), 1, paper.stderr)
        vignetted = self.attempt(["measure", "--check"], stdin=self.run_pipe([*render, "--vignetting"], *rest))
        self.assertEqual(vignetted.returncode, 1)
        self.assertIn(b"nothing can be checked", vignetted.stderr)

    def test_sweeps_and_plots(self):
        done = self.run_program(
            ["predict-noise", "--sweep", "10:40000:50log", "--plot", "curve.svg", "--patch", "2x2"]
        ).decode()
        lines = [line.split(",") for line in done.splitlines()]
        self.assertEqual(len(lines), 51)
        self.assertEqual((float(lines[1][0]), float(lines[50][0])), (10.0, 40_000.0))
        stages, _ = self.predict([float(value) for value in lines[30][:3]])
        column = lines[0].index("demosaicked_G_std")
        self.assertAlmostEqual(float(lines[30][column]) / stages["demosaicked"]["std"][1], 1, delta=1e-12)
        self.assertIn(b"<svg", (self.directory / "curve.svg").read_bytes())
        self.run_program(["predict-noise", "--dark", "--plot", "curve.png"])
        self.assertTrue((self.directory / "curve.png").read_bytes().startswith(b"\x89PNG"))

    def test_green_lost_in_noise_is_flagged(self):
        for green, holds in [(50, False), (5, False), (1900, True)]:
            done = self.attempt(
                ["predict-noise", "--electrons", f"{green},{green},{20 * green}", "--method", "shti", "--output-format", "json"]
            )
            self.assertEqual(done.returncode, 0)
            self.assertEqual(b"cannot be propagated" in done.stderr, not holds, done.stderr)
            found = json.loads(done.stdout)
            self.assertEqual(found["first_order"]["holds"], holds)
            self.assertNotIn(b"null", json.dumps([stage["covariance"] for stage in found["stages"]]).encode())
            codes = self.run_pipe(
                ["render-radiance", "--electrons", f"{green},{green},{20 * green}", "--size", "300x200", "-q"],
                ["add-noise", "-q"], ["digitize", "-q"], ["mosaic", "-q"],
            )
            for plane in self.frame(["demosaic", "--method", "shti", "--sigma", "-q"], stdin=codes).values():
                self.assertTrue(np.all(np.isfinite(plane)))


if __name__ == "__main__":
    unittest.main()
