"""Where a stripe of known width crosses a band of rows: a matched filter, then least squares on its place."""

from __future__ import annotations

import math

from numba import types

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, i0, u2, w1

__all__ = ["row_centre"]

ROUNDS = 4
LONGEST_STEP = 0.7  # px


@inlined
def mean_between(sums, first, last):
    """Mean of a profile over first <= j <= last, from its running sums; NaN where there is none."""
    return (sums[last + 1] - sums[first]) / (last + 1 - first) if last >= first else math.nan


@inlined
def best_place(profile, sums, wide):
    """The column in which a box stands out most from what lies on both its sides."""
    columns = profile.shape[0]
    best, place = -math.inf, 0
    for j in range(columns):
        first, last = max(j - wide // 2, 0), min(j - wide // 2 + wide - 1, columns - 1)
        left = mean_between(sums, max(first - wide, 0), first - 1)
        right = mean_between(sums, last + 1, min(last + wide, columns - 1))
        # darker than the darker side, less what lies on one side alone: a shadow's edge is no stripe
        around = left if math.isnan(right) else (right if math.isnan(left) else min(left, right))
        response = (around - mean_between(sums, first, last)) * math.sqrt(last + 1.0 - first)
        if response > best:
            best, place = response, j
    return place


@kernel(types.void(u2, i0, i0, f0, f0, f0, w1, w1, w1))
def row_centre(image, row, half, width, soft, sign, profile, sums, out):
    """Find a stripe of `width` px in the rows from row - half to row + half.

    `sign` is 1 for a stripe darker than the ground, -1 for a lighter one; its edges rise over `soft` px.
    Scratch: `profile` (w,), `sums` (w + 1,).  `out` (4,) becomes its centre and its standard deviation, px,
    the difference from the ground, grey levels, and that difference over its own standard deviation.
    """
    columns = image.shape[1]
    top, end = max(row - half, 0), min(row + half + 1, image.shape[0])
    rows = end - top
    for j in range(columns):
        total = 0.0
        for i in range(top, end):
            total += image[i, j]
        profile[j] = sign * total / rows
    sums[0] = 0.0
    for j in range(columns):
        sums[j + 1] = sums[j] + profile[j]
    wide = max(int(width + 0.5), 1)
    start = best_place(profile, sums, wide)
    centre, depth, level, steep = float(start), 0.0, 0.0, 0.0
    first = max(start - 2 * wide, 0)
    last = min(start + 2 * wide, columns - 1)
    for _ in range(ROUNDS):
        # level and depth by least squares, the place being given
        n, sg, sgg, sb, sbg = 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(first, last + 1):
            g = min(max(0.5 + (0.5 * width - abs(j - centre)) / soft, 0.0), 1.0)
            n += 1.0
            sg += g
            sgg += g * g
            sb += profile[j]
            sbg += profile[j] * g
        det = n * sgg - sg * sg
        if det < 1e-9:
            break
        level = (sgg * sb - sg * sbg) / det
        depth = (sg * sb - n * sbg) / det
        # the place by one step of Gauss and Newton
        up, steep = 0.0, 0.0
        for j in range(first, last + 1):
            inner = 0.5 + (0.5 * width - abs(j - centre)) / soft
            if 0.0 < inner < 1.0:
                slope = math.copysign(1.0 / soft, j - centre)
                up -= slope * (profile[j] - level + depth * inner)
                steep += slope * slope
            # elsewhere the template is flat and says nothing of the place
        if steep < 1e-9 or depth <= 0.0:
            break
        step = up / (depth * steep)
        centre += min(max(step, -LONGEST_STEP), LONGEST_STEP)
        centre = min(max(centre, 0.0), columns - 1.0)
    rest, pixels, inside = 0.0, 0.0, 0.0
    for j in range(first, last + 1):
        g = min(max(0.5 + (0.5 * width - abs(j - centre)) / soft, 0.0), 1.0)
        inside += g
        for i in range(top, end):
            error = sign * image[i, j] - level + depth * g
            rest += error * error
            pixels += 1.0
    spread = math.sqrt(rest / max(pixels - 3.0, 1.0) + 1.0 / 12.0)  # and what rounding adds
    beside = max(last + 1 - first - inside, 1.0)
    out[0] = centre
    out[1] = spread / (depth * math.sqrt(rows * steep)) if depth > 0.0 and steep > 0.0 else math.inf
    out[2] = depth
    out[3] = depth / (spread * math.sqrt((1.0 / max(inside, 1.0) + 1.0 / beside) / rows))
