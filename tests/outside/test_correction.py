"""`correct-frame` against NumPy and Astropy: averages, clipping, scaling by exposure and Eq. 6, flat fields, defects."""

import math
import shutil
import unittest

import numpy as np
from astropy.stats import sigma_clip

from programs import ProgramCase

SHAPE = (24, 36)


def eq6(kelvin):
    """T^1.5 exp(-Eg / 2kT) with Varshni's band gap and the 2019 Boltzmann constant in eV/K."""
    gap = 1.1557 - 7.021e-4 * kelvin**2 / (1108.0 + kelvin)
    return kelvin**1.5 * math.exp(-gap / (2 * 8.617333262e-5 * kelvin))


class Correction(ProgramCase):
    def setUp(self):
        super().setUp()
        self.chance = np.random.default_rng(11)

    def codes(self, name, mean, std, exposure=None, black=None, outliers=0):
        """Writes a frame of codes; gives them as doubles."""
        samples = self.chance.normal(mean, std, SHAPE).round().clip(0, 65535)
        places = self.chance.integers(0, samples.size, outliers)
        samples.flat[places] = 60000
        samples.astype("<u2").tofile(self.directory / name)
        lines = ["schema: cyanometer/1", "quantity: adu", "cfa: rggb"]
        if exposure:
            lines.append(f"exposure: {{exposure_s: {exposure}, f_number: 8.0, lens_transmittance: 1.0}}")
        if black is not None:
            lines.append(f"black_level_adu: {black}")
        (self.directory / f"{name}.yaml").write_text("\n".join(lines) + "\n")
        return samples

    def many(self, stem, count, *args, **kwargs):
        names = [f"{stem}{index}.raw" for index in range(count)]
        return names, np.stack([self.codes(name, *args, **kwargs) for name in names])

    def correct(self, *words):
        return self.frame(["correct-frame", "-q", "light.raw", "--raw", f"{SHAPE[1]}x{SHAPE[0]}:u16le", *words])

    def close(self, found, wanted):
        # Samples are single precision.
        np.testing.assert_allclose(found, wanted, rtol=3e-7, atol=1e-4)

    @staticmethod
    def options(name, files):
        return [word for file in files for word in (name, file)]

    def test_averages_of_darks(self):
        light = self.codes("light.raw", 3000, 50)
        for count in (1, 2, 5, 8, 14):
            names, darks = self.many("dark", count, 500, 12, outliers=9)
            words = self.options("--dark", names)
            self.close(self.correct(*words)["Y"], light - darks.mean(axis=0))
            self.close(self.correct(*words, "--combine", "median")["Y"], light - np.median(darks, axis=0))
            for kappa in (1.5, 3):
                # Nothing is clipped of fewer than three.
                clipped = sigma_clip(
                    darks, sigma=kappa, axis=0, maxiters=None, cenfunc="median", stdfunc=lambda x, axis: np.nanstd(x, axis=axis, ddof=1)
                ) if count > 2 else darks
                wanted = light - np.asarray(clipped.mean(axis=0))
                found = self.correct(*words, "--combine", "clipped", "--clip", kappa)["Y"]
                self.close(found, wanted)

    def test_darks_are_scaled_by_exposure(self):
        light = self.codes("light.raw", 3000, 50, exposure=0.4)
        short, at_short = self.many("short", 3, 520, 9, exposure=0.1)
        long, at_long = self.many("long", 2, 900, 9, exposure=2.0)
        bias, at_bias = self.many("bias", 4, 500, 5, exposure=1e-5)
        scale = ["--scale-dark"]
        [short_mean, long_mean, bias_mean] = [frames.mean(axis=0) for frames in (at_short, at_long, at_bias)]
        # Between the two doses.
        share = (0.4 - 0.1) / (2.0 - 0.1)
        found = self.correct(*self.options("--dark", short + long), *scale)["Y"]
        self.close(found, light - (1 - share) * short_mean - share * long_mean)
        # On the line through the bias.
        weight = (0.4 - 1e-5) / (2.0 - 1e-5)
        found = self.correct(*self.options("--dark", long), *self.options("--bias", bias), *scale)["Y"]
        self.close(found, light - weight * long_mean - (1 - weight) * bias_mean)
        # The bias alone.
        self.close(self.correct(*self.options("--bias", bias))["Y"], light - bias_mean)

    def test_darks_are_scaled_by_temperature(self):
        """Dark frames of 320 K and 1 s for a light frame of 330 K and 0.3 s, their bias known: weight by Eq. 6."""
        without = ["--without", "dcsn,dcnu,ssn,prnu,ron"]
        def frame(name, exposure, kelvin, light):
            self.run_pipe(
                ["render-radiance", "--size", "8x6", "--exposure", exposure, "--electrons", light],
                ["add-noise", "--temperature", kelvin, *without],
                ["digitize", "--bits", "16", "--bias", "300", "--slope", "1", "-o", name],
            )
        frame("light.exr", 0.3, 330, "5000,5000,5000")
        frame("dark.exr", 1, 320, "0,0,0")
        planes = self.frame(["correct-frame", "-q", "light.exr", "--dark", "dark.exr", "--scale-dark"])
        current = 2.5e15 * (6.8e-4) ** 2 * 0.068558
        light, dark = [round(300 + e) for e in (5000 + 0.3 * current * eq6(330), current * eq6(320))]
        weight = 0.3 * eq6(330) / eq6(320)
        wanted = light - weight * dark - (1 - weight) * 300
        for name in "RGB":
            self.close(planes[name], np.full((6, 8), wanted))

    def test_flat_fields(self):
        light = self.codes("light.raw", 3000, 50)
        darks, at_dark = self.many("dark", 2, 500, 8)
        flats, at_flat = self.many("flat", 3, 9000, 300)
        flat_darks, at_flat_dark = self.many("flatdark", 2, 510, 8)
        found = self.correct(
            *self.options("--dark", darks), *self.options("--flat", flats), *self.options("--flat-dark", flat_darks)
        )
        flat = at_flat.mean(axis=0) - at_flat_dark.mean(axis=0)
        rows, columns = np.indices(SHAPE)
        site = (rows % 2) * 2 + columns % 2
        wanted = light - at_dark.mean(axis=0)
        for sites in ([0], [1, 2], [3]):
            here = np.isin(site, sites)
            wanted[here] *= flat[here].mean() / flat[here]
        self.close(found["Y"], wanted)
        self.assertFalse(found["mask"].any())

    def test_sigma_behind_flats_of_another_exposure(self):
        """Camera frames, of which a sensor file alone tells the noise: flats exposed for eight times as long have eight times the dark
        signal, whose noise goes into every frame that they divide."""
        dark_e_per_s, read_e, gain, bias = 1500.0, 4.0, 0.5, 200.0
        shape, pattern = (240, 320), 1 + 0.2 * self.chance.normal(size=(240, 320))
        sensor = ["schema: cyanometer-sensor/2", "name: own", "readout:", "  width: 320", "  height: 240", "  pixel_pitch_um: 5"]
        sensor += ["  cfa: rggb", "  full_well_e: 100000", f"  dark_current_e_per_s: {dark_e_per_s}", "  temperature_k: 293"]
        sensor += ["  dcnu: 0.2", "  prnu: 0", f"  read_noise_e: {read_e}", "  bits: 16", f"  bias_adu: {bias}", f"  adu_per_e: {gain}"]
        (self.directory / "own.yaml").write_text("\n".join(sensor) + "\n")

        def expose(name, light_e, exposure):
            counts = self.chance.poisson(light_e + pattern * dark_e_per_s * exposure)
            codes = (bias + gain * (counts + self.chance.normal(0, read_e, shape))).round().astype("<u2")
            codes.tofile(self.directory / name)
            settings = f"exposure: {{exposure_s: {exposure}, f_number: 8.0, lens_transmittance: 1.0}}"
            lines = ["schema: cyanometer/1", "quantity: adu", "cfa: rggb", settings]
            (self.directory / f"{name}.yaml").write_text("\n".join(lines) + "\n")

        for name, light_e, exposure in (
            ("light.raw", 20000, 1),
            ("dark.raw", 0, 1),
            ("flat.raw", 8000, 8),
            ("flat-dark.raw", 0, 8),
            ("even.raw", 16000, 1),
            ("bias1.raw", 0, 1e-6),
            ("bias2.raw", 0, 1e-6),
        ):
            expose(name, light_e, exposure)
        # What bias frames or the converter's level leave of the dark signal is no light.
        biases = ["--bias", "bias1.raw", "--bias", "bias2.raw"]
        for words in (
            ["--dark", "dark.raw", "--flat", "flat.raw", "--flat-dark", "flat-dark.raw"],
            biases,
            ["--black", bias],
            [*biases, "--flat", "even.raw"],
            ["--black", bias, "--flat", "even.raw"],
        ):
            how = ["--raw", "320x240:u16le", "--sensor", "own.yaml", *words]
            self.run_program(["correct-frame", "-q", "light.raw", *how, "-o", "corrected.exr"])
            planes = self.frame(["demosaic", "-q", "corrected.exr", "--sigma", "--sensor", "own.yaml"])
            for name, site in (("R", np.s_[::2, ::2]), ("B", np.s_[1::2, 1::2])):
                there = planes[name][site]
                told = np.mean(planes[f"sigma.{name}"][site].astype(float) ** 2)
                # Five standard deviations of a variance of so many samples; the level of a pixel tells its noise to first order.
                with self.subTest(words=words, name=name):
                    self.assertAlmostEqual(there.var() / told, 1, delta=5 * math.sqrt(2 / there.size) + 0.02)

    def test_sigma_where_lines_come_off(self):
        """What masked photosites tell of a row, or a column, is gone from all of it: noise, offsets and drift of the black level."""
        shape, border, gain, bias, read_e, light_e = (1500, 120), 20, 0.5, 200.0, 40.0, 900.0
        sensor = ["schema: cyanometer-sensor/2", "name: own", "readout:", f"  width: {shape[1]}", f"  height: {shape[0]}"]
        sensor += ["  pixel_pitch_um: 5", "  cfa: rggb", "  full_well_e: 100000", "  dark_current_e_per_s: 0", "  temperature_k: 293"]
        sensor += ["  dcnu: 0", "  prnu: 0", f"  read_noise_e: {read_e}", "  bits: 16", f"  bias_adu: {bias}", f"  adu_per_e: {gain}"]
        rows = ["  row_noise_e: 30", "  dsnu_row_e: 40", "  black_drift_e: 50", "  black_drift_rows: 6"]
        columns = ["  column_noise_e: 25", "  dsnu_column_e: 35"]
        settings = "exposure: {exposure_s: 0.1, f_number: 8.0, lens_transmittance: 1.0}"
        for by, lines in (("rows", rows), ("columns", columns)):
            (self.directory / "own.yaml").write_text("\n".join(sensor + lines) + "\n")
            area = [0, 0, border, shape[0]] if by == "rows" else [0, 0, shape[1], border]
            lit = np.full(shape, light_e)
            lit[: area[3], : area[2]] = 0
            corrected = []
            for index in range(4):
                name = f"{by}{index}.raw"
                shared = self.chance.normal(0, 70, (shape[0], 1) if by == "rows" else (1, shape[1]))
                charge = self.chance.poisson(lit) + shared + self.chance.normal(0, read_e, shape)
                (bias + gain * charge).round().astype("<u2").tofile(self.directory / name)
                head = ["schema: cyanometer/1", "quantity: adu", "cfa: rggb", settings, f"masked_areas: [{area}]"]
                (self.directory / f"{name}.yaml").write_text("\n".join(head) + "\n")
                how = ["--raw", f"{shape[1]}x{shape[0]}:u16le", "--sensor", "own.yaml", "--black", by]
                corrected.append(f"{by}{index}.exr")
                self.run_program(["correct-frame", "-q", name, *how, "-o", corrected[-1]])
            # The level of each line has the noise of its own border, a tenth of the variance; and so has the average of all.
            self.run_program(["average-frames", "-q", *corrected, "-o", "all.exr"])
            for name in (corrected[0], "all.exr"):
                planes = self.frame(["demosaic", "-q", name, "--sigma", "--sensor", "own.yaml"])
                for plane, first in (("R", border), ("B", border + 1)):
                    site = np.s_[first + 4 :: 2, first + 4 :: 2]
                    there = planes[plane][site].astype(float)
                    told = np.mean(planes[f"sigma.{plane}"][site].astype(float) ** 2)
                    # What a line shares counts along it: its variance is as sure as its lines are many. Five standard deviations.
                    share, lines = (light_e + read_e**2, read_e**2 / border), min(there.shape)
                    spread = math.sqrt(2 / there.size + 2 / lines * (share[1] / sum(share)) ** 2)
                    with self.subTest(by=by, name=name, plane=plane):
                        self.assertAlmostEqual(there.var() / told, 1, delta=5 * spread + 0.01)

    def test_full_wells_are_known_where_lines_come_off(self):
        """A file that holds no marks tells by its white level what the charge of a full photosite reads, less the level of any row."""
        shape, border = (200, 120), 20
        sensor = ["schema: cyanometer-sensor/2", "name: own", "readout:", f"  width: {shape[1]}", f"  height: {shape[0]}"]
        sensor += ["  pixel_pitch_um: 5", "  cfa: rggb", "  full_well_e: 60000", "  dark_current_e_per_s: 0", "  temperature_k: 293"]
        sensor += ["  dcnu: 0", "  prnu: 0", "  read_noise_e: 10", "  row_noise_e: 200", "  bits: 16", "  bias_adu: 500", "  adu_per_e: 0.5"]
        (self.directory / "own.yaml").write_text("\n".join(sensor) + "\n")
        lit = np.full(shape, 50000.0)
        lit[:, 70:] = 90000
        lit[:, :border] = 0
        charge = np.minimum(self.chance.poisson(lit), 60000) + self.chance.normal(0, 200, (shape[0], 1))
        codes = (500 + 0.5 * (charge + self.chance.normal(0, 10, shape))).round()
        codes.astype("<u2").tofile(self.directory / "light.raw")
        head = ["schema: cyanometer/1", "quantity: adu", "cfa: rggb", f"masked_areas: [[0, 0, {border}, {shape[0]}]]"]
        (self.directory / "light.raw.yaml").write_text("\n".join(head) + "\n")
        how = ["--raw", f"{shape[1]}x{shape[0]}:u16le", "--sensor", "own.yaml", "--white", "65000", "--black", "rows"]
        self.run_program(["correct-frame", "-q", "light.raw", *how, "-o", "light.dng"])
        (self.directory / "light.dng.yaml").unlink(missing_ok=True)
        marks = self.frame(["demosaic", "-q", "light.dng"])["mask"].astype(int) & 1
        self.assertEqual((marks[:, 24:64].sum(), marks[:, 72:].sum()), (0, marks[:, 72:].size))

    def test_copies_are_refused(self):
        self.codes("light.raw", 3000, 50)
        self.many("dark", 3, 500, 12)
        self.codes("dull1.raw", 500, 0)
        self.codes("dull2.raw", 500, 0)
        for end in ("", ".yaml"):
            shutil.copy(self.directory / f"dark0.raw{end}", self.directory / f"copy.raw{end}")
        for words in (["--dark", "dark0.raw", "--dark", "dark1.raw", "--dark", "copy.raw"], ["--bias", "dark0.raw", "--bias", "copy.raw"]):
            failed = self.attempt(["correct-frame", "light.raw", "--raw", f"{SHAPE[1]}x{SHAPE[0]}:u16le", *words, "-o", "x.exr"])
            self.assertEqual(failed.returncode, 1)
            self.assertIn("copy.raw: its samples are those of dark0.raw, every one", failed.stderr.decode())
        # Frames of one value are alike without being copies, and dark frames of frame and flats may be the same.
        self.correct("--dark", "dull1.raw", "--dark", "dull2.raw")
        self.many("flat", 1, 9000, 300)
        self.correct("--dark", "dark0.raw", "--flat", "flat0.raw", "--flat-dark", "copy.raw")
        raw = ["--raw", f"{SHAPE[1]}x{SHAPE[0]}:u16le"]
        failed = self.attempt(["average-frames", "dark1.raw", "dark0.raw", "copy.raw", *raw, "-o", "x.exr"])
        self.assertIn("copy.raw: its samples are those of dark0.raw, every one", failed.stderr.decode())

    def test_defects(self):
        light = self.codes("light.raw", 3000, 50)
        self.codes("dark.raw", 500, 0)
        (self.directory / "map.txt").write_text("# column,row\n10,7\n0,0\n12,7\n")
        found = self.correct("--dark", "dark.raw", "--defects", "map.txt")
        wanted = light - 500.0
        # Column 12 is defective too, so that the column alone has a pair for 10, and for 12.
        for x in (10, 12):
            wanted[7, x] = (wanted[5, x] + wanted[9, x]) / 2
        # The corner has no pairs: those of its class within four photosites, by the inverse square of their distance.
        sites = [(y, x) for y in (0, 2, 4) for x in (0, 2, 4) if (y, x) != (0, 0)]
        weights = [1 / (y * y + x * x) for y, x in sites]
        wanted[0, 0] = sum(w * wanted[at] for w, at in zip(weights, sites)) / sum(weights)
        self.close(found["Y"], wanted)
        marks = np.zeros(SHAPE)
        marks[7, 10] = marks[7, 12] = marks[0, 0] = 2 + 4
        np.testing.assert_array_equal(found["mask"], marks)

    def test_defects_are_found(self):
        light = self.codes("light.raw", 3000, 50)
        darks, _ = self.many("dark", 9, 500, 6)
        for index, name in enumerate(darks):
            samples = np.fromfile(self.directory / name, "<u2").reshape(SHAPE)
            samples[4, 5] += 100
            samples[8, 9] += 60 * (index % 2)
            samples.tofile(self.directory / name)
        flat = self.codes("flat.raw", 9000, 100)
        flat[15, 20] = 3000
        flat.astype("<u2").tofile(self.directory / "flat.raw")
        found = self.correct(
            *self.options("--dark", darks), "--flat", "flat.raw", "--flat-dark", darks[0], "--find-defects"
        )
        places = {(int(y), int(x)) for y, x in zip(*np.nonzero(found["mask"]))}
        self.assertLessEqual({(4, 5), (8, 9), (15, 20)}, places)
        # Chance finds less than one in a frame on average; limits of 200 samples of a class are good to a tenth.
        self.assertLessEqual(len(places), 5)
        self.assertEqual(light.shape, found["Y"].shape)

    def test_quiet_codes_make_no_defects(self):
        """Noise below half a code about a mean between two codes, or at an end of them, marks nothing; a photosite that jumps is found."""
        jumps = np.zeros(SHAPE, bool)
        jumps[5, 7] = jumps[16, 30] = True
        for mean, std, steps in ((100.45, 0.4, 1), (100.5, 0.3, 16), (100.0, 0.35, 1), (0.0, 0.8, 1), (-0.4, 2.0, 1)):
            names = []
            offsets = mean + self.chance.normal(0, 0.1, SHAPE)
            for index in range(16):
                levels = offsets + self.chance.normal(0, std, SHAPE) + np.where(jumps, self.chance.choice([0, 12], SHAPE), 0)
                (levels.round().clip(0, 4000) * steps).astype("<u2").tofile(self.directory / f"dark{index}.raw")
                head = ["schema: cyanometer/1", "quantity: adu", "cfa: rggb"]
                (self.directory / f"dark{index}.raw.yaml").write_text("\n".join(head) + "\n")
                names.append(f"dark{index}.raw")
            self.codes("light.raw", 3000, 50)
            words = [*self.options("--dark", names), "--find-defects"]
            marks = self.correct(*words)["mask"].astype(int) != 0
            with self.subTest(mean=mean, std=std, steps=steps):
                self.assertTrue(marks[jumps].all())
                self.assertLessEqual(np.count_nonzero(marks & ~jumps), 1)

    def test_any_number_of_frames(self):
        light = self.codes("light.raw", 3000, 50)
        names, darks = self.many("dark", 2000, 500, 12)
        words = self.options("--dark", names)
        self.close(self.correct(*words)["Y"], light - darks.mean(axis=0))
        self.close(self.correct(*words, "--combine", "median")["Y"], light - np.median(darks, axis=0))


if __name__ == "__main__":
    unittest.main()
