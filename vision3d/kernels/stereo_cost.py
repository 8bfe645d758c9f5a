"""What two pixels of a rectified pair cost as a match: census and colour, one byte a disparity."""

from __future__ import annotations

import numpy as np
from numba import float32, int64, types, uint8, uint64, void

from vision3d.kernels import kernel

__all__ = ["census", "matching_cost"]

_U8_2 = types.Array(uint8, 2, "C", readonly=True)
_U8_3 = types.Array(uint8, 3, "C", readonly=True)
_U64_2 = types.Array(uint64, 2, "C", readonly=True)
_F32_1 = types.Array(float32, 1, "C", readonly=True)


@kernel(void(_U8_2, int64, int64, int64, uint64[:, ::1]))
def census(image, half_w, half_h, least, out):
    """Which neighbours of each pixel are darker by `least` levels: a bit each (Zabih and Woodfill 1994)."""
    height, width = image.shape
    for y in range(height):
        for x in range(width):
            centre = np.int64(image[y, x]) - least
            word = np.uint64(0)
            for dy in range(-half_h, half_h + 1):
                yy = min(max(y + dy, 0), height - 1)
                for dx in range(-half_w, half_w + 1):
                    if dx == 0 and dy == 0:
                        continue
                    xx = min(max(x + dx, 0), width - 1)
                    word = word << np.uint64(1)
                    if np.int64(image[yy, xx]) <= centre:
                        word |= np.uint64(1)
            out[y, x] = word


@kernel(void(_U64_2, _U64_2, _U8_3, _U8_3, _F32_1, _F32_1, int64, uint8, uint8[:, :, ::1]))
def matching_cost(words_a, words_b, a, b, of_bits, of_levels, first, outside, cost):
    """Cost (h, w, n) of a's pixel x as b's pixel x - first - d; `outside` where that is not in the image.

    `of_bits` (65,) and `of_levels` (256·channels,) are what so many differing bits and levels cost.
    """
    height, width, channels = a.shape
    n = cost.shape[2]
    m1, m2 = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
    m4, one = np.uint64(0x0F0F0F0F0F0F0F0F), np.uint64(0x0101010101010101)
    for y in range(height):
        for x in range(width):
            word = words_a[y, x]
            for d in range(n):
                at = x - first - d
                if at < 0 or at >= width:
                    cost[y, x, d] = outside
                    continue
                bits = word ^ words_b[y, at]
                bits = bits - ((bits >> np.uint64(1)) & m1)
                bits = (bits & m2) + ((bits >> np.uint64(2)) & m2)
                bits = (bits + (bits >> np.uint64(4))) & m4
                bits = (bits * one) >> np.uint64(56)
                levels = 0
                for c in range(channels):
                    levels += abs(np.int32(a[y, x, c]) - np.int32(b[y, at, c]))
                cost[y, x, d] = np.uint8(of_bits[np.int64(bits)] + of_levels[levels])
