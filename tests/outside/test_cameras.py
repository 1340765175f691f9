"""Cameras of rawtoaces-data beside sums in numpy over the raw files, and what it costs to take signals per watt for signals per
photon or the other way.

The raw files are no part of this tree: shared/data/cameras is looked for beside it, and what needs it is skipped where it is
missing. `python tests/outside/test_cameras.py` prints the table of costs in docs/sensors.md.
"""

import json
import math
import unittest

import numpy as np

from programs import ROOT, ProgramCase, read_table, sample_data
from test_color import library_radiance, tristimulus

GRID_NM = np.arange(360, 831)
PLANCK_J_S = 6.62607015e-34
LIGHT_M_PER_S = 299792458.0
# The read-out of imx477.yaml, and an exposure that no sky fills it in.
PITCH_CM, ADU_PER_E = 1.55e-4, 0.47
EXPOSURE_S, F_NUMBER, PEAK = 0.001, 8.0, 0.5
SOLID_ANGLE = math.pi / (4 * F_NUMBER**2 + 1)
# The table has samples in whole 100000ths of the largest: off by at most 5e-6 of it, where classes have 0.05 of it on average
# over the light of a sky.
ROUNDED = 1e-4
# Sums of some hundred doubles.
EXACT = 1e-12
READINGS = ("energy", "quanta")
SHOWN = ("canon-eos-5d-mark-ii", "fujifilm-x-t3", "nikon-d850", "sony-ilce-7rm4")


def raw_files():
    """The raw files by the names that they have here."""
    found = [above / "shared/data/cameras" for above in ROOT.parents if (above / "shared/data/cameras").exists()]
    if not found:
        raise unittest.SkipTest("shared/data/cameras is missing")
    lines = sample_data("sensors/rawtoaces_cameras.csv").read_text().splitlines()
    rows = [line.split(",") for line in lines if not line.startswith("#")][1:]
    known = {(row[1], row[2]): row[0] for row in rows}
    files = {}
    for path in (found[0] / "camera").glob("*.json"):
        header = json.loads(path.read_text())["header"]
        files[known[header["manufacturer"], header["model"]]] = path
    return files


def response(path):
    """R, G and B of a raw file at 360 to 830 nm, linear between its samples and zero beyond."""
    samples = json.loads(path.read_text())["spectral_data"]["data"]["main"]
    nm = [float(key) for key in samples]
    return np.stack([np.interp(GRID_NM, nm, one, left=0, right=0) for one in zip(*samples.values())])


def efficiency(path, reading, peak=PEAK):
    """Quantum efficiencies of R, G and B whose largest is the peak."""
    shape = response(path) / (GRID_NM if reading == "energy" else 1.0)
    return peak * shape / shape.max()


def electrons(path, reading, radiance):
    """Electrons of R, G and B from radiances in W/(cm² sr nm)."""
    scale = PITCH_CM**2 * EXPOSURE_S * SOLID_ANGLE * 1e-9 / (PLANCK_J_S * LIGHT_M_PER_S)
    return scale * radiance @ (efficiency(path, reading) * GRID_NM).T


def least_squares(signals, xyz):
    """The matrix from signals to XYZ."""
    return np.linalg.lstsq(signals, xyz, rcond=None)[0].T


def lab(xyz, white):
    ratio = xyz / white
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def delta_e_2000(one, other, white):
    """CIE 142-2001, from XYZ."""
    (l1, a1, b1), (l2, a2, b2) = lab(one, white), lab(other, white)
    mean_chroma = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    g = 0.5 * (1 - np.sqrt(mean_chroma**7 / (mean_chroma**7 + 25.0**7)))
    a1, a2 = (1 + g) * a1, (1 + g) * a2
    c1, c2 = np.hypot(a1, b1), np.hypot(a2, b2)
    h1, h2 = (np.degrees(np.arctan2(b, a)) % 360 for b, a in ((b1, a1), (b2, a2)))
    turn = (h2 - h1 + 180) % 360 - 180
    dh = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn) / 2)
    mean_l, mean_c, mean_h = (l1 + l2) / 2, (c1 + c2) / 2, (h1 + turn / 2) % 360
    cos = lambda degrees: np.cos(np.radians(degrees))
    t = 1 - 0.17 * cos(mean_h - 30) + 0.24 * cos(2 * mean_h) + 0.32 * cos(3 * mean_h + 6) - 0.2 * cos(4 * mean_h - 63)
    s_l = 1 + 0.015 * (mean_l - 50) ** 2 / np.sqrt(20 + (mean_l - 50) ** 2)
    s_c, s_h = 1 + 0.045 * mean_c, 1 + 0.015 * mean_c * t
    rotation = 2 * np.sqrt(mean_c**7 / (mean_c**7 + 25.0**7)) * np.sin(np.radians(60 * np.exp(-(((mean_h - 275) / 25) ** 2))))
    l, c, h = (l2 - l1) / s_l, (c2 - c1) / s_c, dh / s_h
    return np.sqrt(l**2 + c**2 + h**2 - rotation * c * h)


def d65():
    columns = read_table(sample_data("illuminants/cie_d65_1nm.csv"))
    return next(values for name, values in columns.items() if not name.startswith("wavelength"))


def reflectances(directory):
    """The 190 reflectances of rawtoaces-data at 360 to 830 nm, as radiances under D65, and the light itself."""
    samples = json.loads((directory / "training/training_spectral.json").read_text())["spectral_data"]["data"]["main"]
    nm = [float(key) for key in samples]
    patches = np.stack([np.interp(GRID_NM, nm, one, left=0, right=0) for one in zip(*samples.values())])
    return patches * d65(), d65()


def scenes(directory):
    """By name: radiances to fit and judge on, and the white among them that exposure and white balance are set by."""
    skies = library_radiance().reshape(912, 471)
    patches, light = reflectances(directory)
    return {"912 skies": (skies, skies.mean(axis=0)), "190 reflectances": (patches, light)}


def judged(xyz, truth):
    """ΔE2000 from the truth: skies differ in luminance and are each judged at Y = 50; the white is D65 of Y = 100."""
    light = tristimulus(d65())
    level = 50 / truth[:, 1:2] if len(truth) == 912 else 100 / light[1]
    return delta_e_2000(xyz * level, truth * level, 100 * light / light[1])


def own_fit(path, reading, radiance):
    """Mean ΔE2000 of a matrix that is fitted to the signals of its own reading."""
    truth, signals = tristimulus(radiance), radiance @ (efficiency(path, reading) * GRID_NM).T
    return judged(signals @ least_squares(signals, truth).T, truth).mean()


def costs(path, radiance, white_radiance):
    """Mean and largest ΔE2000 from the truth: by the matrix of the right reading, by that of the other with one factor on all
    classes, and with one on each class, that make the white right; the camera counts energy."""
    truth = tristimulus(radiance)
    signals = {reading: radiance @ (efficiency(path, reading) * GRID_NM).T for reading in READINGS}
    whites = {reading: white_radiance @ (efficiency(path, reading) * GRID_NM).T for reading in READINGS}
    matrix = {reading: least_squares(signals[reading], truth) for reading in READINGS}
    gains = whites["quanta"] / whites["energy"]
    made = (
        signals["energy"] @ matrix["energy"].T,
        signals["energy"] * gains[1] @ matrix["quanta"].T,
        signals["energy"] * gains @ matrix["quanta"].T,
    )
    differences = [judged(xyz, truth) for xyz in made]
    return [(one.mean(), one.max()) for one in differences]


def table():
    """The table of docs/sensors.md."""
    files = raw_files()
    directory = files[SHOWN[0]].parents[1]
    lines = []
    for name in SHOWN:
        for scene, (radiance, white) in scenes(directory).items():
            cells = " | ".join(f"{mean:.2f}, {most:.2f}" for mean, most in costs(files[name], radiance, white))
            lines.append(f"| `{name}` | {scene} | {cells} |")
    return lines


class Cameras(ProgramCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.files = raw_files()
        cls.radiance = library_radiance().reshape(912, 471)

    def options(self, sensor, reading):
        return ["--sensor", sensor, "--readout", "imx477", "--peak-quantum-efficiency", PEAK, "--counts", reading]

    def expected(self, sensor, reading, sample):
        library = sample_data("skies/sky912.exr")
        words = ["predict-noise", library, "--sample", sample, "--exposure", EXPOSURE_S]
        words += [*self.options(sensor, reading), "--output-format", "json", "-q"]
        report = json.loads(self.run_program(words))
        return next(stage for stage in report["stages"] if stage["stage"] == "electrons")["mean"]

    def test_every_camera_expects_the_electrons_of_its_raw_file(self):
        self.assertEqual(len(self.files), 52)
        for place, (name, path) in enumerate(sorted(self.files.items())):
            reading, sample = READINGS[place % 2], (place * 17) % 912
            wanted = electrons(path, reading, self.radiance[sample])
            worst = np.max(np.abs(np.array(self.expected(name, reading, sample)) / wanted - 1))
            self.assertLess(worst, ROUNDED, name)

    def test_a_raw_file_is_read_as_it_is(self):
        for name in ("nikon-d850", "nikon-d5100"):
            for reading in READINGS:
                wanted = electrons(self.files[name], reading, self.radiance[132])
                worst = np.max(np.abs(np.array(self.expected(str(self.files[name]), reading, 132)) / wanted - 1))
                self.assertLess(worst, EXACT, f"{name}, {reading}")

    def test_matrices_are_those_of_least_squares(self):
        library = sample_data("skies/sky912.exr")
        truth = tristimulus(self.radiance)
        for name in SHOWN:
            for reading in READINGS:
                words = ["fit-matrix", library, *self.options(str(self.files[name]), reading), "--output-format", "json", "-q"]
                made = np.array(json.loads(self.run_program(words))["matrix"])
                signals = ADU_PER_E * electrons(self.files[name], reading, self.radiance) / (EXPOSURE_S * SOLID_ANGLE)
                wanted = least_squares(signals, truth)
                # Both solve by orthogonal transformations: 1e-15 times the condition number, some hundreds.
                self.assertLess(np.max(np.abs(made / wanted - 1)), 1e-10, f"{name}, {reading}")

    def test_the_costs_are_those_of_the_page(self):
        page = (ROOT / "docs/sensors.md").read_text()
        for line in table():
            self.assertIn(line, page)

    def test_energy_fits_better(self):
        directory = self.files[SHOWN[0]].parents[1]
        for name, (wanted, energy, quanta) in {"912 skies": (52, 0.107, 0.135), "190 reflectances": (51, 1.12, 1.35)}.items():
            radiance, white = scenes(directory)[name]
            means = np.array([[own_fit(path, reading, radiance) for reading in READINGS] for path in self.files.values()])
            self.assertEqual(np.count_nonzero(means[:, 0] < means[:, 1]), wanted)
            # The page rounds to three digits.
            self.assertLess(np.max(np.abs(means.mean(axis=0) / [energy, quanta] - 1)), 0.005)

    def test_the_difference_is_that_of_the_standard(self):
        # Pairs 1, 13, 18 and 25 of Sharma, Wu and Dalal, Color Res. Appl. 30(1), 2005, Table 1, from L*a*b* to XYZ and back.
        white = np.array([95.047, 100.0, 108.883])

        def xyz(l, a, b):
            y = (l + 16) / 116
            f = np.array([y + a / 500, y, y - b / 200])
            return white * np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))

        for one, other, wanted in (
            ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
            ((50, -0.001, 2.49), (50, 0.0009, -2.49), 4.8045),
            ((50, 2.5, 0), (61, -5, 29), 22.8977),
            ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
        ):
            self.assertAlmostEqual(float(delta_e_2000(xyz(*one), xyz(*other), white)), wanted, 4)


if __name__ == "__main__":
    print("\n".join(table()))
