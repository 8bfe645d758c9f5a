"""Harris' and Shi and Tomasi's scores from derivatives that have been padded."""

import numba as nb
import numpy as np

from vision3d.kernels import kernel

__all__ = ["scores"]

f32 = nb.float32[:, ::1]


@kernel(nb.void(f32, f32, nb.int64, nb.float64, nb.boolean, f32))
def scores(dx, dy, block, k, smaller, out):
    """det M - k (trace M)², or the smaller eigenvalue of M, the sums of products over block by block windows.

    Columns are summed row by row, what enters minus what leaves, and so are windows along a row.
    """
    height, width = out.shape
    wide = dx.shape[1]
    columns = np.zeros((3, wide))
    sums = np.empty((3, width))
    for y in range(height + block - 1):
        a, b = dx[y], dy[y]
        for x in range(wide):
            u, v = a[x], b[x]
            columns[0, x] += u * u
            columns[1, x] += u * v
            columns[2, x] += v * v
        if y < block - 1:
            continue
        for m in range(3):
            total = 0.0
            for i in range(block - 1):
                total += columns[m, i]
            for x in range(width):
                total += columns[m, x + block - 1]
                sums[m, x] = total
                total -= columns[m, x]
        line = out[y - block + 1]
        if smaller:
            for x in range(width):
                half = 0.5 * (sums[0, x] - sums[2, x])
                line[x] = 0.5 * (sums[0, x] + sums[2, x]) - np.sqrt(half * half + sums[1, x] * sums[1, x])
        else:
            for x in range(width):
                trace = sums[0, x] + sums[2, x]
                line[x] = sums[0, x] * sums[2, x] - sums[1, x] * sums[1, x] - k * trace * trace
        first, last = dx[y - block + 1], dy[y - block + 1]
        for x in range(wide):
            u, v = first[x], last[x]
            columns[0, x] -= u * u
            columns[1, x] -= u * v
            columns[2, x] -= v * v
