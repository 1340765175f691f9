"""The sampler before an outside battery: laws, spectra and correlations computed with numpy and scipy alone.

Frames of 2^20 photosites a class come from the programs; what is expected of them comes from scipy's own distributions.
Every p-value must be above 1e-5, and their number (some two hundred) keeps the chance of a false alarm below 1 in 500.
"""

import itertools
import math

import numpy as np
from scipy import stats

from programs import ProgramCase

SIZE = 1024
SMALLEST_P = 1e-5
SOURCES = ("dcsn", "dcnu", "ssn", "prnu", "ron")
# At 1 K there is no dark current.
COLD = ("--temperature", 1)


class Battery(ProgramCase):
    def exposed(self, levels, kept, *options):
        without = [source for source in SOURCES if source not in kept]
        electrons = self.run_program(
            ["render-radiance", "--electrons", ",".join(map(repr, levels)), "--size", f"{SIZE}x{SIZE}"]
        )
        leave_out = ["--without", ",".join(without)] if without else []
        planes = self.frame(["add-noise", *leave_out, *options], stdin=electrons)
        return [planes[name].astype(np.float64) for name in "RGB"]

    def check(self, p, what):
        self.assertGreater(p, SMALLEST_P, what)

    def check_z(self, z, what):
        self.check(2 * stats.norm.sf(abs(z)), f"{what}: z = {z}")


class Laws(Battery):
    def test_counts_follow_the_poisson_law(self):
        """χ² against scipy's probabilities, and the first four moments; on both sides of every switch of method."""
        groups = [(0.02, 0.7, 3.3), (9.9, 9.9999, 10.0), (10.3, 31.7, 73.21), (199.5, 200.5, 1000.0), (5e3, 3e4, 4e4 - 2e3)]
        for seed, levels in enumerate(groups):
            for level, counts in zip(levels, self.exposed(levels, ["ssn"], *COLD, "--seed", seed)):
                level = float(np.float32(level))
                law = stats.poisson(level)
                n = counts.size
                # Cells of whole counts, each expecting 50 or more.
                edges = np.unique(law.ppf(np.linspace(0, 1, 401)[1:-1]))
                shares = np.diff(np.concatenate([[0], law.cdf(edges), [1]]))
                found = np.bincount(np.searchsorted(edges, counts.ravel()), minlength=shares.size)
                wide = shares * n >= 50
                lumped = lambda cells: np.append(cells[wide], cells[~wide].sum())
                expected, seen = lumped(shares * n), lumped(found)
                if expected[-1] < 5:
                    expected, seen = expected[:-1], seen[:-1]
                    expected *= seen.sum() / expected.sum()
                self.check(stats.chisquare(seen, expected).pvalue, f"χ² at {level}")
                # Central moments, with the sampling errors of the exact law.
                central = poisson_central_moments(level)
                for order in (1, 2, 3, 4):
                    mean = np.mean((counts - level) ** order)
                    error = math.sqrt((central[2 * order] - central[order] ** 2) / n)
                    self.check_z((mean - central[order]) / error, f"moment {order} at {level}")
                self.assertTrue(np.all(counts == np.floor(counts)))

    def test_read_noise_is_normal_into_the_tails(self):
        for seed in (1, 2):
            for plane in self.exposed((0, 0, 0), ["ron"], *COLD, "--seed", seed):
                z = plane.ravel() / 15.7
                self.check(stats.kstest(z, "norm").pvalue, "Kolmogorov and Smirnov")
                for order, expected, variance in ((1, 0, 1), (2, 1, 2), (3, 0, 15), (4, 3, 96)):
                    self.check_z((np.mean(z**order) - expected) * math.sqrt(z.size / variance), f"moment {order}")
                for sigma in (3, 3.6, 3.7, 4, 4.5):
                    beyond = int(np.sum(np.abs(z) > sigma))
                    self.check(stats.binomtest(beyond, z.size, 2 * stats.norm.sf(sigma)).pvalue, f"beyond {sigma} σ")

    def test_patterns_have_their_mean_and_spread(self):
        for plane in self.exposed((10_000, 20_000, 30_000), ["prnu"], *COLD, "--sensor-seed", 4):
            level = round(plane.mean(), -4)
            z = (plane.ravel() / level - 1) / 0.008
            self.check(stats.kstest(z, "norm").pvalue, "response")
        dark = self.exposed((0, 0, 0), ["dcnu"], "--sensor-seed", 4)
        for plane in dark:
            z = (plane.ravel() / 73.2134 - 1) / 0.2
            self.check_z(np.mean(z) * math.sqrt(z.size), "mean of the dark response")
            self.check_z((np.std(z) - 1) * math.sqrt(2 * z.size), "spread of the dark response")


class Independence(Battery):
    whitened_planes = {}

    def whitened(self):
        """Each source alone, to mean 0 and variance 1, by class, frame and seed; made once."""
        noise = self.whitened_planes
        if noise:
            return noise
        for frame, seed in ((0, 0), (1, 0), (0, 1), (2**31, 2**40)):
            for source in SOURCES:
                lit = source in ("ssn", "prnu")
                options = ["--frame", frame, "--seed", seed, "--sensor-seed", seed + 7]
                levels = (2_000, 9_000, 20_000) if lit else (0, 0, 0)
                planes = self.exposed(levels, [source], *options, *(COLD if lit or source == "ron" else ()))
                for name, plane in zip("RGB", planes):
                    noise[source, name, frame, seed] = (plane - plane.mean()) / plane.std()
        return noise

    def test_nothing_is_correlated_with_anything(self):
        noise = self.whitened()
        n = SIZE * SIZE
        for (one, a), (other, b) in itertools.combinations(noise.items(), 2):
            # Fixed patterns repeat from frame to frame of a sensor; that is what they are.
            if one[0] == other[0] and one[0] in ("dcnu", "prnu") and one[1] == other[1] and one[3] == other[3]:
                self.assertTrue(np.array_equal(a, b))
                continue
            self.assertLess(abs(np.mean(a * b)) * math.sqrt(n), 5.5, f"{one} and {other}")
            # Neither are the squares: no shared words.
            squares = np.mean((a**2 - 1) * (b**2 - 1)) / 2
            self.assertLess(abs(squares) * math.sqrt(n), 6, f"squares of {one} and {other}")
        for name, a in noise.items():
            for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1), (0, 2), (2, 0), (0, 16), (0, 256), (64, 0)):
                product = np.mean(a * np.roll(a, (dy, dx), axis=(0, 1)))
                self.assertLess(abs(product) * math.sqrt(n), 5.5, f"{name} and its neighbor {dy}, {dx}")

    def test_two_dimensional_spectra_are_white(self):
        noise = self.whitened()
        for name, a in noise.items():
            if name[2:] != (0, 0):
                continue
            power = np.abs(np.fft.fft2(a)) ** 2 / a.size
            half = power[:, 1 : SIZE // 2].ravel()
            self.check(stats.kstest(half, "expon").pvalue, f"{name}: power is exponential")
            # Rows, columns and the largest line.
            for axis in (0, 1):
                line = power[1:, 1:].mean(axis=axis) - 1
                self.assertLess(np.abs(line).max() * math.sqrt(SIZE / 2), 6, f"{name}: axis {axis}")
            self.check(-math.expm1(-half.size * math.exp(-half.max())), f"{name}: the largest line")


def poisson_central_moments(level):
    """Central moments 0 to 8 by μ(m+1) = λ Σ C(m, j) μ(j), j < m [Kendall and Stuart]."""
    moments = [1.0, 0.0]
    for m in range(1, 8):
        moments.append(level * sum(math.comb(m, j) * moments[j] for j in range(m)))
    return moments
