"""Disparity between pixels, and its variance, by least squares on the levels of a window."""

from __future__ import annotations

import numpy as np
from numba import boolean, float32, float64, int64, types, void

from vision3d.kernels import kernel

__all__ = ["refine_disparity"]

_F32_2 = types.Array(float32, 2, "C", readonly=True)
_OUT = float32[:, ::1]
_BOOL_2 = types.Array(boolean, 2, "C", readonly=True)


@kernel(
    void(_F32_2, _F32_2, _F32_2, _F32_2, _BOOL_2, int64, int64, float64, float64, _OUT, _OUT)
)  # fmt: skip
def refine_disparity(a, b, slope_b, start, wanted, half, rounds, same_px, prior_px, out, variance):
    """Shift each window of a (h, w) onto b until their levels agree (Lucas and Kanade 1981).

    Neighbours on the same surface take part (their disparity in `start` differs by less than `same_px`), each
    at its own disparity plus a common shift, with a common offset of brightness; `start` itself is known to
    `prior_px`.  `variance` (h, w), px², is that of the shift; NaN where nothing was done.
    """
    height, width = a.shape
    known = 1.0 / (prior_px * prior_px)
    for y in range(height):
        for x in range(width):
            out[y, x] = start[y, x]
            variance[y, x] = np.nan
            if not wanted[y, x]:
                continue
            shift, spread = 0.0, 1.0 / known
            centre = start[y, x]
            for _ in range(rounds):
                n, sg, sr, sgg, sgr, srr = 0, 0.0, 0.0, 0.0, 0.0, 0.0
                for yy in range(max(0, y - half), min(height, y + half + 1)):
                    for xx in range(max(0, x - half), min(width, x + half + 1)):
                        if not wanted[yy, xx] or abs(start[yy, xx] - centre) > same_px:
                            continue
                        at = xx - start[yy, xx] - shift
                        k = int(np.floor(at))
                        if k < 0 or k + 1 >= width:
                            continue
                        f = at - k
                        r = a[yy, xx] - ((1.0 - f) * b[yy, k] + f * b[yy, k + 1])
                        g = (1.0 - f) * slope_b[yy, k] + f * slope_b[yy, k + 1]
                        n += 1
                        sg += g
                        sr += r
                        sgg += g * g
                        sgr += g * r
                        srr += r * r
                if n < 8:
                    break
                noise = max((srr - sr * sr / n) / (n - 1), 0.25)
                weight = (sgg - sg * sg / n) / noise + known
                # b moves by -shift: its level changes by -g per pixel, so the residual by +g
                step = -((sgr - sg * sr / n) / noise + shift * known) / weight
                step = min(max(step, -0.5), 0.5)
                shift += step
                spread = 1.0 / weight
                if abs(step) < 0.005:
                    break
            if abs(shift) > 1.0:
                shift, spread = 0.0, 1.0 / known
            out[y, x] = centre + shift
            variance[y, x] = spread
