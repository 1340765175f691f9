"""Noise and digitization: measured moments beside formulas, and the laws that hold to the bit.

Var(PN) = λ + λ²s² + λs² for P ~ Poisson(λ), N ~ Normal(1, s), independent. The tolerance of a mean is 5 σ/√n, that
of a standard deviation 5 σ √(1/(2n)): the distributions here are nearly normal, their excess kurtosis is a few
hundredths beside the 2 it is added to.
"""

import math
import unittest

import numpy as np

from programs import ProgramCase, class_masks, mosaic, read_planes

BOLTZMANN_EV_PER_K = 1.380649e-23 / 1.602176634e-19
PITCH_CM = 6.8e-4
DARK_CURRENT_NA_PER_CM2 = 0.068558
EXPOSURE_S = 0.033
PRNU, DCNU, READ_NOISE_E = 0.008, 0.2, 15.7
BIAS_ADU, ADU_PER_E = 1753, 0.058824


def dark_electrons(temperature_k, exposure_s=EXPOSURE_S):
    """[HP2005, Eqs. 6 and 7] with the gap of MODEL section 2."""
    gap_ev = 1.1557 - 7.021e-4 * temperature_k**2 / (1108 + temperature_k)
    rate = (
        *(2.5e15, PITCH_CM**2, DARK_CURRENT_NA_PER_CM2),
        temperature_k**1.5,
        math.exp(-gap_ev / (2 * BOLTZMANN_EV_PER_K * temperature_k)),
    )
    return math.prod(rate) * exposure_s


def product_variance(rate, spread):
    return rate + rate**2 * spread**2 + rate * spread**2


def moments(level, temperature_k, exposure_s=EXPOSURE_S, read_noise=READ_NOISE_E):
    """Mean and standard deviation of one photosite of a sensor taken at random."""
    dark = dark_electrons(temperature_k, exposure_s)
    variance = product_variance(dark, DCNU) + product_variance(level, PRNU) + read_noise**2
    return level + dark, math.sqrt(variance)


class Noise(ProgramCase):
    def uniform(self, levels, size, *more):
        levels = ",".join(f"{level:g}" for level in levels)
        return self.run_program(["render-radiance", "--electrons", levels, "--size", size, *more])

    def noisy(self, electrons, *options):
        return self.frame(["add-noise", *options], stdin=electrons)

    def check_moments(self, samples, mean, std, what):
        samples = samples.astype(np.float64)
        n = samples.size
        self.assertLess(abs(samples.mean() - mean) / (std / math.sqrt(n)), 5, f"{what}: mean {samples.mean()}, {mean}")
        ratio = samples.std(ddof=1) / std
        self.assertLess(abs(ratio - 1) * math.sqrt(2 * n), 5, f"{what}: standard deviation is {ratio} of {std}")


class Moments(Noise):
    def test_electrons_over_levels_and_temperatures(self):
        seed = 0
        for levels in [(0, 10, 1000), (20000, 38000, 5000)]:
            electrons = self.uniform(levels, "500x400")
            for temperature_k in (200, 300, 333, 350):
                seed += 1
                planes = self.noisy(electrons, "--seed", seed, "--sensor-seed", seed, "--temperature", temperature_k)
                for name, level in zip("RGB", levels):
                    mean, std = moments(level, temperature_k)
                    self.check_moments(planes[name], mean, std, f"{level} e-, {temperature_k} K")

    def test_longer_exposure_collects_more_dark_charge(self):
        electrons = self.uniform((0, 100, 4000), "500x400", "--exposure", 0.5)
        planes = self.noisy(electrons, "--seed", 3)
        for name, level in zip("RGB", (0, 100, 4000)):
            self.check_moments(planes[name], *moments(level, 333, 0.5), f"{level} e-, 0.5 s")

    def test_dark_floor(self):
        dark = self.run_program(["render-radiance", "--dark", "--size", "1200x1000"])
        planes = self.noisy(dark, "--seed", 11, "--without", "ron")
        mean, std = moments(0, 333, read_noise=0)
        self.assertAlmostEqual(std, 17.05, places=2)
        everything = np.stack([planes[name] for name in "RGB"])
        # 3.6 million samples: 5 standard errors are 0.032 e-, and 16.96 lies 0.09 away.
        self.check_moments(everything, mean, std, "dark without read noise")
        planes = self.noisy(dark, "--seed", 12)
        self.check_moments(np.stack([planes[name] for name in "RGB"]), *moments(0, 333), "dark")

    def test_each_source_left_out(self):
        level, dark = 20000, dark_electrons(333)
        electrons = self.uniform((level,) * 3, "300x300")
        # Without its shot noise a charge is its expectation; without its nonuniformity a factor is one.
        variances = {
            "dcsn": (dark * DCNU) ** 2 + product_variance(level, PRNU) + READ_NOISE_E**2,
            "dcnu": dark + product_variance(level, PRNU) + READ_NOISE_E**2,
            "ssn": product_variance(dark, DCNU) + (level * PRNU) ** 2 + READ_NOISE_E**2,
            "prnu": product_variance(dark, DCNU) + level + READ_NOISE_E**2,
            "ron": product_variance(dark, DCNU) + product_variance(level, PRNU),
            "dcsn,dcnu,ssn,prnu": READ_NOISE_E**2,
        }
        for seed, (sources, variance) in enumerate(variances.items()):
            planes = self.noisy(electrons, "--seed", seed, "--without", sources)
            everything = np.stack([planes[name] for name in "RGB"])
            self.check_moments(everything, level + dark, math.sqrt(variance), f"without {sources}")
        planes = self.noisy(electrons, "--without", "dcsn,dcnu,ssn,prnu,ron")
        for samples in planes.values():
            np.testing.assert_allclose(samples, level + dark, rtol=1e-6)

    def test_read_noise_is_normal_and_photosites_are_independent(self):
        electrons = self.uniform((500,) * 3, "400x400")
        planes = self.noisy(electrons, "--seed", 21, "--without", "dcsn,dcnu,ssn,prnu")
        n = 400 * 400
        z = {k: (v.astype(np.float64) - v.mean(dtype=np.float64)) / READ_NOISE_E for k, v in planes.items()}
        for name, values in z.items():
            self.assertLess(abs(np.mean(values**3)), 5 * math.sqrt(6 / n), f"skewness of {name}")
            self.assertLess(abs(np.mean(values**4) - 3), 5 * math.sqrt(96 / n), f"kurtosis of {name}")
        limit = 5 / math.sqrt(n)
        for one, other in ("RG", "RB", "GB"):
            self.assertLess(abs(np.mean(z[one] * z[other])), limit, f"{one} and {other}")
        self.assertLess(abs(np.mean(z["R"][:, 1:] * z["R"][:, :-1])), limit * 1.01, "neighbors in a row")
        self.assertLess(abs(np.mean(z["R"][1:] * z["R"][:-1])), limit * 1.01, "neighbors in a column")

    def test_poisson_at_low_rates(self):
        levels = (0.1, 3.0, 30.0)
        electrons = self.uniform(levels, "400x400")
        planes = self.noisy(electrons, "--seed", 5, "--temperature", 200, "--without", "dcnu,prnu,ron")
        self.assertLess(dark_electrons(200), 1e-3)
        for name, level in zip("RGB", levels):
            counts = planes[name].astype(np.float64)
            self.assertTrue(np.all(counts == np.round(counts)), "shot noise alone counts whole electrons")
            rate = level + dark_electrons(200)
            expected = np.exp([k * math.log(rate) - rate - math.lgamma(k + 1) for k in range(120)]) * counts.size
            seen = np.bincount(counts.astype(int).ravel(), minlength=120)[:120]
            used = expected > 20
            rest = counts.size - expected[used].sum()
            chi2 = np.sum((seen[used] - expected[used]) ** 2 / expected[used])
            freedom = np.count_nonzero(used) - (rest < 20)
            # Wilson and Hilferty: the cube root of chi-square is nearly normal; 4.5 sigma.
            spread = 2 / (9 * freedom)
            z = ((chi2 / freedom) ** (1 / 3) - (1 - spread)) / math.sqrt(spread)
            self.assertLess(z, 4.5, f"counts at {level} e-: chi-square {chi2} for {freedom}")

    def test_full_well_clips_before_read_noise(self):
        electrons = self.uniform((60000, 40000, 100), "200x200")
        planes = self.noisy(electrons, "--seed", 2, "--without", "ron")
        self.assertTrue(np.all(planes["R"] == 40000))
        self.assertEqual(planes["G"].max(), 40000)
        planes = self.noisy(electrons, "--seed", 2)
        self.check_moments(planes["R"], 40000, READ_NOISE_E, "at full well")


class FixedAndTemporal(Noise):
    LEVEL = 20000
    SIZE = "400x300"
    N = 400 * 300

    def setUp(self):
        super().setUp()
        self.electrons = self.uniform((self.LEVEL,) * 3, self.SIZE)

    def shot(self, *options):
        return self.noisy(self.electrons, *options)["G"].astype(np.float64)

    def check_difference(self, one, other, variance, what):
        difference = one - other
        self.check_moments(difference, 0, math.sqrt(variance), what)

    def fixed_variance(self):
        return (self.LEVEL * PRNU) ** 2 + (dark_electrons(333) * DCNU) ** 2

    def temporal_variance(self):
        dark = dark_electrons(333)
        return self.LEVEL * (1 + PRNU**2) + dark * (1 + DCNU**2) + READ_NOISE_E**2

    def test_frames_share_the_fixed_pattern_only(self):
        for option in ("--frame", "--seed"):
            one, other = self.shot(option, 1), self.shot(option, 2)
            self.check_difference(one, other, 2 * self.temporal_variance(), f"{option} 1 and 2")
            shared = np.mean((one - one.mean()) * (other - other.mean()))
            total = self.temporal_variance() + self.fixed_variance()
            error = math.sqrt((total**2 + self.fixed_variance() ** 2) / self.N)
            self.assertLess(abs(shared - self.fixed_variance()), 5 * error, f"covariance over {option}")

    def test_mean_of_frames_keeps_the_fixed_pattern(self):
        count = 8
        mean = sum(self.shot("--frame", frame) for frame in range(count)) / count
        variance = self.fixed_variance() + self.temporal_variance() / count
        self.check_moments(mean, self.LEVEL + dark_electrons(333), math.sqrt(variance), "mean of frames")

    def test_sensors_share_the_temporal_noise_only(self):
        dark = dark_electrons(333)
        one = self.shot("--sensor-seed", 1, "--seed", 4)
        other = self.shot("--sensor-seed", 2, "--seed", 4)
        variance = 2 * (PRNU**2 * (self.LEVEL**2 + self.LEVEL) + DCNU**2 * (dark**2 + dark))
        self.check_difference(one, other, variance, "--sensor-seed 1 and 2")

    def test_defaults_are_zero(self):
        explicit = self.shot("--seed", 0, "--sensor-seed", 0, "--frame", 0)
        np.testing.assert_array_equal(self.shot(), explicit)
        for option in ("--seed", "--sensor-seed", "--frame"):
            self.assertTrue(np.any(self.shot(option, 1) != explicit), option)


class Digitize(Noise):
    def check_codes(self, noisy, codes, bias=BIAS_ADU, slope=ADU_PER_E, top=4095):
        for name in noisy:
            exact = bias + slope * noisy[name].astype(np.float64)
            tie = np.abs(exact - np.floor(exact) - 0.5) < 1e-6
            expected = np.clip(np.floor(exact + 0.5), 0, top)
            wrong = (codes[name] != expected) & ~tie
            example = f"{name}: {noisy[name][wrong][:3]} gave {codes[name][wrong][:3]}"
            self.assertEqual(np.count_nonzero(wrong), 0, example)

    def test_codes_of_the_default_converter(self):
        for seed, levels in enumerate([(0, 100, 5000), (20000, 38000, 39900)]):
            noisy = self.run_program(["add-noise", "--seed", seed], self.uniform(levels, "300x200"))
            self.check_codes(self.planes(noisy), self.frame(["digitize"], stdin=noisy))

    def test_codes_of_other_converters(self):
        noisy = self.run_program(["add-noise", "--seed", 8], self.uniform((0, 9000, 39900), "300x200"))
        for bits, bias, slope in [(12, 0, 0.1), (8, 3, 0.006), (16, 500, 1.5), (14, 20, 0.4)]:
            codes = self.frame(["digitize", "--bits", bits, "--bias", bias, "--slope", slope], stdin=noisy)
            self.check_codes(self.planes(noisy), codes, bias, slope, 2**bits - 1)

    def test_tiff_holds_the_same_codes(self):
        noisy = self.run_program(["add-noise", "--seed", 8], self.uniform((0, 9000, 39900), "50x40"))
        as_exr = self.frame(["digitize"], stdin=noisy)
        as_tiff = self.planes(self.run_program(["digitize", "--format", "tiff"], noisy), ".tif")
        self.same_planes(as_tiff, as_exr)


class Laws(Noise):
    SIZE = "213x117"

    def setUp(self):
        super().setUp()
        self.electrons = self.uniform((1000, 20000, 39000), self.SIZE)

    def test_threads_change_no_byte(self):
        noise = ["add-noise", "--seed", 7]
        one = self.run_program([*noise, "--threads", 1], self.electrons)
        self.assertEqual(one, self.run_program([*noise, "--threads", 2], self.electrons))
        self.assertEqual(one, self.run_program(noise, self.electrons))
        codes = self.run_program(["digitize", "--threads", 1], one)
        self.assertEqual(codes, self.run_program(["digitize", "--threads", 2], one))

    def test_mosaic_commutes(self):
        for pattern in ("rggb", "bggr", "grbg", "gbrg"):
            keep = ["mosaic", "--pattern", pattern]
            noise, convert = ["add-noise", "--seed", 7, "--frame", 2], ["digitize"]
            first = self.frame(keep, noise, convert, stdin=self.electrons)
            self.assertEqual(sorted(first), ["Y"])
            self.same_planes(self.frame(noise, keep, convert, stdin=self.electrons), first)
            self.same_planes(self.frame(noise, convert, keep, stdin=self.electrons), first)
            self.same_planes(
                self.frame(noise, keep, stdin=self.electrons), self.frame(keep, noise, stdin=self.electrons)
            )

    def test_mosaic_keeps_the_plane_of_each_site(self):
        planes = self.noisy(self.electrons, "--seed", 1)
        for pattern in ("rggb", "bggr", "grbg", "gbrg"):
            noisy = self.run_program(["add-noise", "--seed", 1], self.electrons)
            cfa = self.frame(["mosaic", "--pattern", pattern], stdin=noisy)
            np.testing.assert_array_equal(cfa["Y"], mosaic(planes, pattern))

    def test_rendering_one_plane_equals_rendering_and_mosaicking(self):
        for pattern in ("rggb", "gbrg"):
            direct = self.frame(
                ["render-radiance", "--electrons", "10,200,3000", "--size", "15x10", "--cfa", pattern]
            )
            expected = self.frame(
                ["render-radiance", "--electrons", "10,200,3000", "--size", "15x10"],
                ["mosaic", "--pattern", pattern],
            )
            self.same_planes(direct, expected)

    def test_frames_of_any_size_share_their_corner(self):
        small = self.noisy(self.uniform((1000, 20000, 39000), "20x10"), "--seed", 7)
        large = self.noisy(self.electrons, "--seed", 7)
        self.same_planes(small, {name: samples[:10, :20] for name, samples in large.items()})

    def test_commands_work_on_files_as_in_pipes(self):
        (self.directory / "electrons.exr").write_bytes(self.electrons)
        self.run_program(["add-noise", "electrons.exr", "--seed", 7, "-o", "noisy.exr"])
        self.run_program(["digitize", "noisy.exr", "-o", "codes.tif"])
        self.run_program(["mosaic", "codes.tif", "-o", "cfa.tif"])
        piped = self.frame(["add-noise", "--seed", 7], ["digitize"], ["mosaic"], stdin=self.electrons)
        self.same_planes(read_planes(self.directory / "cfa.tif"), piped)


class Reference(unittest.TestCase):
    """The formulas themselves, beside the numbers that the paper and MODEL state."""

    def test_dark_signal(self):
        self.assertAlmostEqual(dark_electrons(333, 1.0), 2218.6, places=1)
        self.assertAlmostEqual(dark_electrons(333), 73.21, places=2)

    def test_floor(self):
        self.assertAlmostEqual(moments(0, 333, read_noise=0)[1], 17.05, places=2)
        self.assertAlmostEqual(moments(0, 333)[1], 23.2, places=1)

    def test_variance_of_a_product(self):
        chance = np.random.default_rng(1)
        n = 1_000_000
        product = chance.poisson(50, n) * chance.normal(1, 0.2, n)
        self.assertLess(abs(product.var() / product_variance(50, 0.2) - 1), 5 * math.sqrt(2.2 / n))

    def test_masks_tile_the_frame(self):
        for pattern in ("rggb", "bggr", "grbg", "gbrg"):
            masks = class_masks(pattern, 6, 8)
            self.assertEqual([np.count_nonzero(masks[name]) for name in "RGB"], [12, 24, 12])
