"""The whole chain of one uniform sky in one process, from its spectrum to the mean and covariance of XYZ.

    chain.py numpy|opencv SPECTRUM.csv SENSORS_DIRECTORY MATRIX.yaml WIDTHxHEIGHT

numpy: as one writes it down, three planes in doubles: noise and converter by numpy on all three planes, mosaic and bilinear
interpolation by colour-demosaicing, matrix by colour-science.
opencv: the mosaic comes first, so that noise and converter work on one plane, in 32-bit floats where numpy's Generator draws
them; bilinear interpolation (16 bits, of codes) and matrix (32-bit) by OpenCV, on as many threads as it likes.

Both expect the same electrons as render-radiance does, draw the five sources of add-noise, and print what measure prints:
mean, standard deviation, extremes and covariance. Nothing is written to files.
"""

import csv
import sys

import numpy as np

DARK_E, DCNU, PRNU, READ_NOISE_E, FULL_WELL_E = 73.21, 0.2, 0.008, 15.7, 40_000.0
BIAS_ADU, ADU_PER_E, TOP_CODE = 1753.0, 0.058824, 4095
BLACK_ADU = BIAS_ADU + ADU_PER_E * DARK_E
EXPOSURE_S, F_NUMBER, PIXEL_CM2 = 0.033, 8.0, 6.8e-4**2
EXPOSURE_S_SR = EXPOSURE_S * np.pi / (4 * F_NUMBER**2 + 1)
JOULE_NM = 6.62607015e-34 * 299_792_458 * 1e9


def table(path):
    with open(path, encoding="utf-8") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    return dict(zip(rows[0], np.array(rows[1:], dtype=float).T))


def electrons(spectrum, sensors):
    """Expected electrons of R, G and B: sums over 471 wavelengths."""
    radiance = table(spectrum)["radiance_w_per_cm2_sr_nm"]
    efficiency = list(table(f"{sensors}/kaf5101ce_est_qe_1nm.csv").values())
    glass = table(f"{sensors}/bg39_1mm.csv")["T_ext_1mm"]
    photons = radiance * efficiency[0] / JOULE_NM * glass * PIXEL_CM2 * EXPOSURE_S_SR
    return np.array([np.sum(photons * of_class) for of_class in efficiency[1:4]])


def matrix(path):
    """The nine numbers below xyz_from_camera of a matrix file, per ADU."""
    with open(path, encoding="utf-8") as file:
        text = file.read().split("xyz_from_camera:", 1)[1]
    numbers = [float(line.split()[-1]) for line in text.splitlines()[1:10]]
    return np.array(numbers).reshape(3, 3) / EXPOSURE_S_SR


def report(xyz):
    """Of pixels by channels."""
    print("mean", xyz.mean(axis=0, dtype=float), "min", xyz.min(axis=0), "max", xyz.max(axis=0))
    covariance = np.cov(xyz, rowvar=False)
    print("std", np.sqrt(np.diag(covariance)))
    print(covariance)


def by_numpy(expected, xyz_from_adu, width, height):
    from colour.algebra import vecmul
    from colour_demosaicing import demosaicing_CFA_Bayer_bilinear, mosaicing_CFA_Bayer

    rng = np.random.default_rng(0)
    shape = (height, width, 3)
    image = np.broadcast_to(expected, shape)
    charge = rng.poisson(image) * np.maximum(rng.normal(1.0, PRNU, shape), 0.0)
    charge += rng.poisson(DARK_E, shape) * np.maximum(rng.normal(1.0, DCNU, shape), 0.0)
    charge = np.minimum(charge, FULL_WELL_E) + rng.normal(0.0, READ_NOISE_E, shape)
    codes = np.clip(np.rint(BIAS_ADU + ADU_PER_E * charge), 0, TOP_CODE)
    rgb = demosaicing_CFA_Bayer_bilinear(mosaicing_CFA_Bayer(codes, "RGGB") - BLACK_ADU, "RGGB")
    report(vecmul(xyz_from_adu, rgb).reshape(-1, 3))


def by_opencv(expected, xyz_from_adu, width, height):
    import cv2

    rng = np.random.default_rng(0)
    shape = (height, width)
    plane = np.empty(shape, np.float32)
    plane[0::2, 0::2] = expected[0]
    plane[0::2, 1::2] = plane[1::2, 0::2] = expected[1]
    plane[1::2, 1::2] = expected[2]

    def normal(mean, sigma):
        drawn = rng.standard_normal(shape, dtype=np.float32)
        drawn *= np.float32(sigma)
        drawn += np.float32(mean)
        return drawn

    charge = rng.poisson(plane).astype(np.float32)
    charge *= np.maximum(normal(1.0, PRNU), 0)
    charge += rng.poisson(DARK_E, shape).astype(np.float32) * np.maximum(normal(1.0, DCNU), 0)
    np.minimum(charge, np.float32(FULL_WELL_E), out=charge)
    charge += normal(0.0, READ_NOISE_E)
    charge *= np.float32(ADU_PER_E)
    charge += np.float32(BIAS_ADU)
    codes = np.clip(np.rint(charge, out=charge), 0, TOP_CODE, out=charge).astype(np.uint16)
    rgb = cv2.cvtColor(codes, cv2.COLOR_BayerBG2RGB).astype(np.float32)
    # Black goes in with the matrix: a fourth column of constants.
    affine = np.column_stack([xyz_from_adu, -BLACK_ADU * xyz_from_adu.sum(axis=1)])
    report(cv2.transform(rgb, affine).reshape(-1, 3))


def main():
    if len(sys.argv) != 6 or sys.argv[1] not in ("numpy", "opencv"):
        sys.exit(__doc__.strip())
    way, spectrum, sensors, matrix_file, size = sys.argv[1:]
    width, height = (int(number) for number in size.split("x"))
    run = by_numpy if way == "numpy" else by_opencv
    run(electrons(spectrum, sensors), matrix(matrix_file), width, height)


if __name__ == "__main__":
    main()
