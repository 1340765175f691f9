"""photon-transfer beside published figures and beside numpy: the EMVA 1288 reference set, and cameras of our own."""

import json
import pathlib
import subprocess
import tempfile
import unittest

import numpy
from PIL import Image

from programs import BINARIES, ROOT

DATA = ROOT.parent / "shared/data/emva1288_ccd12"
# Published for the set by the makers of the standard, of an older release (its documentation): each lies within our interval.
PUBLISHED = {
    "gain_adu_per_e": 0.280769,
    "quantum_efficiency": 0.45136,
    "dark_noise_e": 10.898,
    "saturation_e": 13972.6,
    "snr_max": 118.2,
    "linearity_error_min": -0.00616,
    "linearity_error_max": 0.00480,
    "dsnu_e": 0.5518,
    "prnu": 0.004327,
}
# The reference code of release 4.0, emva1288 1.0.2, gives these.
REFERENCE_CODE = {
    "gain_adu_per_e": 0.2800626,
    "quantum_efficiency": 0.4524949,
    "saturation_e": 14007.9,
    "dsnu_e": 0.5531880,
    "dsnu_column_e": 0.5405599,
    "prnu": 0.004327052,
    "prnu_row": 0.003232732,
    "prnu_column": 0.001113304,
    "prnu_pixel": 0.002652052,
    "linearity_error_min": -0.006157976,
    "linearity_error_max": 0.004804483,
}


def stack(paths):
    return numpy.stack([numpy.asarray(Image.open(path)).astype(float) for path in paths])


def conditions(text):
    """The descriptor's conditions: kind, exposure in ns, photons, files."""
    found = []
    for line in text.splitlines():
        words = line.split()
        if not words or words[0] not in "bdi":
            continue
        if words[0] == "i":
            found[-1][3].append(DATA / words[1].replace("\\", "/"))
        else:
            found.append((words[0], float(words[1]), float(words[2]) if words[0] == "b" else 0.0, []))
    return found


@unittest.skipUnless(DATA.is_dir(), f"{DATA} is absent: the EMVA 1288 reference set is not measured")
class ReferenceSet(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        command = [BINARIES / "photon-transfer", DATA / "EMVA1288_Data.txt", "--output-format", "json"]
        told = subprocess.run(command, check=True, capture_output=True, timeout=300)
        [cls.channel] = json.loads(told.stdout)["channels"]
        cls.conditions = conditions((DATA / "EMVA1288_Data.txt").read_text())

    def test_published_figures_lie_within_their_intervals(self):
        for figures in [PUBLISHED, REFERENCE_CODE]:
            for key, published in figures.items():
                with self.subTest(key=key):
                    interval = self.channel[key]
                    self.assertLessEqual(interval["low"], published)
                    self.assertGreaterEqual(interval["high"], published)

    def test_the_releases_differ_by_the_drift_within_pairs(self):
        """Equal weights up to 70 % of saturation give the published K with the drift in the variances, and the code's without."""
        pairs = {(kind, exposure): files for kind, exposure, _, files in self.conditions if len(files) == 2}
        times = sorted(exposure for kind, exposure in pairs if kind == "b")
        for takes_drift_out, expected in [(0, PUBLISHED), (1, REFERENCE_CODE)]:
            def level(kind, time):
                first, second = stack(pairs[kind, time])
                drift = (first.mean() - second.mean()) ** 2 / 2
                variance = ((first - second) ** 2).mean() / 2 - takes_drift_out * drift
                return numpy.array([(first.mean() + second.mean()) / 2, variance])

            signal, noise = numpy.array([level("b", time) - level("d", time) for time in times]).T
            fitted = signal <= 0.7 * signal[noise.argmax()]
            gain = (signal * noise)[fitted].sum() / (signal ** 2)[fitted].sum()
            self.assertAlmostEqual(gain / expected["gain_adu_per_e"], 1, delta=1e-5)

    def test_means_and_variances_are_those_of_numpy(self):
        by_photons = {point["photons"]: point for point in self.channel["curve"]}
        darks = {exposure: files for kind, exposure, _, files in self.conditions if kind == "d"}
        for kind, exposure, photons, files in self.conditions[10:40:10]:
            self.assertEqual(kind, "b")
            flats, dark = stack(files), stack(darks[exposure])
            # A pair's temporal variance: half that of the difference, its mean and what goes with the mean taken out.
            variance = []
            for pair in flats, dark:
                difference, mean = pair[0] - pair[1], pair.mean(axis=0)
                difference -= difference.mean()
                mean -= mean.mean()
                difference -= (difference * mean).sum() / (mean * mean).sum() * mean
                variance.append((difference ** 2).sum() / 2 / (difference.size - 2))
            point = by_photons[photons]
            self.assertAlmostEqual(point["signal_adu"], flats.mean() - dark.mean(), delta=1e-8)
            self.assertAlmostEqual(point["variance_adu2"] / (variance[0] - variance[1]), 1, delta=1e-9)

    def test_patterns_are_those_of_an_analysis_of_variance(self):
        [flat] = [files for kind, _, _, files in self.conditions if kind == "b" and len(files) > 2]
        [dark] = [files for kind, _, _, files in self.conditions if kind == "d" and len(files) > 2]
        parts = []
        for frames in stack(flat), stack(dark):
            mean = frames.mean(axis=0)
            # Temporal noise apart from the drift of whole frames, and of frames in proportion to the mean.
            rest = frames - mean
            rest -= rest.mean(axis=(1, 2), keepdims=True)
            uneven = mean - mean.mean()
            rest -= (rest * uneven).sum(axis=(1, 2), keepdims=True) / (uneven ** 2).sum() * uneven
            spatial, temporal = squares(mean[None], 1), squares(rest, len(frames) - 1)
            parts.append((spatial, temporal, len(frames), mean.mean()))
        rows, columns = mean.shape
        def part(name, index):
            spatial, temporal, count, _ = parts[index]
            of = {"pixel": lambda ms: ms[2], "row": lambda ms: (ms[0] - ms[2]) / columns, "column": lambda ms: (ms[1] - ms[2]) / rows}
            return of[name](spatial) - of[name](temporal) / count
        signal = parts[0][3] - parts[1][3]
        for name in "row", "column", "pixel":
            expected = numpy.sqrt(part(name, 0) - part(name, 1)) / signal
            # The signal is that above the pair of darks of the same exposure.
            self.assertAlmostEqual(self.channel[f"prnu_{name}"]["value"] / expected, 1, delta=1e-3)
        gain = self.channel["gain_adu_per_e"]["value"]
        self.assertAlmostEqual(self.channel["dsnu_column_e"]["value"] / (numpy.sqrt(part("column", 1)) / gain), 1, delta=1e-6)


class Drawn:
    """A monochrome camera of 12 bits as numpy draws it: K 0.3, black 100.25 ADU, full well 12000 e- where nothing else is given. From frame to
    frame its black level jitters, and the light flickers, by standard deviations."""

    GAIN, BLACK, FULL_WELL, EFFICIENCY, PRNU, SIZE = 0.3, 100.25, 12000.0, 0.5, 0.01, (96, 128)
    SHARES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.4, 1.8)

    def __init__(self, seed, read_e=6.0, dark_e_per_s=500.0, dcnu=0.1, hot_share=0.0, hot_e_per_s=0.0, held=(), dsnu_e=1.0, flicker=0.0, jitter_adu=0.0, **other):
        self.random = numpy.random.default_rng(seed)
        vars(self).update({name.upper(): value for name, value in other.items()})
        self.flicker, self.jitter_adu = flicker, jitter_adu
        draw = lambda std: std * self.random.standard_normal(self.SIZE)
        self.response, self.offset = 1 + draw(self.PRNU), draw(dsnu_e)
        self.rate = dark_e_per_s * (1 + draw(dcnu)).clip(0)
        self.rate += (self.random.random(self.SIZE) < hot_share) * self.random.exponential(max(hot_e_per_s, 1e-9), self.SIZE)
        self.read_e, self.held = read_e, held

    def frame(self, light_e, time_s):
        light_e *= 1 + self.flicker * self.random.standard_normal()
        charge = numpy.minimum(self.random.poisson(light_e * self.response + self.rate * time_s), self.FULL_WELL)
        noisy = charge + self.offset + self.read_e * self.random.standard_normal(self.SIZE)
        black = self.BLACK + self.jitter_adu * self.random.standard_normal()
        codes = numpy.rint(self.GAIN * noisy + black).clip(0, 4095).astype(numpy.uint16)
        for (y, x), code in self.held:
            codes[y, x] = code
        return codes

    def frames(self, flat_s, darks_s, stack=8, shares=SHARES):
        """Kind, light in e-, time and codes of each; flats are as long as they are bright where they have no time of their own."""
        found = []
        for share in shares:
            time_s = flat_s or 0.02 * share
            found += [("flat", share * self.FULL_WELL, time_s, self.frame(share * self.FULL_WELL, time_s)) for _ in range(stack if share == 0.5 else 2)]
        for index, time_s in enumerate(darks_s):
            found += [("dark", 0.0, time_s, self.frame(0.0, time_s)) for _ in range(2 if index else stack)]
        return found

    def told(self, frames, options=("--white", "4095"), is_timed=True, photons=lambda light_e: light_e, sensor=None):
        """What the program says of such frames: its channel, none where it refuses them, and its warnings."""
        with tempfile.TemporaryDirectory() as folder:
            folder, rows = pathlib.Path(folder), ["File,Kind,photons" + (",EXPOSURE_S" if is_timed else "")]
            for number, (kind, light_e, time_s, codes) in enumerate(frames):
                Image.fromarray(codes).save(folder / f"{number}.png", compress_level=1)
                counted = photons(light_e) / self.EFFICIENCY if kind == "flat" else ""
                rows.append(f"{number}.png,{kind},{counted}" + (f",{time_s}" if is_timed else ""))
            (folder / "list.csv").write_text("\n".join(rows) + "\n")
            command = [BINARIES / "photon-transfer", folder / "list.csv", *options, "--cfa", "monochrome", "--output-format", "json"]
            command += ["--sensor-out", sensor] if sensor else []
            told = subprocess.run(command, capture_output=True, timeout=300, text=True)
        channel = json.loads(told.stdout)["channels"][0] if told.returncode == 0 else None
        return channel, told.stderr

    def measured(self, flat_s, darks_s, **how):
        """What the program finds, and what it says."""
        channel, said = self.told(self.frames(flat_s, darks_s), **how)
        if channel is None:
            raise AssertionError(said)
        return channel, said


class DrawnCameras(unittest.TestCase):
    """Cameras whose numbers are known: each lies within its interval, of so many draws but for as many as chance takes."""

    DARKS_S = (0.02, 0.1, 0.25, 0.5, 1.0)

    def outside(self, channel, truths):
        return sum(not channel[key]["low"] <= truth <= channel[key]["high"] for key, truth in truths.items())

    def test_full_well_is_that_of_all_charge(self):
        outside = 0
        for seed in range(8):
            times = [0.02 * share for share in Drawn.SHARES]
            channel, said = Drawn(seed, dark_e_per_s=25000.0).measured(None, times)
            self.assertNotIn("exchanged", said)
            outside += self.outside(channel, {"full_well_e": Drawn.FULL_WELL})
        self.assertLessEqual(outside, 3)

    def test_quiet_darks_tell_no_more_than_rounding_leaves(self):
        for read_adu in 0.1, 0.2, 0.4, 0.5:
            outside = 0
            for seed in range(8):
                camera = Drawn(seed, read_e=read_adu / Drawn.GAIN, dark_e_per_s=10.0)
                channel, said = camera.measured(0.02, self.DARKS_S)
                for untrue in "black level moves", "response bends":
                    self.assertNotIn(untrue, said)
                truths = {"black_level_adu": Drawn.BLACK + Drawn.GAIN * camera.offset.mean(), "dark_current_e_per_s": camera.rate.mean()}
                outside += self.outside(channel, truths)
            self.assertLessEqual(outside, 3, read_adu)

    def test_full_hot_photosites_do_not_lower_the_dark_current(self):
        outside = 0
        share, hot, dark = 0.01, 12000.0, 500.0
        current = dark + share * hot
        spread = ((0.1 * dark) ** 2 + share * (2 - share) * hot ** 2) ** 0.5
        for seed in range(8):
            camera = Drawn(seed, hot_share=share, hot_e_per_s=hot)
            channel, _ = camera.measured(0.02, (0.005, 0.01) + self.DARKS_S)
            outside += self.outside(channel, {"dark_current_e_per_s": current, "dcnu": spread / current})
        self.assertLessEqual(outside, 4)

    def test_photosites_that_hold_one_value_are_left_out(self):
        held = [((40, 50), 4095), ((41, 50), 1500), ((60, 20), 0)]
        for seed in range(3):
            channel, _ = Drawn(seed, held=held).measured(0.02, self.DARKS_S)
            sites = [((site["y"], site["x"]), site["light_adu"]) for site in channel["defects"]["stuck"]["sites"]]
            self.assertEqual(sites, held)
            self.assertLessEqual(channel["defects"]["light"]["count"], 1)
            for key, truth in ("prnu", Drawn.PRNU), ("dcnu", 0.1), ("gain_adu_per_e", Drawn.GAIN):
                self.assertLess(abs(channel[key]["value"] / truth - 1), 0.05, key)


    def test_dark_noise_of_silent_darks_has_no_dark_charge_in_it(self):
        """Of 51 e- of dark charge in the flats, and darks whose noise rounding hides, the noise is that of no time; of one time that is said."""
        outside = {"dark_noise_e": 0, "gain_adu_per_e": 0}
        for seed in range(20):
            camera = Drawn(seed, read_e=1.83, dark_e_per_s=102.0, dcnu=0.0, gain=0.05, full_well=60_000.0)
            camera.DARKS_S = (0.05, 0.1, 0.25, 0.5)
            channel, said = camera.measured(0.5, camera.DARKS_S)
            self.assertNotIn("shot noise of the dark charge included", said)
            for key, truth in ("dark_noise_e", 1.83), ("gain_adu_per_e", 0.05):
                outside[key] += self.outside(channel, {key: truth})
        self.assertLessEqual(max(outside.values()), 5, outside)
        channel, said = camera.measured(0.5, [0.5])
        self.assertIn("is that of 0.5 s, shot noise of the dark charge included", str(channel["notes"]))
        self.assertEqual(self.outside(channel, {"dark_noise_e": (1.83 ** 2 + 51) ** 0.5}), 0)

    def test_electrons_of_one_code_smooth_nothing(self):
        keys = "dark_noise_e", "black_level_adu", "dark_current_e_per_s", "gain_adu_per_e"
        outside = dict.fromkeys(keys, 0)
        for seed in range(40):
            camera = Drawn(seed, read_e=0.2 + 0.03 * (seed % 10), dark_e_per_s=20.0, dsnu_e=0.0, gain=(1.0, 0.97, 1.03, 0.8)[seed % 4], full_well=3000.0, black=100 + 0.137 * seed % 1)
            channel, _ = camera.measured(0.02, self.DARKS_S)
            for key, truth in zip(keys, (camera.read_e, camera.BLACK, camera.rate.mean(), camera.GAIN)):
                if channel[key] is None:
                    continue
                outside[key] += self.outside(channel, {key: truth})
                self.assertGreater(channel[key]["high"], channel[key]["low"], key)
        self.assertLessEqual(max(outside.values()), 7, outside)

    def test_copies_under_other_conditions_are_refused(self):
        for seed, read_e in (0, 6.0), (1, 1.0):
            camera = Drawn(seed, read_e=read_e)
            frames = camera.frames(0.02, self.DARKS_S)
            for kind in "dark", "flat":
                own = [place for place, frame in enumerate(frames) if frame[0] == kind]
                copied = list(frames)
                for to, of in (own[-2], own[2]), (own[-1], own[3]):
                    copied[to] = (*frames[to][:3], frames[of][3])
                channel, said = camera.told(copied)
                self.assertIsNone(channel)
                self.assertIn(f"{own[2]}.png and ", said)
                self.assertIn(f"{own[-2]}.png: their samples are the same", said)

    def test_a_black_level_that_jitters_saw_no_light(self):
        for seed in range(6):
            camera = Drawn(seed, read_e=6.0 if seed % 2 else 3.0, dark_e_per_s=10.0, black=8.3, jitter_adu=1.0)
            channel, said = camera.told(camera.frames(0.02, self.DARKS_S, stack=16), options=())
            self.assertIsNotNone(channel, said)
            self.assertNotIn("is the first a dark", said)

    def test_means_of_quiet_rounded_darks_have_no_thousands_of_defects(self):
        for seed in range(8):
            camera = Drawn(seed, read_e=0.5 + 0.2 * seed, dark_e_per_s=10.0, dsnu_e=0.4, size=(128, 160))
            channel, _ = camera.told(camera.frames(0.02, self.DARKS_S, stack=16))
            for place in "dark", "light":
                self.assertLessEqual(channel["defects"][place]["count"], 2)

    def test_a_photosite_that_is_clipped_early_takes_no_stack_with_it(self):
        outside = 0
        for seed in range(12):
            camera = Drawn(seed)
            camera.rate[40, 50] = 450_000.0
            channel, said = camera.told(camera.frames(0.02, self.DARKS_S, stack=16))
            self.assertNotIn("too near saturation", str(channel["notes"]))
            self.assertEqual(channel["defects"]["clipped"], {"count": 1, "listed": 1, "sites": [{"x": 50, "y": 40}]})
            outside += self.outside(channel, {"prnu": Drawn.PRNU, "dark_current_e_per_s": 500.0})
        self.assertLessEqual(outside, 5)

    def test_full_wells_below_the_end_of_codes_are_none(self):
        """Darks whose charge is noisy, and a read-out that is not: full photosites are one code, which is no end of codes."""
        for seed in range(6):
            camera = Drawn(seed, read_e=0.3, dark_e_per_s=500.0, dsnu_e=0.0, black=100.0)
            channel, said = camera.told(camera.frames(0.02, self.DARKS_S), options=())
            self.assertNotIn("it is taken to be", said)
            self.assertNotIn("the converter ends first", str(channel["undetermined"]))

    def test_light_that_flickers_bends_no_response(self):
        for seed in range(40):
            _, said = Drawn(seed, flicker=0.001).measured(0.02, self.DARKS_S)
            self.assertNotIn("response bends", said)

    def test_photons_of_one_level_that_are_wrong_are_named(self):
        for seed, share in enumerate(Drawn.SHARES[:10]):
            wrong = share * Drawn.FULL_WELL
            _, said = Drawn(seed).measured(0.02, self.DARKS_S, photons=lambda light_e: light_e * (1.1 if light_e == wrong else 1))
            self.assertIn("of their number of photons: is that wrong?", said)
            self.assertNotIn("response bends, so", said)

    def test_darks_of_unknown_times_are_no_black_level_that_moves(self):
        camera = Drawn(1, dark_e_per_s=20.0)
        _, said = camera.told(camera.frames(0.02, self.DARKS_S), is_timed=False)
        self.assertIn("they are of several exposure times, which `exposure_s` of a list would tell apart", said)

    def test_sensor_files_part_hot_photosites_from_the_others(self):
        """Dark currents of 20 e-/s and, of one photosite in a hundred, 2000 more: share and mean come back, within 4/sqrt(n) of the n = 200."""
        for seed in range(4):
            camera = Drawn(seed, dark_e_per_s=20.0, hot_share=0.01, hot_e_per_s=2000.0, size=(128, 160))
            with tempfile.TemporaryDirectory() as folder:
                file = pathlib.Path(folder) / "sensor.yaml"
                channel, said = camera.told(camera.frames(0.02, self.DARKS_S), sensor=file)
                self.assertIsNotNone(channel, said)
                self.assertGreater(channel["dcnu"]["value"], 2)
                lines = [line.split(":") for line in file.read_text().splitlines() if line.startswith("  ") and line.count(":") == 1]
                own = {key.strip(): float(value) for key, value in lines if key.strip() in ("dcnu", "hot_pixel_share", "hot_pixel_dark_current_e_per_s", "dark_current_e_per_s")}
                light = ["--electrons", "100,100,100", "--size", "16x16", "--exposure", "0.02", "-o", pathlib.Path(folder) / "light.exr"]
                command = [BINARIES / "render-radiance", "--sensor", file, *light]
                self.assertEqual(subprocess.run(command, capture_output=True, timeout=60).returncode, 0)
            self.assertLess(abs(own["hot_pixel_share"] / 0.01 - 1), 0.28)
            self.assertLess(abs(own["hot_pixel_dark_current_e_per_s"] / 2000 - 1), 0.28)
            self.assertLess(own["dcnu"], 1)
            all_e_per_s = own["dark_current_e_per_s"] + own["hot_pixel_share"] * own["hot_pixel_dark_current_e_per_s"]
            self.assertLess(abs(all_e_per_s / channel["dark_current_e_per_s"]["value"] - 1), 1e-3)


def squares(images, tables):
    """Mean squares of rows, of columns and of what is left."""
    _, rows, columns = images.shape
    centered = images - images.mean(axis=(1, 2), keepdims=True)
    by_row = columns * (centered.mean(axis=2) ** 2).sum()
    by_column = rows * (centered.mean(axis=1) ** 2).sum()
    rest = (centered ** 2).sum() - by_row - by_column
    return by_row / (rows - 1) / tables, by_column / (columns - 1) / tables, rest / ((rows - 1) * (columns - 1)) / tables


if __name__ == "__main__":
    unittest.main()
