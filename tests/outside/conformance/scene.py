"""A camera that obeys the Luther condition, and scenes of known spectra: what it should record, by numpy alone.

The camera's responses are sums of the observer's color-matching functions, so that a matrix gives XYZ of every spectrum without
error: a converter that does as the DNG specification says finds the scene's own XYZ.
"""

import dataclasses
import functools
import math

import numpy as np

from programs import read_table, sample_data

PLANCK_J_S = 6.62607015e-34
LIGHT_M_PER_S = 299792458.0
LUMENS_PER_WATT = 683.0
D65_XY = 0.3127, 0.3290
PITCH_UM = 5.0
F_NUMBER = 8.0

# R, G and B from X, Y and Z of the spectrum: nowhere below zero, with the overlap of common filters.
SHAPES = np.array([[0.55, 0.0825, -0.066], [-0.2, 1.0, 0.06], [0.0, 0.0, 0.6]])
# Largest quantum efficiency of a class.
PEAK_EFFICIENCY = 0.5
# Full well that no code reaches, e⁻.
NO_FULL_WELL = 1e6
# Luminance of a perfect diffuser in the scene's light.
WHITE_CD_PER_M2 = 1000.0


def table(name):
    return read_table(sample_data(name))


OBSERVER = table("observers/cie1931_2deg_1nm.csv")
WAVELENGTH_NM = OBSERVER["wavelength_nm"]
CMF = np.stack([OBSERVER[name] for name in ("xbar", "ybar", "zbar")])
# λ times quantum efficiency, to a factor, and that factor.
RESPONSES = np.maximum(SHAPES @ CMF, 0)
EFFICIENCY_SCALE = PEAK_EFFICIENCY / (RESPONSES / WAVELENGTH_NM).max()
EFFICIENCY = EFFICIENCY_SCALE * RESPONSES / WAVELENGTH_NM


def xyz_of(radiance):
    """X, Y, Z in cd/m² of radiances in W/(cm² sr nm), sums by 1 nm."""
    return LUMENS_PER_WATT * 1e4 * radiance @ CMF.T


def white_of(xy):
    """X, Y, Z of a chromaticity with Y = 1."""
    return np.array([xy[0] / xy[1], 1, (1 - xy[0] - xy[1]) / xy[1]])


@dataclasses.dataclass(frozen=True)
class Camera:
    """A converter behind the responses: levels in ADU, by site where black is four numbers. No dark current, no patterns."""

    bits: int
    adu_per_e: float
    bias: int
    read_noise_e: float
    full_well_e: float = NO_FULL_WELL

    @property
    def name(self):
        return f"conformance-{self.bits}" + ("" if self.full_well_e == NO_FULL_WELL else "-full")

    @property
    def electrons_per_xyz(self):
        """Electrons of R, G and B per s from X, Y, Z in cd/m²: Eq. 5 of Haralabidis and Pilinis (2005)."""
        optics = math.pi / (4 * F_NUMBER**2 + 1)
        flux = (PITCH_UM * 1e-4) ** 2 * 1e-9 / (PLANCK_J_S * LIGHT_M_PER_S) * optics
        return flux * EFFICIENCY_SCALE * SHAPES / (LUMENS_PER_WATT * 1e4)

    @property
    def xyz_from_camera(self):
        """X, Y, Z in cd/m² from ADU above black per s and sr."""
        return np.linalg.inv(self.electrons_per_xyz * self.adu_per_e / (math.pi / (4 * F_NUMBER**2 + 1)))

    @property
    def camera_from_xyz(self):
        """ColorMatrix1: the largest signal of D65 with Y = 1 is 1."""
        return SHAPES / (SHAPES @ white_of(D65_XY)).max()

    def exposure_s(self, white, share):
        """The time by which a white diffuser reaches this share of `white` ADU above black, of six digits."""
        rate = (self.electrons_per_xyz @ white_of(D65_XY)).max() * WHITE_CD_PER_M2 * self.adu_per_e
        return float(f"{share * white / rate:.6g}")

    def write(self, directory):
        """The sensor file, and its curves."""
        curves = directory / f"{self.name}.csv"
        header = "# Quantum efficiency of a camera that obeys the Luther condition, electrons per photon.\nwavelength_nm,R,G,B\n"
        rows = [f"{int(nm)}," + ",".join(map(repr, row)) for nm, row in zip(WAVELENGTH_NM, EFFICIENCY.T.tolist())]
        curves.write_text(header + "\n".join(rows) + "\n", encoding="utf-8")
        matrix = "".join(f"  - [{', '.join(map(repr, row))}]\n" for row in self.xyz_from_camera.tolist())
        path = directory / f"{self.name}.yaml"
        path.write_text(
            f"""schema: cyanometer-sensor/2
name: {self.name}
description: a camera whose responses are sums of color-matching functions
readout:
  width: 4000
  height: 3000
  pixel_pitch_um: {PITCH_UM}
  cfa: rggb
  full_well_e: {self.full_well_e}
  dark_current_e_per_s: 0
  temperature_k: 293
  dcnu: 0
  prnu: 0
  read_noise_e: {self.read_noise_e}
  bits: {self.bits}
  bias_adu: {self.bias}
  adu_per_e: {self.adu_per_e}
response:
  quantum_efficiency: {{file: {curves.name}}}
xyz_from_camera:
{matrix}""",
            encoding="utf-8",
        )
        return path


def d65(luminance):
    """Radiance of a perfect diffuser under D65, W/(cm² sr nm)."""
    power = table("illuminants/cie_d65_1nm.csv")["D65"]
    return power * luminance / xyz_of(power)[1]


def smoothest(xyz, light):
    """The reflectance of least second differences that has these XYZ under the light, cut off at 0.01 and 0.99."""
    seen = LUMENS_PER_WATT * 1e4 * CMF * light
    bends = np.diff(np.eye(len(light)), 2, axis=0)
    system = np.block([[bends.T @ bends, seen.T], [seen, np.zeros((3, 3))]])
    solved = np.linalg.solve(system, np.concatenate([np.zeros(len(light)), xyz]))
    return np.clip(solved[: len(light)], 0.01, 0.99)


@functools.cache
def chart():
    """The 24 colors of a ColorChecker, under D65: names, columns, and radiances."""
    lines = sample_data("charts/colorchecker.csv").read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in lines if line and not line.startswith("#")][1:]
    light = d65(WHITE_CD_PER_M2)
    white = xyz_of(light)
    spectra = []
    for _, *lab in rows:
        lightness, a, b = map(float, lab)
        f = (lightness + 16) / 116 + np.array([a / 500, 0, -b / 200])
        xyz = np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29)) * white
        spectra.append(smoothest(xyz, light) * light)
    return [row[0] for row in rows], 6, np.array(spectra)


@functools.cache
def ramp():
    """Grays under D65, from none to 0.9 of white in steps of a factor, and one of twice the white: names, columns, radiances."""
    shares = [0.0, *np.geomspace(0.001, 0.9, 30).tolist(), 2.0]
    return [f"gray {share:.4g}" for share in shares], 8, np.outer(shares, d65(WHITE_CD_PER_M2))


@functools.cache
def sky():
    """Twenty-four computed skies, the brightest with the luminance of white: names, columns, radiances."""
    from programs import read_planes

    planes = read_planes(sample_data("skies/sky912.exr"))
    pixels = np.stack([planes[name].ravel() for name in sorted(planes)], -1).astype(float)
    # Channels are called S0.<nm>nm, all of three digits; samples are W/(cm² sr nm).
    chosen = np.linspace(0, len(pixels) - 1, 24).astype(int)
    spectra = pixels[chosen]
    spectra *= WHITE_CD_PER_M2 / xyz_of(spectra)[:, 1].max()
    return [f"sky912 {number}" for number in chosen], 6, spectra


SCENES = {"chart": chart, "ramp": ramp, "sky": sky}
