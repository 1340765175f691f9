"""Demosaicking beside an independent implementation of Appendix A of [HP2005]."""

import unittest

import numpy as np

from programs import CLASSES, ProgramCase, class_masks, mosaic, read_planes, write_planes

# Relative to the larger of the value and 1 ADU; single precision with a few roundings stays far below.
TOLERANCE = 1e-5

SIZES = [(2, 2), (3, 2), (2, 3), (3, 3), (4, 4), (5, 8), (2, 17), (19, 2), (16, 16), (37, 23)]


def neighborhoods(plane):
    """The nine neighbors of each photosite, mirrored without repeating the edge: shape (9, height, width)."""
    height, width = plane.shape
    padded = np.pad(plane, 1, mode="reflect")
    return np.stack([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)])


def neighbor_mean(plane, mask):
    """The mean of those of the nine neighbors where the mask holds. On a Bayer array they are the two, four or four
    diagonal neighbors that Appendix A names."""
    near = neighborhoods(mask.astype(float))
    return np.sum(neighborhoods(np.where(mask, plane, 0.0)) * near, axis=0) / np.maximum(near.sum(axis=0), 1)


def bilinear(cfa, masks):
    return {name: np.where(masks[name], cfa, neighbor_mean(cfa, masks[name])) for name in "RGB"}


def smooth_hue(cfa, masks):
    green = bilinear(cfa, masks)["G"]
    result = {"G": green}
    for name in "RB":
        ratio = cfa / green
        result[name] = np.where(masks[name], cfa, green * neighbor_mean(ratio, masks[name]))
    return result


def effective_color(cfa, masks):
    green = cfa.copy()
    for name in "RB":
        # K_R = G - (R + R)/2 at green sites; the printed minus between the two is a misprint.
        k = cfa - neighbor_mean(cfa, masks[name])
        green = np.where(masks[name], cfa + neighbor_mean(k, masks["G"]), green)
    result = {"G": green}
    for name in "RB":
        k = green - cfa
        result[name] = np.where(masks[name], cfa, green - neighbor_mean(k, masks[name]))
    return result


# Eighths of Malvar, He and Cutler's filters (ICASSP 2004, Fig. 2): green at red or blue; red (blue) at green with red
# (blue) beside it, and above and below it; red at blue, blue at red.
MALVAR_GREEN = [[0, 0, -1, 0, 0], [0, 0, 2, 0, 0], [-1, 2, 4, 2, -1], [0, 0, 2, 0, 0], [0, 0, -1, 0, 0]]
MALVAR_BESIDE = [[0, 0, 0.5, 0, 0], [0, -1, 0, -1, 0], [-1, 4, 5, 4, -1], [0, -1, 0, -1, 0], [0, 0, 0.5, 0, 0]]
MALVAR_OPPOSITE = [[0, 0, -1.5, 0, 0], [0, 2, 0, 2, 0], [-1.5, 0, 6, 0, -1.5], [0, 2, 0, 2, 0], [0, 0, -1.5, 0, 0]]


def filtered(plane, eighths):
    height, width = plane.shape
    rows = [mirror(y, height) for y in range(-2, height + 2)]
    columns = [mirror(x, width) for x in range(-2, width + 2)]
    padded = plane[np.ix_(rows, columns)]
    weights = np.asarray(eighths) / 8
    return sum(
        weights[y, x] * padded[y : y + height, x : x + width] for y in range(5) for x in range(5) if weights[y, x]
    )


def mirror(index, length):
    """...2 1 | 0 1 2...: the edge is not repeated."""
    index = abs(index) % (2 * (length - 1))
    return min(index, 2 * (length - 1) - index)


def malvar(cfa, masks):
    beside, above = filtered(cfa, MALVAR_BESIDE), filtered(cfa, np.transpose(MALVAR_BESIDE))
    opposite = filtered(cfa, MALVAR_OPPOSITE)
    result = {"G": np.where(masks["G"], cfa, filtered(cfa, MALVAR_GREEN))}
    for name in "RB":
        has_beside = masks["G"] & masks[name].any(axis=1, keepdims=True)
        at_green = np.where(has_beside, beside, above)
        result[name] = np.where(masks[name], cfa, np.where(masks["G"], at_green, opposite))
    return result


METHODS = {"bi": bilinear, "shti": smooth_hue, "eci": effective_color, "mhc": malvar}


class Demosaic(ProgramCase):
    def setUp(self):
        super().setUp()
        self.chance = np.random.default_rng(2005)

    def compare(self, actual, expected, what):
        self.assertEqual(sorted(actual), ["B", "G", "R"], what)
        for name in "RGB":
            self.assertEqual(actual[name].shape, expected[name].shape, what)
            error = np.abs(actual[name] - expected[name]) / np.maximum(np.abs(expected[name]), 1)
            worst = np.unravel_index(np.argmax(error), error.shape)
            self.assertLessEqual(
                error[worst],
                TOLERANCE,
                f"{what}: channel {name} at row {worst[0]}, column {worst[1]}: "
                f"{actual[name][worst]} for {expected[name][worst]}",
            )

    def demosaic(self, codes, pattern, method, black):
        write_planes(self.path("cfa.tif"), {"Y": codes}, "u16")
        return self.frame(
            ["demosaic", "cfa.tif", "--pattern", pattern, "--method", method, "--black", black]
        )

    def check(self, method, black, low, high, sizes=SIZES):
        for width, height in sizes:
            for pattern in CLASSES:
                codes = self.chance.integers(low, high, (height, width)).astype(np.uint16)
                masks = class_masks(pattern, height, width)
                subtracted = codes.astype(np.float64) - (0 if black == "none" else black)
                self.compare(
                    self.demosaic(codes, pattern, method, black),
                    METHODS[method](subtracted, masks),
                    f"{method}, {pattern}, {width}x{height}, black {black}",
                )

    def test_bilinear(self):
        self.check("bi", 100, 0, 4096)

    def test_smooth_hue(self):
        self.check("shti", 100, 500, 4096)

    def test_effective_color(self):
        self.check("eci", 100, 0, 4096)

    def test_malvar(self):
        self.check("mhc", 100, 0, 4096)

    def test_signed_values_are_kept(self):
        self.check("bi", 1753, 1700, 1800, [(8, 6)])
        self.check("eci", 1753, 1700, 1800, [(8, 6)])

    def test_no_black_level(self):
        for method in METHODS:
            self.check(method, "none", 500, 65536, [(7, 6)])

    def test_long_names(self):
        codes = self.chance.integers(500, 4096, (6, 9)).astype(np.uint16)
        for long, short in [("bilinear", "bi"), ("smooth-hue", "shti"), ("effective-color", "eci")]:
            self.same_planes(
                self.demosaic(codes, "grbg", long, 100), self.demosaic(codes, "grbg", short, 100)
            )

    def test_smooth_hue_never_gives_infinity(self):
        for low, high, black in [(0, 3, "none"), (0, 1, "none"), (90, 110, 100), (100, 101, 100)]:
            codes = self.chance.integers(low, high, (12, 14)).astype(np.uint16)
            for name, samples in self.demosaic(codes, "rggb", "shti", black).items():
                self.assertTrue(np.all(np.isfinite(samples)), f"channel {name}, black {black}")

    def test_measured_sites_stay(self):
        codes = self.chance.integers(500, 4096, (10, 13)).astype(np.uint16)
        for method in METHODS:
            planes = self.demosaic(codes, "gbrg", method, 100)
            np.testing.assert_array_equal(mosaic(planes, "gbrg"), codes - 100.0)

    def test_own_frames_carry_pattern_and_black_level(self):
        # The pattern comes from the metadata, and so does the black level: bias and mean dark signal.
        for pattern in CLASSES:
            self.run_pipe(
                ["render-radiance", "--electrons", "9000,15000,12000", "--size", "21x14"],
                ["add-noise", "--seed", "3"],
                ["digitize"],
                ["mosaic", "--pattern", pattern, "-o", f"{pattern}.exr"],
            )
            cfa = read_planes(self.directory / f"{pattern}.exr")["Y"].astype(np.float64)
            masks = class_masks(pattern, 14, 21)
            for method in METHODS:
                none = self.frame(["demosaic", f"{pattern}.exr", "--method", method, "--black", "none"])
                self.compare(none, METHODS[method](cfa, masks), f"{method}, {pattern}, none")
                auto = self.frame(["demosaic", f"{pattern}.exr", "--method", method])
                difference = cfa - mosaic(auto, pattern).astype(np.float64)
                self.assertLess(np.ptp(difference), 2e-3, "the automatic black level is not one number")
                black = float(np.mean(difference))
                # Bias, and 73.21 electrons of dark signal at 0.058824 ADU each.
                self.assertAlmostEqual(black, 1753 + 73.21 * 0.058824, delta=0.005)
                self.compare(auto, METHODS[method](cfa - black, masks), f"{method}, {pattern}, auto")

    def test_threads_and_height_do_not_matter(self):
        codes = self.chance.integers(500, 4096, (211, 64)).astype(np.uint16)
        write_planes(self.path("cfa.tif"), {"Y": codes}, "u16")
        common = ["demosaic", "cfa.tif", "--pattern", "rggb", "--method", "eci", "--black", "100"]
        one = self.run_program([*common, "--threads", "1"])
        two = self.run_program([*common, "--threads", "2"])
        self.assertEqual(one, two)


class Reference(unittest.TestCase):
    """The reference itself, on cases worked out by hand."""

    def setUp(self):
        # [HP2005, Fig. 9] counts rows and columns from 1 and has blue at (4,3), red at (3,4).
        self.pattern = next(
            name for name, sites in CLASSES.items() if sites[1][0] == "B" and sites[0][1] == "R"
        )
        self.cfa = np.random.default_rng(9).uniform(100, 1000, (8, 8))
        self.masks = class_masks(self.pattern, 8, 8)

    def at(self, row, column, plane=None):
        return (self.cfa if plane is None else plane)[row - 1, column - 1]

    def test_bilinear_example(self):
        result = bilinear(self.cfa, self.masks)
        at = self.at
        self.assertAlmostEqual(at(4, 3, result["G"]), (at(3, 3) + at(4, 4) + at(5, 3) + at(4, 2)) / 4)
        self.assertAlmostEqual(at(4, 3, result["R"]), (at(3, 2) + at(3, 4) + at(5, 4) + at(5, 2)) / 4)

    def test_smooth_hue_example(self):
        result = smooth_hue(self.cfa, self.masks)
        at, g, b = self.at, result["G"], result["B"]
        self.assertAlmostEqual(
            at(4, 4, b), at(4, 4, g) * (at(4, 3) / at(4, 3, g) + at(4, 5) / at(4, 5, g)) / 2
        )
        diagonal = [(2, 3), (2, 5), (4, 5), (4, 3)]
        self.assertAlmostEqual(
            at(3, 4, b), at(3, 4, g) * sum(at(y, x) / at(y, x, g) for y, x in diagonal) / 4
        )

    def test_effective_color_example(self):
        result = effective_color(self.cfa, self.masks)
        at, g = self.at, result["G"]
        k24 = at(2, 4) - (at(1, 4) + at(3, 4)) / 2
        k44 = at(4, 4) - (at(3, 4) + at(5, 4)) / 2
        k33 = at(3, 3) - (at(3, 2) + at(3, 4)) / 2
        k35 = at(3, 5) - (at(3, 4) + at(3, 6)) / 2
        self.assertAlmostEqual(at(3, 4, g), at(3, 4) + (k24 + k35 + k44 + k33) / 4)
        self.assertAlmostEqual(
            at(4, 4, result["R"]),
            at(4, 4) - ((at(3, 4, g) - at(3, 4)) + (at(5, 4, g) - at(5, 4))) / 2,
        )
        diagonal = [(4, 5), (6, 5), (6, 3), (4, 3)]
        self.assertAlmostEqual(
            at(5, 4, result["B"]), at(5, 4, g) - sum(at(y, x, g) - at(y, x) for y, x in diagonal) / 4
        )

    def test_flat_stays_flat(self):
        for pattern in CLASSES:
            for width, height in SIZES:
                masks = class_masks(pattern, height, width)
                flat = {"R": 300.0, "G": 500.0, "B": 700.0}
                cfa = np.select([masks[k] for k in "RGB"], [flat[k] for k in "RGB"])
                for method in METHODS.values():
                    for name, plane in method(cfa, masks).items():
                        np.testing.assert_allclose(plane, flat[name], rtol=1e-14)

    def test_ramps_are_kept_away_from_the_edges(self):
        y, x = np.mgrid[0:12, 0:12].astype(float)
        ramp = 100 + 3 * x - 2 * y
        masks = class_masks("rggb", 12, 12)
        for method in (bilinear, effective_color):
            for plane in method(ramp, masks).values():
                np.testing.assert_allclose(plane[3:-3, 3:-3], ramp[3:-3, 3:-3], rtol=1e-13)

    def test_mirrored_edge_of_the_smallest_frame(self):
        # Beyond a 2x2 frame lies its own other half: every photosite sees the two greens, the red and the blue.
        cfa = np.array([[10.0, 20.0], [40.0, 80.0]])
        result = bilinear(cfa, class_masks("rggb", 2, 2))
        np.testing.assert_allclose(result["G"], [[30, 20], [40, 30]])
        np.testing.assert_allclose(result["R"], 10)
        np.testing.assert_allclose(result["B"], 80)
