"""Some raws of `scripts/conformance`, and what LibRaw, dcraw and exiftool make of them; what is not installed is skipped."""

import unittest

import numpy as np

from conformance import build, compare, converters, tags
from programs import BINARIES, ProgramCase

CHARTS = ["chart-grbg", "chart-odd", "chart-white", "chart-masked", "chart-12", "ramp-full", "sky-14"]
LEVELS = ["chart-sites", "chart-fraction", "chart-masked-odd"]
NOISY = ["chart-noisy", "ramp-12-noisy", "ramp-14-noisy", "ramp-16-noisy"]


class Conformance(ProgramCase):
    """The set, its truth, and who finds it."""

    def make(self, *names):
        """Makes files; gives them with what is in them and where they lie."""
        files = [file for file in build.FILES if file.name in names]
        self.assertEqual(len(files), len(names))
        made = build.make_all(self.directory, self.run_program, files)
        return [(file, made[file.name], self.directory / f"{file.name}.dng") for file in files]

    def installed(self, converter):
        if converter.version() is None:
            self.skipTest(f"{converter.name} is not installed")
        return converter

    def test_tags_samples_and_digest_are_those_of_the_truth(self):
        for file, truth, path in self.make(*CHARTS, *LEVELS, *NOISY):
            with self.subTest(file.name):
                self.assertEqual(compare.wrong_tags(path, build.expected_tags(file, truth)), [])
                # LibRaw counts the black levels of an area that begins at an odd site from another.
                expected = [] if file.name != "chart-masked-odd" else ["black of other sites"]
                found = compare.libraw_differences(truth, path)
                self.assertEqual([text[: len("black of other sites")] for text in found], expected)

    def test_codes_are_the_scene_to_their_rounding(self):
        for file in build.FILES:
            truth = build.Truth(file)
            inside = ~truth.clipped.any(1)
            # Codes lie half an ADU off at most, and those with fractions of black a whole one.
            steps = np.abs(truth.xyz_from_signal).sum(1) * (1 if any(np.mod(file.sites, 1)) else 0.5) / file.range_adu
            off = np.abs(truth.coded_xyz() - truth.relative_xyz)[inside]
            self.assertTrue((off <= steps * (1 + 1e-9)).all(), file.name)

    def test_ours_find_the_truth(self):
        for file, truth, path in self.make(*CHARTS, *LEVELS, *NOISY):
            for converter in (converters.Ours(BINARIES), converters.OursByTags(BINARIES)):
                with self.subTest(file=file.name, converter=converter.name):
                    found = compare.compare(converter, truth, path)
                    self.assertEqual(found.problem, "")
                    # Ratios of 32 bits and single precision. In `LEVELS` a range of each class's own would be off by 2e-3.
                    self.assertLess(found.deviation, 1e-5)
                    self.assertLess(found.dark_error, 1e-6)

    def test_libraw_finds_it(self):
        """LibRaw drops fractions of 65535 codes at each step, up to three of 655 in the darkest patches that count."""
        converter = converters.LibRaw()
        for file, truth, path in self.make(*CHARTS, *NOISY):
            with self.subTest(file.name):
                found = compare.compare(converter, truth, path)
                self.assertEqual(found.problem, "")
                self.assertLess(found.deviation, 3 / 655)

    def test_dcraw_finds_it(self):
        converter = self.installed(converters.Dcraw())
        for file, truth, path in self.make("chart-grbg", "chart-sites", "chart-masked-odd", "ramp-14-noisy"):
            with self.subTest(file.name):
                found = compare.compare(converter, truth, path)
                self.assertTrue(found.is_right, found)

    def test_exiftool_has_nothing_to_complain_of(self):
        paths = [path for _, _, path in self.make("chart-grbg", "chart-masked-odd", "chart-noisy")]
        warnings = compare.exiftool_warnings(paths)
        if warnings is None:
            self.skipTest("exiftool is not installed")
        self.assertEqual(warnings, [])

    def test_the_noise_profile_is_the_noise_that_is_there(self):
        noises = {file.name: compare.noise(truth, path) for file, truth, path in self.make(*NOISY)}
        for low, high, ratio, error, _ in compare.pooled(noises):
            with self.subTest(low=low, high=high):
                self.assertLess(error, 0.05 / 3)
                self.assertLess(abs(ratio - 1), min(0.05, 4 * error))

    def test_floats_have_a_digest_too(self):
        ((_, _, path),) = self.make("chart-noisy")
        self.run_program(["correct-frame", path, "--black", "auto", "-q", "-o", "floats.dng"])
        found = tags.Tags(self.directory / "floats.dng")
        samples = found.samples("<f4")
        self.assertEqual(compare.digest(samples), bytes(found.value(tags.DIGEST)))

    def test_what_is_wrong_is_seen(self):
        """A white level 2 % off, samples changed, and a neutral of another light."""
        ((file, truth, path),) = self.make("chart-grbg")
        expected = build.expected_tags(file, truth)
        converter = converters.OursByTags(BINARIES)
        white = int(file.white_level * 0.98)
        for tag, values, name in ((tags.WHITE_LEVEL, [white], "WhiteLevel"), (tags.NEUTRAL, [1] * 6, "AsShotNeutral")):
            changed = tags.Tags(path)
            changed.put(tag, values)
            changed.write(self.directory / "changed.dng")
            self.assertIn(name, compare.wrong_tags(self.directory / "changed.dng", expected)[0])
        changed = tags.Tags(path)
        changed.put(tags.WHITE_LEVEL, [white])
        changed.write(self.directory / "changed.dng")
        self.assertFalse(compare.compare(converter, truth, self.directory / "changed.dng").is_right)
        changed = tags.Tags(path)
        changed.samples()[3, 100] ^= 1
        changed.write(self.directory / "changed.dng")
        self.assertEqual(compare.wrong_tags(self.directory / "changed.dng", expected), ["NewRawImageDigest is that of other samples"])


if __name__ == "__main__":
    unittest.main()
