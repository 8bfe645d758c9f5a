"""Medians of disparity that keep to the edges of the picture."""

from __future__ import annotations

import numpy as np
from numba import boolean, float32, int64, types, uint8, void

from vision3d.kernels import kernel

__all__ = ["weighted_median"]

_F32_1 = types.Array(float32, 1, "C", readonly=True)
_F32_2 = types.Array(float32, 2, "C", readonly=True)
_BOOL_2 = types.Array(boolean, 2, "C", readonly=True)
_U8_3 = types.Array(uint8, 3, "C", readonly=True)


@kernel(void(_F32_2, _BOOL_2, _U8_3, int64, _F32_1, float32[:, ::1]))
def weighted_median(disparity, wanted, guide, half, weight_of, out):
    """Median of the window where `wanted`, each neighbour weighing by how its colour differs.

    `weight_of` (256·channels,) is the weight of a sum of differences over the channels of `guide`.
    """
    height, width, channels = guide.shape
    most = (2 * half + 1) ** 2
    values, weights = np.empty(most), np.empty(most)
    for y in range(height):
        for x in range(width):
            if not wanted[y, x]:
                out[y, x] = disparity[y, x]
                continue
            count, total = 0, 0.0
            for yy in range(max(0, y - half), min(height, y + half + 1)):
                for xx in range(max(0, x - half), min(width, x + half + 1)):
                    value = disparity[yy, xx]
                    if np.isnan(value):
                        continue
                    step = 0
                    for c in range(channels):
                        step += abs(np.int64(guide[y, x, c]) - np.int64(guide[yy, xx, c]))
                    values[count] = value
                    weights[count] = weight_of[step]
                    total += weights[count]
                    count += 1
            if count == 0:
                out[y, x] = np.nan
                continue
            order = np.argsort(values[:count])
            so_far = 0.0
            for k in range(count):
                so_far += weights[order[k]]
                if so_far >= 0.5 * total:
                    out[y, x] = values[order[k]]
                    break
