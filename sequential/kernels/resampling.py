"""Which particles live on: four ways to draw ancestors whose expected number is the weight times N.

Douc, Cappé, Moulines 2005, Comparison of resampling schemes for particle filtering.
"""

from __future__ import annotations

import math

from numba import types

from sequential.kernels.arrays import f1, i0, w1
from sequential.kernels.call import bare_as

__all__ = ["MULTINOMIAL", "RESIDUAL", "STRATIFIED", "SYSTEMATIC", "resample"]

SYSTEMATIC, STRATIFIED, RESIDUAL, MULTINOMIAL = range(4)


@bare_as(i0(f1, types.float64))
def find(sums, position):
    """First index whose running sum exceeds a position."""
    low, high = 0, len(sums) - 1
    while low < high:
        middle = (low + high) // 2
        if sums[middle] > position:
            high = middle
        else:
            low = middle + 1
    return low


@bare_as(types.void(f1, f1, i0, w1, types.int64[::1]))
def resample(weights, uniforms, scheme, sums, ancestors):
    """Ancestors (N,) of weights (N,) that add up to one; `uniforms` (N,), of which systematic takes one.

    `sums` (N,) is scratch.
    """
    count, taken, total = len(weights), 0, 0.0
    if scheme == RESIDUAL:
        for i in range(count):
            sure = math.floor(count * weights[i])
            for _ in range(min(sure, count - taken)):
                ancestors[taken] = i
                taken += 1
            total += count * weights[i] - sure
            sums[i] = total
    else:
        for i in range(count):
            total += weights[i]
            sums[i] = total
    if scheme == RESIDUAL or scheme == MULTINOMIAL:  # noqa: PLR1714, SIM109 - a set would be built at run time
        for i in range(taken, count):
            ancestors[i] = find(sums, uniforms[i] * total)
        return
    at = 0
    for i in range(count):
        offset = uniforms[0] if scheme == SYSTEMATIC else uniforms[i]
        position = (i + offset) / count * total
        while at < count - 1 and not sums[at] > position:
            at += 1
        ancestors[i] = at
