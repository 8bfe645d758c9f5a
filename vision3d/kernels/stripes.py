"""Follow a stripe through an image from row to row."""

from __future__ import annotations

import math

from numba import types

from vision3d.kernels import kernel
from vision3d.kernels.arrays import f0, i0, w1

__all__ = ["trace"]

f_image = types.Array(types.float32, 2, "C", readonly=True)


@kernel(i0(f_image, f0, i0, f0, f0, i0, f0, w1, w1))
def trace(shown, level, start, centre, width, gap, growth, left, right):
    """Follow a stripe upwards; returns how many rows show it.

    `shown` (h, w) exceeds `level` in the stripe, which has its `centre` and `width` in row `start`.  `left`
    and `right` (h,) become its edges, between pixels where `shown` crosses the level; NaN in rows that do not
    show it.  It ends where `gap` rows in turn do not.  `growth` bounds by how much its width may change.
    """
    height, columns = shown.shape
    for row in range(height):
        left[row] = right[row] = math.nan
    slope, missed, seen, unseen = 0.0, 0, 0, 0
    rows_across = height // 3
    faintest = 0.4 * level
    for row in range(start, -1, -1):
        expected = centre + slope * (missed + 1)
        reach = 0.75 * width + 2.0 + 0.5 * missed
        best_l, best_r, nearest, crossing = -1, -1, math.inf, False
        first = max(0, int(expected - reach))
        last = min(columns - 1, int(expected + reach))
        # back to where a run that the search begins in begins itself
        while first > 0 and shown[row, first] > level and expected - first < 4.0 * width + 8.0:
            first -= 1
        j = first
        while j <= last:
            if not (shown[row, j] > level):
                j += 1
                continue
            begin = j
            while j + 1 < columns and shown[row, j + 1] > level:
                j += 1
            away = abs(0.5 * (begin + j) - expected)
            wide = j - begin + 1
            if begin < expected < j and wide >= growth * width + 2.0 and unseen < rows_across:
                crossing = True
            if away < nearest and wide < growth * width + 2.0 and wide > width / growth - 2.0:
                best_l, best_r, nearest = begin, j, away
            j += 1
        if best_l < 0 or nearest > reach:
            missed += 1
            if crossing:
                missed -= 1  # at a junction the stripe goes on straight, unseen, and is not lost
                centre += slope
                unseen += 1
            if missed > gap:
                break
            continue
        a, b = float(best_l), float(best_r)
        if best_l > 0:
            a -= (shown[row, best_l] - level) / (shown[row, best_l] - shown[row, best_l - 1])
        if best_r < columns - 1:
            b += (shown[row, best_r] - level) / (shown[row, best_r] - shown[row, best_r + 1])
        left[row], right[row] = a, b
        middle = 0.5 * (a + b)
        if seen > 0:
            step = (middle - centre) / (missed + 1)
            slope += (0.3 if seen > 3 else 0.6) * (step - slope)
        centre, missed = middle, 0
        if best_l > 0 and best_r < columns - 1:  # a stripe that is cut off by the edge keeps its width
            width += 0.1 * ((b - a) - width)
        seen += 1
        if level > 0.0:  # where the line fades, half-way to the ground is lower
            total = 0.0
            for k in range(best_l, best_r + 1):
                total += shown[row, k]
            level += 0.15 * (max(0.5 * total / (best_r - best_l + 1), faintest) - level)
    return seen
