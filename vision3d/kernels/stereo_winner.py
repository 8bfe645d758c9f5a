"""The best disparity of every pixel of both pictures, from one volume of summed costs."""

from __future__ import annotations

import numpy as np
from numba import float32, int32, int64, types, uint16, void

from vision3d.kernels import kernel

__all__ = ["winners"]

_U16_3 = types.Array(uint16, 3, "C", readonly=True)


@kernel(void(_U16_3, int64, float32[:, ::1], int32[:, ::1], float32[:, ::1]))
def winners(total, first, left, right, margin):
    """Least sums of total (h, w, n), whose entry d is the disparity first + d.

    Gives `left` (h, w) with a parabola through three sums, whole `right` (h, w) along the diagonals (below
    `first` where no pixel of the left picture looks), and `margin` (h, w): how far the best sum lies below
    the best one that is no neighbour of it, as a share of the latter.
    """
    height, width, n = total.shape
    least_right = np.empty(width, dtype=np.int64)
    for y in range(height):
        least_right[:] = 1 << 30
        right[y, :] = first - 1
        for x in range(width):
            best, at = np.int64(1 << 30), 0
            for d in range(n):
                value = np.int64(total[y, x, d])
                if value < best:
                    best, at = value, d
                there = x - first - d
                if 0 <= there < width and value < least_right[there]:
                    least_right[there] = value
                    right[y, there] = first + d
            other = np.int64(1 << 30)
            for d in range(n):
                if (d < at - 1 or d > at + 1) and np.int64(total[y, x, d]) < other:
                    other = np.int64(total[y, x, d])
            margin[y, x] = 0.0 if other in (0, 1 << 30) else 1.0 - best / other
            offset = 0.0
            if 0 < at < n - 1:
                lower, upper = np.float64(total[y, x, at - 1]), np.float64(total[y, x, at + 1])
                bend = lower - 2.0 * best + upper
                if bend > 0.0:
                    offset = 0.5 * (lower - upper) / bend
            left[y, x] = first + at + offset
