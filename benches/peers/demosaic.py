"""Bilinear interpolation of one Bayer plane (R G / G B) of 16-bit codes."""

import tempfile
import numpy as np
import turns


def opencv(width, height):
    """OpenCV's bilinear cvtColor, u16 to u16, one thread. It names patterns by the second row and column: BG is R G / G B."""
    import cv2

    cv2.setNumThreads(1)
    plane = turns.codes(turns.ramp(width, height))
    output = np.empty((height, width, 3), np.uint16)
    return lambda: cv2.cvtColor(plane, cv2.COLOR_BayerBG2RGB, dst=output)


def colour(width, height):
    """colour-demosaicing's bilinear method: two-dimensional convolutions in doubles."""
    from colour_demosaicing import demosaicing_CFA_Bayer_bilinear

    plane = turns.codes(turns.ramp(width, height)).astype(np.float64)
    return lambda: demosaicing_CFA_Bayer_bilinear(plane, "RGGB")


def libraw(width, height):
    """LibRaw's linear interpolation of a DNG, by rawpy; opening and unpacking the file is not counted.

    LibRaw interpolates within its whole processing: black subtraction, scaling to 16 bits, and output (of the camera's own
    colors, without gamma and brightening) are in the time.
    """
    import dng
    import rawpy

    with tempfile.NamedTemporaryFile(suffix=".dng") as file:
        dng.write(file.name, turns.codes(turns.ramp(width, height)), 1757, 4095)
        raw = rawpy.imread(file.name)
        raw.unpack()
    options = {
        "demosaic_algorithm": rawpy.DemosaicAlgorithm.LINEAR,
        "output_color": rawpy.ColorSpace.raw,
        "user_wb": [1, 1, 1, 1],
        "gamma": (1, 1),
        "no_auto_bright": True,
        "no_auto_scale": True,
        "output_bps": 16,
    }
    made = raw.postprocess(**options)
    if made.shape != (height, width, 3):
        raise SystemExit(f"LibRaw makes {made.shape} of a plane of {width}x{height}")
    return lambda: raw.postprocess(**options)


if __name__ == "__main__":
    turns.main({"opencv": opencv, "colour": colour, "libraw": libraw})
