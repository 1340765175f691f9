"""A 3x3 matrix on each pixel of an image of 32-bit floats."""

import numpy as np
import turns

MATRIX = np.array([[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]])


def interleaved(width, height):
    return np.stack([turns.ramp(width, height)] * 3, axis=-1)


def matmul(width, height):
    """numpy's matmul of all pixels, interleaved, 32-bit."""
    image, matrix = interleaved(width, height).reshape(-1, 3), MATRIX.T.astype(np.float32)
    output = np.empty_like(image)
    return lambda: np.matmul(image, matrix, out=output)


def einsum(width, height):
    """numpy's einsum on planes, 32-bit."""
    image, matrix = np.stack([turns.ramp(width, height)] * 3), MATRIX.astype(np.float32)
    output = np.empty_like(image)
    return lambda: np.einsum("ij,jyx->iyx", matrix, image, out=output)


def opencv(width, height):
    """OpenCV's transform, interleaved, 32-bit, one thread."""
    import cv2

    cv2.setNumThreads(1)
    image = interleaved(width, height)
    output = np.empty_like(image)
    return lambda: cv2.transform(image, MATRIX, dst=output)


def colour(width, height):
    """colour-science's vecmul, which works in doubles."""
    from colour.algebra import vecmul

    image = interleaved(width, height)
    return lambda: vecmul(MATRIX, image)


if __name__ == "__main__":
    turns.main({"matmul": matmul, "einsum": einsum, "opencv": opencv, "colour": colour})
