"""Radiance to electrons: the programs beside a sum of [HP2005, Eq. 5] in double precision."""

import math
import unittest

import numpy as np

from programs import ProgramCase, read_planes, read_spec, read_table, sample_data

# Single precision rounds by 6e-8; the rest is room for the order of a sum of 471 terms.
TOLERANCE = 2e-6

PLANCK_J_S = 6.62607015e-34
LIGHT_M_PER_S = 299792458.0
PITCH_CM = 6.8e-4


def weights(count, step, rule):
    """The weights of a quadrature rule on evenly spaced points."""
    result = np.full(count, float(step))
    if rule == "trapezoid":
        result[[0, -1]] *= 0.5
    elif rule == "simpson":
        assert count % 2 == 1
        result[1:-1:2] *= 4 / 3
        result[2:-1:2] *= 2 / 3
        result[[0, -1]] *= 1 / 3
    return result


class Sensor:
    """The default sensor, from its tables."""

    def __init__(self):
        quantum_efficiency = read_table(sample_data("sensors/kaf5101ce_est_qe_1nm.csv"))
        glass = read_table(sample_data("sensors/bg39_1mm.csv"))
        self.wavelength_nm = quantum_efficiency["wavelength_nm"]
        assert np.array_equal(self.wavelength_nm, np.arange(360, 831))
        self.response = {name: quantum_efficiency[name] * glass["T_ext_1mm"] for name in "RGB"}

    def electrons(
        self, radiance, exposure_s=0.033, f_number=8.0, lens=1.0, start=360, end=830, step=1, rule="rectangle"
    ):
        """Expected electrons of each class for radiance in W/(cm² sr nm) at 360 … 830 nm; radiance may have more axes
        before the last."""
        used = np.arange(start - 360, end - 360 + 1, step)
        optics = math.pi * lens / (4 * f_number**2 + 1)
        scale = PITCH_CM**2 * exposure_s * 1e-9 / (PLANCK_J_S * LIGHT_M_PER_S) * optics
        terms = weights(len(used), step, rule) * self.wavelength_nm[used]
        return {
            name: scale * np.sum(terms * response[used] * radiance[..., used], axis=-1)
            for name, response in self.response.items()
        }


def falloff(width, height, focal_length_mm):
    """cos⁴θ at the center of each photosite."""
    x = (np.arange(width) + 0.5 - width / 2) * PITCH_CM * 10 / focal_length_mm
    y = (np.arange(height) + 0.5 - height / 2) * PITCH_CM * 10 / focal_length_mm
    return np.cos(np.arctan(np.sqrt(x[None, :] ** 2 + y[:, None] ** 2))) ** 4


class RadianceToElectrons(ProgramCase):
    def setUp(self):
        super().setUp()
        self.sensor = Sensor()
        self.chance = np.random.default_rng(1789)

    def random_radiance(self):
        """A spectrum with structure in it, a few thousand electrons at the default exposure."""
        smooth = 1 + 0.8 * np.sin(np.arange(471) / self.chance.uniform(10, 60) + self.chance.uniform(0, 6))
        return self.chance.uniform(1e-6, 1e-5) * smooth * self.chance.uniform(0.2, 1, 471)

    def write_spectrum(self, name, radiance):
        lines = ["# made by a test; W cm-2 sr-1 nm-1", "wavelength_nm,radiance_w_per_cm2_sr_nm"]
        lines += [f"{360 + index},{value!r}" for index, value in enumerate(radiance.tolist())]
        (self.directory / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
        return name

    def compare(self, planes, expected):
        self.assertEqual(sorted(planes), ["B", "G", "R"])
        for name in "RGB":
            wanted = np.broadcast_to(expected[name], planes[name].shape)
            error = np.max(np.abs(planes[name] - wanted) / wanted)
            self.assertLessEqual(error, TOLERANCE, f"channel {name}: {planes[name].flat[0]} for {wanted.flat[0]}")

    def render(self, *arguments):
        return self.frame(["render-radiance", *arguments])

    def test_default_camera(self):
        for trial in range(5):
            radiance = self.random_radiance()
            planes = self.render(self.write_spectrum(f"{trial}.csv", radiance), "--size", "5x3")
            self.assertEqual(planes["R"].shape, (3, 5))
            self.compare(planes, self.sensor.electrons(radiance))

    def test_exposure_aperture_and_lens(self):
        for trial in range(12):
            radiance = self.random_radiance()
            exposure = float(f"{10 ** self.chance.uniform(-5, 0):.6g}")
            f_number = float(f"{self.chance.uniform(0.7, 22):.4g}")
            lens = float(f"{self.chance.uniform(0.05, 1):.4g}")
            planes = self.render(
                self.write_spectrum(f"{trial}.csv", radiance),
                *("--size", "2x2", "--exposure", exposure),
                *("--f-number", f_number, "--lens-transmittance", lens),
            )
            self.compare(planes, self.sensor.electrons(radiance, exposure, f_number, lens))

    def test_quadrature_rules_and_wavelengths(self):
        radiance = self.random_radiance()
        name = self.write_spectrum("sky.csv", radiance)
        for start, end, step in [(360, 830, 1), (400, 700, 1), (360, 830, 5), (400, 700, 10), (420, 640, 2)]:
            for rule in ("rectangle", "trapezoid", "simpson"):
                with self.subTest(rule=rule, start=start, end=end, step=step):
                    planes = self.render(
                        *(name, "--size", "2x2", "--quadrature", rule),
                        *("--wavelengths", f"{start}:{end}:{step}"),
                    )
                    self.compare(
                        planes, self.sensor.electrons(radiance, start=start, end=end, step=step, rule=rule)
                    )

    def test_coarse_tables_are_straight_along_what_they_count(self):
        nm = np.arange(360, 831)
        # By wavenumber, by wavelength per wavenumber, and per nm by wavenumber: W cm-2 sr-1 over cm-1 or nm.
        for rows, heading, values, per_cm in [
            ([12_000, 20_000, 28_000], "nu (cm-1),L (W cm-2 sr-1 / cm-1)", [1e-7, 9e-7, 2e-7], True),
            ([12_000, 18_500, 28_000], "nu (cm-1),L (W cm-2 sr-1 nm-1)", [4e-6, 1e-6, 9e-6], False),
            ([350, 500, 850], "nm,L (W cm-2 sr-1 / cm-1)", [2e-7, 9e-7, 1e-7], True),
        ]:
            with self.subTest(heading=heading, per_cm=per_cm):
                lines = [heading, *(f"{row},{value!r}" for row, value in zip(rows, values))]
                (self.directory / "coarse.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
                along = 1e7 / nm if heading.startswith("nu") else nm
                radiance = np.interp(along, rows, values) * (1e7 / nm**2.0 if per_cm else 1)
                self.compare_within(self.render("coarse.csv", "--size", "2x2"), self.sensor.electrons(radiance), 1e-5)

    def compare_within(self, planes, expected, tolerance):
        for name in "RGB":
            self.assertLess(abs(planes[name].flat[0] / expected[name] - 1), tolerance, name)

    def test_single_spectra_of_the_sample_data(self):
        for path in sorted(sample_data("skies").glob("*.csv")):
            if path.name.endswith("_meta.csv"):
                continue
            with self.subTest(spectrum=path.name):
                radiance = read_table(path)["radiance_w_per_cm2_sr_nm"]
                self.compare(self.render(path, "--size", "2x2"), self.sensor.electrons(radiance))

    def test_column_of_a_table(self):
        spectra = {"haze": self.random_radiance(), "clear": self.random_radiance()}
        lines = ["# Unit: W cm-2 sr-1 nm-1", "wavelength_nm,haze,clear"]
        lines += [f"{360 + i},{spectra['haze'][i]!r},{spectra['clear'][i]!r}" for i in range(471)]
        text = "\n".join(lines).replace("np.float64(", "").replace(")", "")
        (self.directory / "two.csv").write_text(text + "\n", encoding="utf-8")
        for column, radiance in spectra.items():
            planes = self.render("two.csv", "--column", column, "--size", "2x2")
            self.compare(planes, self.sensor.electrons(radiance))

    def test_coarse_table_of_a_straight_spectrum(self):
        # Any fair interpolation of a straight line gives the line.
        wavelength = np.arange(360, 831, 5)
        line = lambda nm: 2e-6 + 1e-8 * (nm - 360.0)
        rows = [f"{nm},{line(nm)!r}".replace("np.float64(", "").replace(")", "") for nm in wavelength]
        text = "\n".join(["wavelength_nm,radiance_w_per_cm2_sr_nm", *rows]) + "\n"
        (self.directory / "coarse.csv").write_text(text, encoding="utf-8")
        self.compare(
            self.render("coarse.csv", "--size", "2x2"), self.sensor.electrons(line(np.arange(360, 831.0)))
        )

    def test_vignetting(self):
        radiance = self.random_radiance()
        name = self.write_spectrum("sky.csv", radiance)
        level = self.sensor.electrons(radiance)
        for width, height, focal_length_mm in [(9, 6, 0.05), (1, 7, 0.02), (301, 200, 8.0), (640, 3, 50.0)]:
            with self.subTest(width=width, height=height, focal_length_mm=focal_length_mm):
                planes = self.render(
                    *(name, "--size", f"{width}x{height}"),
                    *("--vignetting", "--focal-length", focal_length_mm),
                )
                shade = falloff(width, height, focal_length_mm)
                self.compare(planes, {k: level[k] * shade for k in "RGB"})

    def test_no_vignetting_unless_asked(self):
        name = self.write_spectrum("sky.csv", self.random_radiance())
        planes = self.render(name, "--size", "31x17")
        for samples in planes.values():
            self.assertEqual(np.ptp(samples), 0)

    def test_expose_to_a_fraction_of_full_well(self):
        for trial, fraction in enumerate([0.75, 0.75, 0.1, 0.95]):
            radiance = self.random_radiance()
            name = self.write_spectrum(f"{trial}.csv", radiance)
            self.run_program(
                ["render-radiance", name, "--size", "3x2", "--expose-to", fraction, "-o", "exposed.exr"]
            )
            planes = read_planes(self.directory / "exposed.exr")
            brightest = max(samples.max() for samples in planes.values())
            self.assertLessEqual(abs(brightest / (40000 * fraction) - 1), 1e-5)
            unit = self.sensor.electrons(radiance, exposure_s=1.0)
            exposure = 40000 * fraction / max(unit.values())
            self.compare(planes, {k: unit[k] * exposure for k in "RGB"})
            # OpenImageIO calls the attribute expTime ExposureTime.
            spec = read_spec(self.directory / "exposed.exr")
            said = spec.get_float_attribute("ExposureTime", spec.get_float_attribute("expTime", 0.0))
            self.assertLessEqual(abs(said / exposure - 1), TOLERANCE, "expTime is not the exposure chosen")

    def test_sky_library_as_patches(self):
        library = sample_data("skies/sky912.exr")
        channels = read_planes(library)
        radiance = np.stack([channels[f"S0.{nm},000000nm"] for nm in range(360, 831)], axis=-1)
        level = self.sensor.electrons(radiance.astype(np.float64))
        for width, height in [(1, 1), (3, 2)]:
            planes = self.render(library, "--patch", f"{width}x{height}")
            self.assertEqual(planes["R"].shape, (24 * height, 38 * width))
            self.compare(
                planes, {k: level[k].repeat(height, axis=0).repeat(width, axis=1) for k in "RGB"}
            )

    def test_one_sample_of_the_library(self):
        library = sample_data("skies/sky912.exr")
        channels = read_planes(library)
        radiance = np.stack([channels[f"S0.{nm},000000nm"] for nm in range(360, 831)], axis=-1).reshape(912, 471)
        for number in (0, 37, 38, 500, 911):
            planes = self.render(library, "--sample", number, "--size", "4x3")
            self.assertEqual(planes["R"].shape, (3, 4))
            self.compare(planes, self.sensor.electrons(radiance[number].astype(np.float64)))

    def test_electrons_given(self):
        planes = self.render("--electrons", "1000,2000.5,0", "--size", "7x5")
        for name, level in zip("RGB", (1000, 2000.5, 0)):
            self.assertTrue(np.all(planes[name] == level), name)

    def test_dark(self):
        planes = self.render("--dark", "--size", "7x5")
        for name in "RGB":
            self.assertTrue(np.all(planes[name] == 0), name)

    def test_without_light_from_one_class(self):
        # Light beyond 700 nm only: red sees it, blue hardly; the sum must not lose small terms.
        radiance = np.where(np.arange(360, 831) > 700, 3e-5, 1e-12)
        planes = self.render(self.write_spectrum("red.csv", radiance), "--size", "2x2")
        self.compare(planes, self.sensor.electrons(radiance))


class Reference(unittest.TestCase):
    """The reference itself, on cases worked out by hand."""

    def test_rules_integrate_what_they_should(self):
        x = np.linspace(0, 1, 11)
        self.assertAlmostEqual(np.sum(weights(11, 0.1, "simpson") * x**3), 0.25, places=14)
        self.assertAlmostEqual(np.sum(weights(11, 0.1, "trapezoid") * x), 0.5, places=14)
        self.assertAlmostEqual(np.sum(weights(11, 0.1, "rectangle")), 1.1, places=14)

    def test_photons_of_one_line(self):
        # 1 W/cm² for 1 s on 46.24 µm² at 555 nm is 4.624e-7 J of photons of 3.579e-19 J each.
        sensor = Sensor()
        sensor.response = {name: np.ones(471) for name in "RGB"}
        radiance = np.zeros(471)
        radiance[555 - 360] = (4 * 8.0**2 + 1) / math.pi
        electrons = sensor.electrons(radiance, exposure_s=1.0)["G"]
        self.assertAlmostEqual(electrons / (4.624e-7 / 3.5791e-19), 1, places=4)

    def test_falloff_is_even_and_one_at_the_center(self):
        shade = falloff(5, 3, 0.05)
        self.assertEqual(shade[1, 2], 1)
        np.testing.assert_allclose(shade, shade[::-1, ::-1])
        self.assertAlmostEqual(shade[1, 3], math.cos(math.atan(6.8e-3 / 0.05)) ** 4, places=14)
