"""Sums over square windows of an image that has been padded, whatever their size at the same cost."""

import numba as nb
import numpy as np

from vision3d.kernels import kernel

__all__ = ["box_sums", "means"]

u8, i32 = nb.uint8[:, ::1], nb.int32[:, ::1]
f32, f64 = nb.float32[:, ::1], nb.float64[:, ::1]


@kernel([nb.void(u8, nb.int64, i32), nb.void(f32, nb.int64, f64), nb.void(f64, nb.int64, f64)])
def box_sums(padded, size, out):
    """out[y, x] = Σ of the size by size window, by running sums: what enters minus what leaves."""
    height, width = out.shape
    column = np.zeros(padded.shape[1], out.dtype)
    for j in range(size - 1):
        source = padded[j]
        for x in range(len(column)):
            column[x] += source[x]
    for y in range(height):
        entering = padded[y + size - 1]
        for x in range(len(column)):
            column[x] += entering[x]
        total = column[0] - column[0]
        for i in range(size - 1):
            total += column[i]
        line = out[y]
        for x in range(width):
            total += column[x + size - 1]
            line[x] = total
            total -= column[x]
        leaving = padded[y]
        for x in range(len(column)):
            column[x] -= leaving[x]


@kernel(nb.void(i32, nb.float64, u8))
def means(sums, scale, out):
    """out = sums · scale, rounded to the nearest, halves to even."""
    height, width = sums.shape
    for y in range(height):
        line = sums[y]
        for x in range(width):
            out[y, x] = nb.uint8(np.rint(line[x] * scale))
