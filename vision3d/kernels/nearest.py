"""The two nearest of many descriptors, the second of them somewhere else in the image."""

from __future__ import annotations

import numba
import numpy as np

from vision3d.kernels import kernel
from vision3d.kernels.arrays import f2, w1

__all__ = ["hamming", "two_nearest"]

words = numba.types.Array(numba.uint64, 2, "C", readonly=True)
distances = numba.types.Array(numba.float32, 2, "C", readonly=True)
indices = numba.int64[::1]


@kernel(numba.void(words, words, numba.float32[:, ::1]))
def hamming(a, b, out):
    """Bits that differ between every row of a (N, k) and of b (M, k), words of 64 bits, to out (N, M)."""
    ones, twos, fours = (
        np.uint64(0x5555555555555555),
        np.uint64(0x3333333333333333),
        np.uint64(0x0F0F0F0F0F0F0F0F),
    )
    for i in range(len(a)):
        for j in range(len(b)):
            total = np.uint64(0)
            for k in range(a.shape[1]):
                # the compiler knows this way of counting bits as one instruction
                x = a[i, k] ^ b[j, k]
                x -= (x >> np.uint64(1)) & ones
                x = (x & twos) + ((x >> np.uint64(2)) & twos)
                x = (x + (x >> np.uint64(4))) & fours
                total += (x * np.uint64(0x0101010101010101)) >> np.uint64(56)
            out[i, j] = np.float32(total)


@kernel(numba.void(distances, f2, numba.float64, numba.int64, indices, w1, w1, indices, w1))
def two_nearest(table, pixels_b, apart_px, first_row, best, nearest, second, best_of_b, nearest_of_b):
    """Of every row of a table of distances the nearest column, and the second that is apart from it.

    Parameters
    ----------
    table : (n, M) distances of rows first_row … of a
    pixels_b : (M, 2) where columns are, px
    apart_px : columns nearer than this to the nearest are not the second
    best, nearest, second : (N,) out: column, its distance, and that of the second (inf where none is)
    best_of_b, nearest_of_b : (M,) in and out: the row nearest to each column so far, and its distance
    """
    limit = apart_px * apart_px
    for i in range(len(table)):
        row = table[i]
        at, least = -1, np.float32(np.inf)
        rival, other = -1, np.float32(np.inf)
        for j in range(len(row)):
            d = row[j]
            if d < other:
                if d < least:
                    rival, other = at, least
                    at, least = j, d
                else:
                    rival, other = j, d
            if d < nearest_of_b[j]:
                nearest_of_b[j] = d
                best_of_b[j] = first_row + i
        if rival >= 0 and limit > 0.0:
            x, y = pixels_b[at, 0], pixels_b[at, 1]
            if (pixels_b[rival, 0] - x) ** 2 + (pixels_b[rival, 1] - y) ** 2 < limit:
                other = np.float32(np.inf)
                for j in range(len(row)):
                    if row[j] < other and j != at:
                        u, v = pixels_b[j, 0] - x, pixels_b[j, 1] - y
                        if u * u + v * v >= limit:
                            other = row[j]
        best[first_row + i] = at
        nearest[first_row + i] = least
        second[first_row + i] = other
