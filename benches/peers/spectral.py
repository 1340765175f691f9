"""Radiance at 471 wavelengths to the electrons of three classes: numpy's tensordot on one thread, 32-bit."""

import numpy as np
import turns

BANDS = 471


def planes(width, height):
    """Bands as planes, as an EXR holds them, row by row."""
    image, weights = radiance(width * height).reshape(BANDS, height, width), responses()
    return lambda: np.tensordot(weights, image, axes=(1, 0))


def pixels(width, height):
    """Bands of each pixel side by side."""
    image, weights = radiance(width * height).reshape(height, width, BANDS), responses()
    return lambda: np.tensordot(image, weights, axes=(2, 1))


def radiance(pixels):
    return (1e-6 * (1 + np.arange(pixels * BANDS, dtype=np.uint32) % 97)).astype(np.float32)


def responses():
    return np.linspace(0.1, 1.0, 3 * BANDS, dtype=np.float32).reshape(3, BANDS)


if __name__ == "__main__":
    turns.main({"planes": planes, "pixels": pixels})
