"""Counting the levels of an image of bytes."""

import numba as nb
import numpy as np

from vision3d.kernels import kernel

__all__ = ["adaptive", "histogram", "look_up"]

u8 = nb.uint8[:, ::1]
read = nb.types.Array(nb.uint8, 2, "C", readonly=True)


@kernel(nb.void(read, nb.int64[::1]))
def histogram(image, counts):
    """How many pixels have each of the 256 levels.  Four tables, so that equal neighbours do not wait."""
    tables = np.zeros((4, 256), np.int64)
    height, width = image.shape
    fours = width - width % 4
    for y in range(height):
        line = image[y]
        for x in range(0, fours, 4):
            tables[0, line[x]] += 1
            tables[1, line[x + 1]] += 1
            tables[2, line[x + 2]] += 1
            tables[3, line[x + 3]] += 1
        for x in range(fours, width):
            tables[0, line[x]] += 1
    for level in range(256):
        counts[level] = tables[0, level] + tables[1, level] + tables[2, level] + tables[3, level]


@kernel(nb.void(read, u8, nb.int64, nb.uint8, nb.uint8, u8))
def adaptive(image, mean, below, above, otherwise, out):
    """`above` where a pixel exceeds the mean around it by more than `below`, `otherwise` elsewhere."""
    height, width = image.shape
    for y in range(height):
        for x in range(width):
            brighter = nb.int16(image[y, x]) - nb.int16(mean[y, x]) > below
            out[y, x] = above if brighter else otherwise


@kernel(nb.void(read, nb.uint8[::1], u8))
def look_up(image, table, out):
    """out = table[image]."""
    height, width = image.shape
    for y in range(height):
        for x in range(width):
            out[y, x] = table[image[y, x]]
