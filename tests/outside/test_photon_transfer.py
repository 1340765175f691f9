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
    """A monochrome camera of 12 bits as numpy draws it: K 0.3, black 100.25 ADU, full well 12000 e-, read noise and dark current as they are given."""

    GAIN, BLACK, FULL_WELL, EFFICIENCY, PRNU, SIZE = 0.3, 100.25, 12000.0, 0.5, 0.01, (96, 128)
    SHARES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.4, 1.8)

    def __init__(self, seed, read_e=6.0, dark_e_per_s=500.0, dcnu=0.1, hot_share=0.0, hot_e_per_s=0.0, held=()):
        self.random = numpy.random.default_rng(seed)
        draw = lambda std: std * self.random.standard_normal(self.SIZE)
        self.response, self.offset = 1 + draw(self.PRNU), draw(1.0)
        self.rate = dark_e_per_s * (1 + draw(dcnu)).clip(0)
        self.rate += (self.random.random(self.SIZE) < hot_share) * self.random.exponential(max(hot_e_per_s, 1e-9), self.SIZE)
        self.read_e, self.held = read_e, held

    def frame(self, light_e, time_s):
        charge = numpy.minimum(self.random.poisson(light_e * self.response + self.rate * time_s), self.FULL_WELL)
        noisy = charge + self.offset + self.read_e * self.random.standard_normal(self.SIZE)
        codes = numpy.rint(self.GAIN * noisy + self.BLACK).clip(0, 4095).astype(numpy.uint16)
        for (y, x), code in self.held:
            codes[y, x] = code
        return codes

    def measured(self, flat_s, darks_s):
        """What the program finds, and what it says; flats are as long as they are bright where they have no time of their own."""
        with tempfile.TemporaryDirectory() as folder:
            folder, rows = pathlib.Path(folder), ["File,Kind,EXPOSURE_S,photons"]

            def put(kind, light_e, time_s, count):
                for _ in range(count):
                    name = f"{len(rows)}.png"
                    Image.fromarray(self.frame(light_e, time_s)).save(folder / name)
                    rows.append(f"{name},{kind},{time_s},{light_e / self.EFFICIENCY if kind == 'flat' else ''}")

            for share in self.SHARES:
                put("flat", share * self.FULL_WELL, flat_s or 0.02 * share, 8 if share == 0.5 else 2)
            for index, time_s in enumerate(darks_s):
                put("dark", 0.0, time_s, 2 if index else 8)
            (folder / "list.csv").write_text("\n".join(rows) + "\n")
            command = [BINARIES / "photon-transfer", folder / "list.csv", "--white", "4095", "--cfa", "monochrome", "--output-format", "json"]
            told = subprocess.run(command, check=True, capture_output=True, timeout=300, text=True)
        [channel] = json.loads(told.stdout)["channels"]
        return channel, told.stderr


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
