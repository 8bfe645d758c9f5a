"""Semi-global matching: costs summed along eight paths through the image (Hirschmüller 2008, eqs. 13-15)."""

from __future__ import annotations

import numpy as np
from numba import float32, int64, types, uint8, uint16, void

from vision3d.kernels import inlined, kernel

__all__ = ["sum_paths"]

_U8_2 = types.Array(uint8, 2, "C", readonly=True)
_U8_3 = types.Array(uint8, 3, "C", readonly=True)
_F32_1 = types.Array(float32, 1, "C", readonly=True)


@inlined
def _step(cost, before, least, p1, p2, now, total):
    """One pixel of one path; rows are padded by one large number on either side.  Gives its least."""
    n = cost.shape[0]
    jump = least + p2
    best = np.float32(1e30)
    for d in range(n):
        value = before[d + 1]
        lower = before[d] + p1
        upper = before[d + 2] + p1
        value = min(value, lower)
        value = min(value, upper)
        value = min(value, jump)
        value = value - least + np.float32(cost[d])
        now[d + 1] = value
        total[d] += np.uint16(value)
        best = min(best, value)
    return best


@kernel(void(_U8_3, _U8_2, float32, _F32_1, int64, uint16[:, :, ::1]))
def sum_paths(cost, guide, p1, p2_of_step, diagonal, total):
    """Add to total (h, w, n) the costs (h, w, n) along 4 paths, or 8 with `diagonal`.

    `guide` (h, w) is the image; a step of so many levels in it lets disparity jump for `p2_of_step` (256,).
    """
    height, width, n = cost.shape
    big = np.float32(1e9)
    rows = np.full((4, 2, width + 2, n + 2), big, dtype=np.float32)
    least = np.zeros((4, 2, width + 2), dtype=np.float32)
    for sweep in range(2):
        forth = 1 if sweep == 0 else -1
        for k in range(height):
            y = k if sweep == 0 else height - 1 - k
            now, before = k % 2, (k + 1) % 2
            for j in range(width):
                x = j if sweep == 0 else width - 1 - j
                for path in range(4):
                    if path > 1 and diagonal == 0:
                        break
                    # 0 along the row, 1 along the column, 2 and 3 the diagonals
                    dx = -forth if path == 0 else 0 if path == 1 else -1 if path == 2 else 1
                    dy = 0 if path == 0 else -forth
                    px, py = x + dx, y + dy
                    row = now if path == 0 else before
                    if px < 0 or px >= width or py < 0 or py >= height:
                        low = big
                        for d in range(n):
                            value = np.float32(cost[y, x, d])
                            rows[path, now, x + 1, d + 1] = value
                            total[y, x, d] += np.uint16(value)
                            low = min(low, value)
                        least[path, now, x + 1] = low
                        continue
                    step = abs(np.int32(guide[y, x]) - np.int32(guide[py, px]))
                    least[path, now, x + 1] = _step(
                        cost[y, x], rows[path, row, px + 1], least[path, row, px + 1], p1,
                        p2_of_step[step], rows[path, now, x + 1], total[y, x],
                    )  # fmt: skip
