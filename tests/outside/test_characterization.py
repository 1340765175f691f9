"""fit-matrix beside independent computations: constrained least squares in exact rational numbers, the jackknife by
leaving samples out, color differences and noise in numpy, and the chart that render-radiance draws."""

import csv
import io
import json
import math
import unittest
from fractions import Fraction

import numpy as np

from programs import ProgramCase, read_table, sample_data
from test_color import library_meta, library_radiance, tristimulus
from test_radiance import Sensor

ADU_PER_E, FULL_WELL_E = 0.058824, 40000.0
# s sr of an exposure of 1 s at f/8.
PER_SECOND = math.pi / (4 * 8.0**2 + 1)
WHITE = np.array([950.0, 1000.0, 1089.0])
WHITE_OPTION = ["--white", "950,1000,1089"]
CLASSES = "RGB"
# The program rounds at most by some 10⁻¹⁵ times the condition number of its training signals, which is below 10⁵ where
# this tolerance is used.
TOLERANCE = 1e-9
# From this condition number, columns scaled to unit length, samples count as dependent.
LARGEST_CONDITION = 1e4


def camera_signals(radiance):
    """ADU above black per s sr of R, G, B."""
    electrons = Sensor().electrons(radiance, exposure_s=1.0)
    return ADU_PER_E * np.stack([electrons[name] for name in CLASSES], axis=-1) / PER_SECOND


def exact(array):
    """The same numbers as fractions."""
    return np.vectorize(Fraction, otypes=[object])(np.asarray(array, dtype=np.float64))


def solve(left, right):
    """Solves linear equations in fractions by elimination: nothing is rounded."""
    rows = [[*a, *b] for a, b in zip(left, right)]
    count = len(rows)
    for column in range(count):
        pivot = max(range(column, count), key=lambda row: abs(rows[row][column]))
        rows[column], rows[pivot] = rows[pivot], rows[column]
        head = rows[column][column]
        rows[column] = [value / head for value in rows[column]]
        for row in range(count):
            factor = rows[row][column]
            if row != column and factor:
                rows[row] = [value - factor * top for value, top in zip(rows[row], rows[column])]
    return np.array([[float(value) for value in row[count:]] for row in rows])


def stationary(normal, moment, equality=None):
    """The B of least BᵀNB − 2BᵀK where C B = D, by the equations of Lagrange."""
    if equality is None:
        return solve(normal, moment)
    left, right = equality
    size, count = len(normal), len(left)
    zero = np.full((count, count), Fraction(0), dtype=object)
    whole = np.block([[normal, left.T], [left, zero]])
    return solve(whole, np.vstack([moment, right]))[:size]


def fitted(camera, xyz, weights=None, ridge=0.0, kept=None, ridge_of=None):
    """The matrix of least Σ wᵢ |xᵢ − M ρᵢ|² + ridge; `kept` is a signal and its XYZ. The ridge is a share of the sums
    of squares of these signals, or of `ridge_of`."""
    rho, color = exact(camera), exact(xyz)
    weighted = rho if weights is None else rho * exact(weights)[:, None]
    normal = weighted.T @ rho
    squares = (np.diag(normal) if ridge_of is None else (exact(ridge_of) ** 2).sum(axis=0)).copy()
    for index in range(3):
        normal[index, index] += Fraction(ridge) * squares[index]
    equality = None if kept is None else tuple(exact(np.atleast_2d(side)) for side in kept)
    return stationary(normal, weighted.T @ color, equality).T


def lab(xyz, white=WHITE):
    ratio = np.asarray(xyz) / white
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack(
        [116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1
    )


def lab_jacobian(xyz, white=WHITE):
    ratio = xyz / white
    slope = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio) ** -2 / 3, 1 / (3 * (6 / 29) ** 2)) / white
    return np.array([[0, 116, 0], [500, -500, 0], [0, 200, -200]]) * slope


def scaled_condition(camera):
    return np.linalg.cond(camera / np.linalg.norm(camera, axis=0))


class Case(ProgramCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.library = sample_data("skies/sky912.exr")
        cls.radiance = library_radiance().reshape(912, 471)
        cls.camera = camera_signals(cls.radiance)
        cls.xyz = tristimulus(cls.radiance)

    def setUp(self):
        super().setUp()
        self.chance = np.random.default_rng(912)

    def fit(self, *options, library=None):
        done = self.run_program(["fit-matrix", library or self.library, "--output-format", "json", "-q", *options])
        return json.loads(done)

    def draw(self, count, available=912):
        return [int(sample) for sample in self.chance.choice(available, count, replace=False)]

    def same_matrix(self, actual, expected, what, tolerance=TOLERANCE):
        actual, expected = np.asarray(actual), np.asarray(expected)
        worst = np.max(np.abs(actual / expected - 1))
        self.assertLess(worst, tolerance, f"{what}: {actual.tolist()} for {expected.tolist()}")

    def keeps(self, made, sample, what):
        color = np.asarray(made["matrix"]) @ self.camera[sample]
        worst = np.max(np.abs(color / self.xyz[sample] - 1))
        self.assertLess(worst, 1e-12, f"{what}: sample {sample} is not exact")

    def refused(self, status, saying, *options, library=None):
        done = self.attempt(["fit-matrix", library or self.library, *options])
        words = " ".join(map(str, options))
        self.assertEqual(done.returncode, status, f"{words}: {done.stderr}")
        self.assertEqual(done.stderr.count(b"\n"), 1, f"{words}: {done.stderr}")
        self.assertIn(saying, done.stderr.decode(), words)
        self.assertEqual(done.stdout, b"", words)


def listed(numbers):
    return ",".join(map(str, numbers))


class Matrices(Case):
    def average(self, candidates=None):
        """The sample whose chromaticity is nearest to the mean."""
        candidates = np.arange(912) if candidates is None else np.asarray(candidates)
        xy = (self.xyz[:, :2] / self.xyz.sum(axis=1, keepdims=True))[candidates]
        return int(candidates[np.argmin(np.linalg.norm(xy - xy.mean(axis=0), axis=1))])

    def agrees(self, method, training, options, weights=None, ridge=0.0, white=None):
        """Compares matrix, condition and what the file says; gives the JSON."""
        what = f"{method} {' '.join(map(str, options))}"
        made = self.fit("--method", method, *options)
        camera, xyz = self.camera[training], self.xyz[training]
        kept = None
        if method != "sky-rad-ls":
            white = self.average() if white is None else white
            self.assertEqual(made["training"]["white_sample"], white, what)
            kept = self.camera[white], self.xyz[white]
            self.keeps(made, white, what)
        expected = fitted(camera, xyz, weights, ridge, kept)
        self.same_matrix(made["matrix"], expected, what)
        strengths = np.ones(len(training)) if weights is None else np.sqrt(weights)
        condition = np.linalg.cond(camera * strengths[:, None])
        self.assertLess(abs(made["condition"] / condition - 1), 1e-9, f"{what}: {made['condition']} for {condition}")
        self.assertEqual(made["rank"], 3, what)
        self.assertEqual(made["training"]["count"], len(training), what)
        self.assertEqual(made["unit"], "cd m-2 per (ADU s-1 sr-1)")
        # What is left on the training samples.
        left = camera @ expected.T
        rms = np.sqrt(np.mean((left / xyz - 1) ** 2, axis=0))
        np.testing.assert_allclose(made["training"]["relative_rms"], rms, rtol=1e-6, atol=1e-13, err_msg=what)
        xy = lambda color: color[:, :2] / color.sum(axis=1, keepdims=True)
        error = np.abs(xy(left) - xy(xyz)).max(axis=0)
        np.testing.assert_allclose(
            made["training"]["max_chromaticity_error"], error, rtol=1e-6, atol=1e-13, err_msg=what
        )
        return made

    def test_all_samples(self):
        everything = list(range(912))
        relative = self.xyz[:, 1] ** -2
        for method in ("sky-rad-ls", "sky-rad-sppls"):
            self.agrees(method, everything, [])
            self.agrees(method, everything, ["--weights", "relative"], relative)
            self.agrees(method, everything, ["--ridge", "0.001"], ridge=0.001)
            self.agrees(method, everything, ["--weights", "relative", "--ridge", "0.02"], relative, 0.02)
        for white in self.draw(3):
            self.agrees("sky-rad-sppls", everything, ["--white-sample", white], white=white)

    def test_random_samples(self):
        for trial in range(12):
            training = self.draw(int(self.chance.integers(6, 60)))
            self.assertLess(np.linalg.cond(self.camera[training]), 1e5)
            method = ("sky-rad-ls", "sky-rad-sppls")[trial % 2]
            options, white = ["--train", listed(training)], None
            if method == "sky-rad-sppls" and trial % 4 == 1:
                (white,) = self.draw(1)
                options += ["--white-sample", white]
            weights, ridge = None, 0.0
            if trial % 3 == 1:
                weights = self.xyz[training, 1] ** -2
                options += ["--weights", "relative"]
            elif trial % 3 == 2:
                weights = np.round(self.chance.uniform(0, 5, len(training)), 3)
                options += ["--weights", listed(weights.tolist())]
            if trial % 5 > 2:
                ridge = float(f"{10 ** self.chance.uniform(-6, -1):.3g}")
                options += ["--ridge", ridge]
            self.agrees(method, training, options, weights, ridge, white)

    def responses(self):
        """Camera and observer at each wavelength."""
        return camera_signals(np.eye(471)), tristimulus(np.eye(471))

    def test_maximum_ignorance(self):
        camera, xyz = self.responses()
        for sample in (None, *self.draw(3)):
            white = self.average() if sample is None else sample
            options = [] if sample is None else ["--white-sample", sample]
            kept = self.camera[white], self.xyz[white]
            for method in ("max-ign-sppls", "max-ign-positive-sppls"):
                for ridge in (0.0, 0.003):
                    what = f"{method} {options} {ridge}"
                    made = self.fit("--method", method, "--ridge", ridge, *options)
                    # Cᵀ E(L Lᵀ) C for camera and observer: E(L Lᵀ) is I, times any number, for powers of any sign, and
                    # I/12 + 1 1ᵀ/4 for powers even between 0 and 1.
                    rho, color = exact(camera), exact(xyz)
                    normal, moment = rho.T @ rho, rho.T @ color
                    if method == "max-ign-positive-sppls":
                        one, sums, colors = Fraction(1, 12), rho.sum(axis=0), color.sum(axis=0)
                        normal = one * normal + Fraction(1, 4) * np.outer(sums, sums)
                        moment = one * moment + Fraction(1, 4) * np.outer(sums, colors)
                    condition = math.sqrt(np.linalg.cond(normal.astype(np.float64)))
                    for index in range(3):
                        normal[index, index] *= 1 + Fraction(ridge)
                    equality = tuple(exact(np.atleast_2d(side)) for side in kept)
                    self.same_matrix(made["matrix"], stationary(normal, moment, equality).T, what)
                    self.keeps(made, white, what)
                    self.assertLess(abs(made["condition"] / condition - 1), 1e-9, what)
                    self.assertEqual(made["rank"], 3)
                    self.assertEqual(made["training"]["white_sample"], white)

    def test_jackknife(self):
        # The ridge stays what it is for all 20 samples.
        kept_exact = ["--method", "sky-rad-sppls", "--white-sample", "300"]
        cases = [[], kept_exact, ["--weights", "relative"], ["--ridge", 0.01]]
        for trial, options in enumerate(cases):
            training = self.draw(20)
            made = self.fit("--train", listed(training), *options)
            camera, xyz = self.camera[training], self.xyz[training]
            weights = xyz[:, 1] ** -2 if trial == 2 else np.ones(20)
            kept = (self.camera[300], self.xyz[300]) if trial == 1 else None
            ridge = 0.01 if trial == 3 else 0.0
            every = [np.arange(20) != left_out for left_out in range(20)]
            matrices = np.array(
                [fitted(camera[rest], xyz[rest], weights[rest], ridge, kept, camera) for rest in every]
            )
            deviation = matrices - matrices.mean(axis=0)
            covariance = np.einsum("nij,nik->ijk", deviation, deviation) * 19 / 20
            error = np.sqrt(np.einsum("ijj->ij", covariance))
            self.assertEqual(made["uncertainty"]["method"], "jackknife")
            np.testing.assert_allclose(made["uncertainty"]["standard_error"], error, rtol=1e-7)
            scale = error[:, :, None] * error[:, None, :]
            worst = np.max(np.abs(np.asarray(made["uncertainty"]["covariance"]) - covariance) / scale)
            self.assertLess(worst, 1e-7, options)

    def test_labels_held_out(self):
        labels = [row["aerosol"] for row in library_meta("sky912")]
        column = f"{sample_data('skies/sky912_meta.csv')}:aerosol"
        for trained in (["none", "rural5"], ["rural25", "urban5"]):
            held = sorted(set(labels) - set(trained))
            training = [number for number, label in enumerate(labels) if label in trained]
            options = ["--labels", column, "--hold-out", ",".join(held)]
            made = self.fit(*options)
            self.same_matrix(made["matrix"], fitted(self.camera[training], self.xyz[training]), trained)
            self.assertEqual(made["training"]["samples"], training)
            self.assertEqual(made["training"]["held_out"], held)
            made = self.fit(*options, "--method", "sky-rad-sppls")
            white = self.average(training)
            self.assertEqual(made["training"]["white_sample"], white)
            kept = self.camera[white], self.xyz[white]
            self.same_matrix(made["matrix"], fitted(self.camera[training], self.xyz[training], kept=kept), trained)

    def test_chosen_samples(self):
        spectra = self.radiance / np.linalg.norm(self.radiance, axis=1, keepdims=True)
        distance = np.stack([np.linalg.norm(spectra - spectrum, axis=1) for spectrum in spectra])
        nearest, chosen = np.full(912, np.inf), []
        for _ in range(20):
            totals = np.minimum(distance, nearest).sum(axis=1)
            totals[chosen] = np.inf
            chosen.append(int(np.argmin(totals)))
            nearest = np.minimum(nearest, distance[chosen[-1]])
        made = self.fit("--train", 20)
        self.assertEqual(made["training"]["samples"], sorted(chosen))
        self.assertEqual(made, self.fit("--train", 20))
        self.same_matrix(made["matrix"], fitted(self.camera[sorted(chosen)], self.xyz[sorted(chosen)]), "chosen")


class Refusals(Case):
    UNDETERMINED = "do not determine the matrix"

    def write_library(self, name, spectra):
        names = [f"s{number}" for number in range(len(spectra))]
        lines = ["# Unit: W cm-2 sr-1 nm-1", "wavelength_nm," + ",".join(names)]
        columns = np.asarray(spectra).T.tolist()
        for row, values in enumerate(columns):
            lines.append(",".join([f"{360 + row}", *(f"{value:.17g}" for value in values)]))
        (self.directory / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
        return name

    def test_one_sample_repeated(self):
        for count in (2, 3, 12):
            self.refused(1, self.UNDETERMINED, "--train", listed([240] * count))

    def test_nearly_equal_samples(self):
        for size in (0.0, 1e-12, 1e-9):
            spectra = self.radiance[240] * (1 + size * self.chance.uniform(-1, 1, (6, 471)))
            name = self.write_library("equal.csv", spectra)
            self.refused(1, self.UNDETERMINED, library=name)
        same = self.write_library("same.csv", [self.radiance[240]] * 4)
        self.refused(1, "different spectra", "--train", "3", library=same)

    def test_nearly_equal_samples_and_one_kept(self):
        # A kept sample that is one more of them does not help; one that is another is one equation, and they are one.
        keep = ["--method", "sky-rad-sppls", "--white-sample"]
        for size in (0.0, 1e-12, 1e-9):
            spectra = self.radiance[240] * (1 + size * self.chance.uniform(-1, 1, (7, 471)))
            spectra[6] = self.radiance[700]
            name = self.write_library("equal.csv", spectra)
            for kept in (0, 6):
                with self.subTest(size=size, kept=kept):
                    self.refused(1, self.UNDETERMINED, *keep, kept, "--train", "0,1,2,3,4,5", library=name)

    def test_samples_whose_last_digits_decide(self):
        # Three skies so alike that a change of the sixth digit, as far as radiances are known, changes the matrix by more
        # than a hundredth of itself.
        triple = [249, 250, 254]
        self.assertGreater(scaled_condition(self.camera[triple]), LARGEST_CONDITION)
        self.refused(1, self.UNDETERMINED, "--train", listed(triple))

    def test_samples_in_different_amounts(self):
        # The same light, brighter and darker, is one sample still.
        spectra = self.radiance[240] * np.array([[1.0], [2.0], [0.5], [7.3]])
        self.refused(1, self.UNDETERMINED, library=self.write_library("amounts.csv", spectra))

    def test_too_few_and_collinear(self):
        for _ in range(5):
            pair = self.draw(2)
            self.refused(1, self.UNDETERMINED, "--train", listed(pair))
            spectra = self.radiance[pair]
            share = self.chance.uniform(0.2, 0.8)
            between = share * spectra[0] + (1 - share) * spectra[1]
            name = self.write_library("collinear.csv", [*spectra, between])
            self.refused(1, self.UNDETERMINED, library=name)
            self.refused(1, self.UNDETERMINED, "--weights", "relative", library=name)
            # A ridge determines it.
            self.fit("--ridge", "0.01", library=name)

    def test_accepted_by_condition_number(self):
        accepted = 0
        for _ in range(40):
            first = int(self.chance.integers(0, 900))
            triple = [first, first + 1, first + 1 + int(self.chance.integers(1, 10))]
            condition = scaled_condition(self.camera[triple])
            if abs(condition / LARGEST_CONDITION - 1) < 1e-3:
                continue
            if condition > LARGEST_CONDITION:
                self.refused(1, self.UNDETERMINED, "--train", listed(triple))
            else:
                self.fit("--train", listed(triple), *WHITE_OPTION)
                accepted += 1
        self.assertTrue(0 < accepted < 40, accepted)

    def test_two_samples_and_the_one_kept(self):
        tried = 0
        while tried < 6:
            triple = self.draw(3)
            if scaled_condition(self.camera[triple]) > 1e4:
                continue
            tried += 1
            made = self.fit("--method", "sky-rad-sppls", "--train", listed(triple[:2]), "--white-sample", triple[2])
            self.keeps(made, triple[2], triple)
            color = self.camera[triple] @ np.asarray(made["matrix"]).T
            # Backward stable: an error of some 10⁻¹⁶ beside the sum of the terms' magnitudes; they cancel little.
            terms = np.abs(self.camera[triple]) @ np.abs(np.asarray(made["matrix"])).T
            self.assertLess(np.max(np.abs(color - self.xyz[triple]) / terms), 1e-12, triple)
        kept = ["--method", "sky-rad-sppls", "--train", listed(triple[:2]), "--white-sample", triple[0]]
        self.refused(1, self.UNDETERMINED, *kept)

    def test_samples_that_do_not_exist(self):
        self.refused(2, "no sample 912", "--train", "0,1,912")
        self.refused(2, "no sample 912", "--method", "sky-rad-sppls", "--white-sample", 912)
        self.refused(2, "no sample 1000", "--method", "max-ign-sppls", "--white-sample", 1000)
        self.refused(2, "fewer than 2000", "--train", 2000)
        self.refused(2, "2 weights do not fit 3", "--train", "0,300,700", "--weights", "1,2")
        column = f"{sample_data('skies/sky912_meta.csv')}:aerosol"
        self.refused(2, "urban5", "--labels", column, "--hold-out", "urban")
        self.refused(2, "held out", "--labels", column, "--hold-out", "none", "--train", "0,500,900")

    def test_senseless_requests(self):
        self.refused(2, "no training samples", "--method", "max-ign-sppls", "--train", "20")
        self.refused(2, "no samples to weigh", "--method", "max-ign-positive-sppls", "--weights", "relative")
        self.refused(2, "keeps no sample", "--white-sample", "3")


class NoiseAware(Case):
    def covariance(self, sample, exposure_s, method):
        """Covariance of a demosaicked pixel, (ADU per s sr)²."""
        electrons = self.camera[sample] / ADU_PER_E * PER_SECOND * exposure_s
        done = self.run_program(
            ["predict-noise", "--electrons", ",".join(map(repr, electrons.tolist())), "--exposure", repr(exposure_s)]
            + ["--method", method, "--output-format", "json", "-q"]
        )
        (stage,) = [stage for stage in json.loads(done)["stages"] if stage["stage"] == "demosaicked"]
        return np.asarray(stage["covariance"]) / (exposure_s * PER_SECOND) ** 2

    def terms(self, training, exposures_s, method):
        """What error and noise are made of: JᵀJ, ρ, x and S of each sample."""
        jacobians = [lab_jacobian(self.xyz[sample]) for sample in training]
        return [
            (exact(jacobian).T @ exact(jacobian), self.camera[sample], self.xyz[sample], covariance)
            for jacobian, sample, covariance in zip(
                jacobians, training, (self.covariance(s, t, method) for s, t in zip(training, exposures_s))
            )
        ]

    def best(self, terms, noise_weight, weights=None, ridge=0.0, kept=None):
        """The nine elements of least Σ |J(Mρ − x)|² + W tr(J M S Mᵀ Jᵀ), from its derivative."""
        normal = np.full((9, 9), Fraction(0), dtype=object)
        moment = np.full((9, 1), Fraction(0), dtype=object)
        diagonal = np.full(9, Fraction(0), dtype=object)
        for index, (metric, rho, color, covariance) in enumerate(terms):
            weight = Fraction(1 if weights is None else float(weights[index]))
            signal, spread = exact(rho), exact(covariance)
            spread = (spread + spread.T) / 2
            of_color = weight * np.kron(metric, np.outer(signal, signal))
            diagonal += np.diag(of_color)
            normal += of_color + weight * Fraction(noise_weight) * np.kron(metric, spread)
            moment[:, 0] += weight * np.kron(metric @ exact(color), signal)
        for index in range(9):
            normal[index, index] += Fraction(ridge) * diagonal[index]
        equality = None
        if kept is not None:
            left = np.kron(exact(np.eye(3)), exact(self.camera[kept])[None, :])
            equality = left, exact(self.xyz[kept])[:, None]
        return stationary(normal, moment, equality).reshape(3, 3)

    def errors(self, matrix, terms):
        """Rms error of color and rms noise."""
        model, noise = [], []
        for metric, rho, color, covariance in terms:
            metric, off = metric.astype(np.float64), matrix @ rho - color
            model.append(off @ metric @ off)
            noise.append(np.trace(metric @ matrix @ covariance @ matrix.T))
        return math.sqrt(np.mean(model)), math.sqrt(np.mean(noise))

    def test_least_error_and_noise(self):
        # predict-noise and fit-matrix work the covariance out alike, to some 10⁻¹⁵ of itself for electrons that differ
        # by 10⁻¹⁵; the nine unknowns are conditioned like three, here below 10⁵, so 10⁻⁹ leaves room.
        cases = [
            ("eci", 0.002, 1.0, []),
            ("eci", None, 1 / 320, []),
            ("bi", 0.001, 0.1, ["--method", "sky-rad-sppls", "--white-sample", "300"]),
            ("mhc", None, 3.0, ["--weights", "relative"]),
            ("eci", None, 0.25, ["--ridge", "0.001"]),
            ("eci", 0.002, 0.0, []),
        ]
        for demosaic, exposure_s, noise_weight, options in cases:
            training = self.draw(8)
            what = f"{demosaic} {exposure_s} {noise_weight} {options} {training}"
            brightest = self.camera[training].max(axis=1) / ADU_PER_E * PER_SECOND
            filled = 0.75 * FULL_WELL_E / brightest
            exposures = filled.tolist() if exposure_s is None else [exposure_s] * 8
            exposure = [] if exposure_s is None else ["--exposure", exposure_s]
            made = self.fit(
                *("--train", listed(training), "--noise-weight", repr(noise_weight), "--demosaic", demosaic),
                *(*exposure, *WHITE_OPTION, *options),
            )
            terms = self.terms(training, exposures, demosaic)
            kept = 300 if "--white-sample" in options else None
            weights = self.xyz[training, 1] ** -2 if "relative" in options else None
            ridge = 0.001 if "--ridge" in options else 0.0
            expected = self.best(terms, noise_weight, weights, ridge, kept)
            self.same_matrix(made["matrix"], expected, what)
            self.assertEqual(made["training"]["noise_weight"], noise_weight)
            if kept is not None:
                self.keeps(made, kept, what)
            (point,) = [point for point in made["trade_off"] if point["noise_weight"] == noise_weight]
            model, noise = self.errors(expected, terms)
            # The error is what is left where colors nearly agree, so it keeps fewer digits.
            self.assertLess(abs(point["model_delta_e"] / model - 1), 1e-7, what)
            self.assertLess(abs(point["noise_delta_e"] / noise - 1), 1e-9, what)

    def test_trade_off_is_monotone(self):
        for options in ([], ["--train", "20"], ["--method", "sky-rad-sppls"], ["--exposure", "0.002"]):
            made = self.fit("--noise-weight", "0.05", *WHITE_OPTION, *options)
            names = ("noise_weight", "model_delta_e", "noise_delta_e")
            weight, model, noise = (np.array([point[name] for point in made["trade_off"]]) for name in names)
            self.assertGreater(len(weight), 20)
            self.assertIn(0.05, weight)
            self.assertTrue((np.diff(weight) > 0).all(), options)
            self.assertTrue((np.diff(model) > -1e-12 * model[1:]).all(), options)
            self.assertTrue((np.diff(noise) < 1e-12 * noise[1:]).all(), options)
            self.assertGreater(model[-1], model[0])
            self.assertLess(noise[-1], noise[0])
            # Each point has the least sum of all for its own weight.
            total = model[None, :] ** 2 + weight[:, None] * noise[None, :] ** 2
            self.assertTrue((total.diagonal() <= total.min(axis=1) * (1 + 1e-12)).all(), options)


class Evaluation(Case):
    def table(self, *options, library=None):
        library = library or self.library
        done = self.run_program(
            ["fit-matrix", self.library, "--evaluate", library, "--output-format", "csv", "-q", *WHITE_OPTION, *options]
        )
        rows = list(csv.DictReader(io.StringIO(done.decode())))
        return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}

    def summary(self, actual, differences, what):
        expected = {
            "min": differences.min(),
            "mean": differences.mean(),
            "median": np.median(differences),
            "p95": np.quantile(differences, 0.95),
            "max": differences.max(),
        }
        for name, value in expected.items():
            # L*a*b* of 100 rounds by 10⁻¹⁴: the sample that is kept exact differs by no more than rounding.
            for formula, unit in (("delta_e_76", 1.0), ("jnd", 2.3)):
                error = abs(actual[formula][name] * unit - value)
                self.assertLess(error, 1e-9 * value + 1e-11, f"{what} {formula} {name}")
        for formula, unit in (("delta_e_76", 1.0), ("jnd", 2.3)):
            for name, limit in (("below_tenth", 0.1), ("below_quarter", 0.25), ("below_half", 0.5)):
                self.assertEqual(actual[formula][name], np.mean(differences / unit < limit), f"{what} {formula} {name}")

    def test_color_differences(self):
        for options in ([], ["--train", "20"], ["--method", "max-ign-sppls"], ["--noise-weight", "1"]):
            made = self.fit("--evaluate", self.library, "--noise-free", *WHITE_OPTION, *options)
            color = self.camera @ np.asarray(made["matrix"]).T
            differences = np.linalg.norm(lab(color) - lab(self.xyz), axis=1)
            self.summary(made["evaluation"], differences, options)
            self.assertEqual(made["about"]["samples"], 912)
            table = self.table("--noise-free", *options)
            self.assertEqual(table["sample"].tolist(), list(range(912)))
            np.testing.assert_allclose(table["delta_e_76"], differences, rtol=0, atol=1e-11)
            np.testing.assert_allclose(table["jnd"], differences / 2.3, rtol=0, atol=1e-11)
            for column, name in enumerate("XYZ"):
                np.testing.assert_allclose(table[f"true_{name}"], self.xyz[:, column], rtol=1e-13)
                np.testing.assert_allclose(table[f"camera_{name}"], color[:, column], rtol=1e-12)
                self.assertTrue(np.all(table[f"white_{name}"] == WHITE[column]))
            self.assertTrue(np.allclose(table["electrons_B"].max(), 0.75 * FULL_WELL_E, rtol=1e-12, atol=0))
            per_second = self.camera / ADU_PER_E * PER_SECOND
            exposure = 0.75 * FULL_WELL_E / per_second.max(axis=1)
            np.testing.assert_allclose(table["exposure_s"], exposure, rtol=1e-12)
            for column, name in enumerate(CLASSES):
                np.testing.assert_allclose(table[f"electrons_{name}"], per_second[:, column] * exposure, rtol=1e-12)

    def test_another_library(self):
        path = sample_data("skies/kider2014.exr")
        made = self.fit("--evaluate", path, "--noise-free", *WHITE_OPTION)
        radiance = library_radiance("kider2014").reshape(-1, 471)
        color = camera_signals(radiance) @ np.asarray(made["matrix"]).T
        differences = np.linalg.norm(lab(color) - lab(tristimulus(radiance)), axis=1)
        self.assertEqual(made["about"]["samples"], 1600)
        self.summary(made["evaluation"], differences, "measured skies")

    def test_same_output_whatever_the_threads(self):
        command = ["fit-matrix", self.library, "--evaluate", self.library, "--noise-weight", "0.1", "--train", "20"]
        for form in ("csv", "json", "text"):
            runs = [
                self.run_program([*command, "--output-format", form, "--threads", threads]) for threads in (1, 2, 2)
            ]
            self.assertEqual(runs[0], runs[1], form)
            self.assertEqual(runs[1], runs[2], form)
        self.assertEqual(self.table("--threads", 1)["sample"].size, 912)

    def test_groups(self):
        labels = np.array([row["aerosol"] for row in library_meta("sky912")])
        column = f"{sample_data('skies/sky912_meta.csv')}:aerosol"
        held = ["maritime23", "urban5"]
        made = self.fit(
            *("--evaluate", self.library, "--labels", column, "--hold-out", ",".join(held)),
            *("--noise-free", *WHITE_OPTION),
        )
        color = self.camera @ np.asarray(made["matrix"]).T
        differences = np.linalg.norm(lab(color) - lab(self.xyz), axis=1)
        is_held = np.isin(labels, held)
        members = {"trained on": ~is_held, "never trained on": is_held}
        for label in sorted(set(labels)):
            members[f"{label} (held out)" if label in held else label] = labels == label
        self.assertEqual([group["name"] for group in made["groups"]], list(members))
        for group in made["groups"]:
            is_member = members[group["name"]]
            self.assertEqual(group["samples"], np.count_nonzero(is_member), group["name"])
            self.assertEqual(group["trained_on"], np.count_nonzero(is_member & ~is_held), group["name"])
            self.summary(group, differences[is_member], group["name"])

    def patch_share(self, matrix_file, table, width, height):
        """Variance of a patch's mean of L*, a*, b* beside that of a pixel, averaged over some samples."""
        shares = []
        for sample in range(0, 912, 24):
            electrons = [repr(float(table[f"electrons_{name}"][sample])) for name in CLASSES]
            done = self.run_program(
                ["predict-noise", "--electrons", ",".join(electrons), "--matrix", matrix_file, *WHITE_OPTION]
                + ["--exposure", repr(float(table["exposure_s"][sample])), "--patch", f"{width}x{height}"]
                + ["--patch-at", "3,3", "--output-format", "json", "-q"]
            )
            (stage,) = [stage for stage in json.loads(done)["stages"] if stage["stage"] == "lab"]
            shares.append(np.square(stage["patch_mean_std"]) / np.diag(stage["covariance"]))
        return np.mean(shares, axis=0)

    def test_noise_is_as_predicted(self):
        self.run_program(["fit-matrix", self.library, "-o", "matrix.yaml", "-q"])
        width, height = 20, 16
        table = self.table("--seed", 5, "--patch", f"{width}x{height}")
        # Patches lie beside each other and share no photosites, so the ratios of the 912 are independent, and their own
        # scatter gives the error of their mean; four of it are exceeded once in 16000.
        ratio = table["noise_delta_e"] / table["predicted_delta_e"]
        error = ratio.std(ddof=1) / math.sqrt(912)
        self.assertLess(error, 0.01)
        self.assertLess(abs(ratio.mean() - 1), 4 * error, f"{ratio.mean()} ± {error}")
        # s² about the patch's own mean, divisor n − 1, is n/(n − 1) (σ² − variance of the mean) on average:
        # demosaicked pixels are correlated, so their mean varies more than σ²/n.
        share = self.patch_share("matrix.yaml", table, width, height)
        pixels = width * height
        for index, name in enumerate("Lab"):
            ratio = (table[f"std_{name}"] / table[f"predicted_std_{name}"]) ** 2
            error = ratio.std(ddof=1) / math.sqrt(912)
            expected = pixels / (pixels - 1) * (1 - share[index])
            self.assertLess(error, 0.02)
            self.assertLess(abs(ratio.mean() - expected), 4 * error, f"{name}: {ratio.mean()} ± {error} for {expected}")

    def compare_with_chart(self, dark_frames):
        width, height, margin, exposure_s = 20, 16, 3, "0.0005"
        self.run_program(["fit-matrix", self.library, "-o", "matrix.yaml", "-q"])
        whole = f"{width + 2 * margin}x{height + 2 * margin}"
        codes = [["digitize", "-q"], ["mosaic", "-q"]]
        corrected = [["correct-frame", "-q"]] if dark_frames else []
        for frame in range(1, dark_frames + 1):
            size = f"{38 * (width + 2 * margin)}x{24 * (height + 2 * margin)}"
            dark = self.run_pipe(
                ["render-radiance", "--dark", "--size", size, "--exposure", exposure_s, "-q"],
                ["add-noise", "--seed", 3, "--frame", frame, "-q"],
                *codes,
            )
            (self.directory / f"dark{frame}.exr").write_bytes(dark)
            corrected[0] += ["--dark", f"dark{frame}.exr"]
        # Both ways round the same electrons to single precision and draw the same numbers at the same photosites, so
        # the pixels agree to the bit; what is left is the order of sums over pixels in double precision.
        planes = self.frame(
            ["render-radiance", self.library, "--patch", whole, "--exposure", exposure_s, "-q"],
            ["add-noise", "--seed", 3, "-q"],
            *codes,
            *corrected,
            ["demosaic", "--method", "eci", "-q"],
            ["to-xyz", "--matrix", "matrix.yaml", "--space", "xyz", "-q"],
        )
        table = self.table(
            *("--exposure", exposure_s, "--patch", f"{width}x{height}", "--seed", 3, "--demosaic", "eci"),
            *("--dark-frames", dark_frames),
        )
        # Less dark frames, a layer marks what used saturated samples.
        frame = np.stack([planes[name].astype(np.float64) for name in "RGB"], axis=-1)
        patches = frame.reshape(24, height + 2 * margin, 38, width + 2 * margin, 3)
        inner = patches[:, margin:-margin, :, margin:-margin].transpose(0, 2, 1, 3, 4).reshape(912, -1, 3)
        found = np.linalg.norm(lab(inner.mean(axis=1)) - lab(self.xyz), axis=1)
        pixels = np.linalg.norm(lab(inner) - lab(self.xyz)[:, None], axis=2)
        # Their mean colors are off by as much as predicted, on average.
        camera_xyz = np.stack([table[f"camera_{axis}"] for axis in "XYZ"], axis=-1)
        ratio = np.linalg.norm(lab(inner.mean(axis=1)) - lab(camera_xyz), axis=1) / table["predicted_patch_delta_e"]
        error = ratio.std(ddof=1) / math.sqrt(912)
        self.assertLess(error, 0.03)
        self.assertLess(abs(ratio.mean() - 1), 4 * error, f"{ratio.mean()} ± {error}")
        for name, values in [
            ("noise_delta_e", np.linalg.norm(lab(inner) - lab(camera_xyz)[:, None], axis=2).mean(axis=1)),
            ("patch_mean_delta_e_76", found),
            ("pixel_mean_delta_e_76", pixels.mean(axis=1)),
            ("pixel_std_delta_e_76", pixels.std(axis=1, ddof=1)),
            ("pixel_max_delta_e_76", pixels.max(axis=1)),
            *((f"std_{axis}", lab(inner)[..., index].std(axis=1, ddof=1)) for index, axis in enumerate("Lab")),
        ]:
            error = np.abs(table[name] - values)
            self.assertLess(error.max(), 1e-9, f"{name} of sample {np.argmax(error)}")

    def test_same_photosites_as_the_chart(self):
        self.compare_with_chart(0)

    def test_same_photosites_as_the_chart_less_dark_frames(self):
        self.compare_with_chart(2)


if __name__ == "__main__":
    unittest.main()
