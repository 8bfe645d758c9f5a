"""Colours: grey, hue-saturation-value and CIE Lab from the BGR images that OpenCV reads.

Hue says which colour, saturation how pure, value how bright: a threshold on hue outlives a change of light
better than one on BGR.  In Lab, distances are about those that an eye sees, and L alone carries brightness.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from vision3d.image.pixels import Backend, as_image, checked_backend

__all__ = ["grey", "hsv", "lab"]

Bytes = NDArray[np.uint8]
# ITU-R BT.601 luma, B G R, in 1/2¹⁵
LUMA = (3735, 19235, 9798)
# linear sRGB to XYZ under D65, columns R G B, each row over the white point's
XYZ = np.array(
    [[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]]
)
WHITE = np.array([0.950456, 1.0, 1.088754])


def grey(image: ArrayLike, *, backend: Backend = "compiled") -> Bytes:
    """Brightness of a BGR image: 0.299 R + 0.587 G + 0.114 B, rounded; a grey image is given back.

    Raises
    ------
    ShapeError
        where it has two channels.
    DataError
        where it is not of uint8.
    """
    pixels = as_image(image)
    if pixels.ndim == 2 or pixels.shape[2] == 1:
        return np.asarray(pixels.reshape(pixels.shape[:2]), np.uint8)
    pixels = _bgr(pixels)
    if checked_backend(backend) == "opencv":
        import cv2

        return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY), np.uint8)
    total = sum((pixels[:, :, k] * np.uint32(weight) for k, weight in enumerate(LUMA)), np.uint32(1 << 14))
    return np.asarray(np.asarray(total) >> 15, np.uint8)


def hsv(image: ArrayLike, *, backend: Backend = "compiled") -> Bytes:
    """(h, w, 3) hue in steps of 2° (0 to 179), saturation and value 0 to 255, of a BGR image.

    Hue is an angle: 179 and 0 are neighbours, both red.  That of a grey is noise, and of black all are.
    """
    pixels = _bgr(as_image(image))
    if checked_backend(backend) == "opencv":
        import cv2

        return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2HSV), np.uint8)
    b, g, r = (pixels[:, :, k].astype(np.int32) for k in range(3))
    value = np.maximum(np.maximum(b, g), r)
    spread = value - np.minimum(np.minimum(b, g), r)
    pure, turn = _hsv_tables()
    half = 1 << 11
    saturation = (spread * pure[value] + half) >> 12
    # which of the three is largest says in which third of the circle the colour lies
    sixth = np.where(value == r, g - b, np.where(value == g, b - r + 2 * spread, r - g + 4 * spread))
    hue = (sixth * turn[spread] + half) >> 12
    hue += np.where(hue < 0, 180, 0)
    return np.stack([hue, saturation, value], axis=2).astype(np.uint8)


@cache
def _hsv_tables() -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """255/v and 30/d in 1/2¹², so that no pixel divides."""
    numbers = np.arange(1, 256)
    pure, turn = np.zeros(256, np.int32), np.zeros(256, np.int32)
    pure[1:], turn[1:] = np.rint((255 << 12) / numbers), np.rint((180 << 12) / (6.0 * numbers))
    return pure, turn


def lab(image: ArrayLike, *, backend: Backend = "compiled") -> NDArray[np.float32]:
    """(h, w, 3) CIE L* (0 to 100), a* (green to red) and b* (blue to yellow) under D65, of a BGR image."""
    pixels = _bgr(as_image(image))
    if checked_backend(backend) == "opencv":
        import cv2

        return np.asarray(cv2.cvtColor(pixels.astype(np.float32) / 255, cv2.COLOR_BGR2Lab), np.float32)
    linear = _linear()[pixels[:, :, ::-1]]
    ratio = linear @ (XYZ / WHITE[:, None]).T.astype(np.float32)
    root = np.where(ratio > 0.008856, np.cbrt(ratio), 7.787 * ratio + 16.0 / 116.0)
    x, y, z = (root[:, :, k] for k in range(3))
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=2).astype(np.float32)


@cache
def _linear() -> NDArray[np.float32]:
    """(256,) light of each level of sRGB (IEC 61966-2-1)."""
    s = np.arange(256) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _bgr(pixels: NDArray[np.generic]) -> Bytes:
    if pixels.ndim == 3 and pixels.shape[2] == 4:
        pixels = np.ascontiguousarray(pixels[:, :, :3])  # opacity is no colour
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise ShapeError(
            f"image has shape {pixels.shape}; expected (height, width, 3), in OpenCV's order blue, green, red"
        )
    if pixels.dtype != np.uint8:
        raise DataError(f"image is of {pixels.dtype}; expected uint8, values 0 to 255: scale it first")
    return np.asarray(pixels, np.uint8)
