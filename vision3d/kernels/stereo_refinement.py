"""Disparity between pixels, and its variance, by least squares on the levels of a window."""

from __future__ import annotations

import numpy as np
from numba import boolean, float32, float64, int64, types, void

from vision3d.kernels import inlined, kernel

__all__ = ["facet_residuals", "refine_disparity"]

_F32_2 = types.Array(float32, 2, "C", readonly=True)
_OUT = float32[:, ::1]
_BOOL_2 = types.Array(boolean, 2, "C", readonly=True)


@inlined
def _facet(start, wanted, y, x, half, same_px, sums, facet):
    """Plane ``c + a (x' - x) + b (y' - y)`` through the disparities of a pixel's surface; how many."""
    height, width = start.shape
    centre = start[y, x]
    sums[:] = 0.0
    for yy in range(max(0, y - half), min(height, y + half + 1)):
        for xx in range(max(0, x - half), min(width, x + half + 1)):
            d = start[yy, xx] - centre
            if not wanted[yy, xx] or abs(d) > same_px:
                continue
            u, v = xx - x, yy - y
            sums[0] += 1.0
            sums[1] += u
            sums[2] += v
            sums[3] += u * u
            sums[4] += u * v
            sums[5] += v * v
            sums[6] += d
            sums[7] += u * d
            sums[8] += v * d
    n = sums[0]
    suu, suv, svv = sums[3] - sums[1] ** 2 / n, sums[4] - sums[1] * sums[2] / n, sums[5] - sums[2] ** 2 / n
    sud, svd = sums[7] - sums[1] * sums[6] / n, sums[8] - sums[2] * sums[6] / n
    bottom = suu * svv - suv * suv
    facet[1], facet[2] = 0.0, 0.0
    if n >= 6 and bottom > 1e-6 * (suu + svv) ** 2:
        facet[1] = (svv * sud - suv * svd) / bottom
        facet[2] = (suu * svd - suv * sud) / bottom
    facet[0] = centre + (sums[6] - facet[1] * sums[1] - facet[2] * sums[2]) / n
    return n


@kernel(
    void(_F32_2, _F32_2, _F32_2, _F32_2, _BOOL_2, int64, int64, float64, float64, _OUT, _OUT)
)  # fmt: skip
def refine_disparity(a, b, slope_a, start, wanted, half, rounds, same_px, prior_px, out, variance):
    """Shift b until each window of a (h, w) agrees with it (Lucas and Kanade 1981; Baker and Matthews 2004).

    Neighbours on the same surface take part (their disparity in `start` differs by less than `same_px`), on
    the plane through their disparities and a common shift of it, with a common offset of brightness; `start`
    itself is known to `prior_px`.  `slope_a` are central differences of a along x: its noise and that of a's
    level are not the same pixels', so neither pulls.  `variance` (h, w), px², is that of the shift; NaN where
    nothing was done.
    """
    height, width = a.shape
    known = 1.0 / (prior_px * prior_px)
    sums, facet = np.empty(9), np.empty(3)
    for y in range(height):
        for x in range(width):
            out[y, x] = start[y, x]
            variance[y, x] = np.nan
            if not wanted[y, x]:
                continue
            _facet(start, wanted, y, x, half, same_px, sums, facet)
            shift, spread = 0.0, 1.0 / known
            for _ in range(rounds):
                n, sg, sr, sgg, sgr, srr = 0, 0.0, 0.0, 0.0, 0.0, 0.0
                for yy in range(max(0, y - half), min(height, y + half + 1)):
                    for xx in range(max(0, x - half), min(width, x + half + 1)):
                        if not wanted[yy, xx] or abs(start[yy, xx] - start[y, x]) > same_px:
                            continue
                        at = xx - (facet[0] + facet[1] * (xx - x) + facet[2] * (yy - y)) - shift
                        k = int(np.floor(at))
                        if k < 0 or k + 1 >= width:
                            continue
                        f = at - k
                        r = a[yy, xx] - ((1.0 - f) * b[yy, k] + f * b[yy, k + 1])
                        g = slope_a[yy, xx]
                        n += 1
                        sg += g
                        sr += r
                        sgg += g * g
                        sgr += g * r
                        srr += r * r
                if n < 8:
                    break
                noise = max((srr - sr * sr / n) / (n - 1), 0.25)
                # half of the noise is a's, and half of its variance that of its slope
                seen = max(sgg - sg * sg / n - 0.25 * noise * (n - 1), 0.0)
                weight = seen / noise + known
                # b moves by -shift: its level changes by -g per pixel, so the residual by +g
                step = -((sgr - sg * sr / n) / noise + shift * known) / weight
                step = min(max(step, -0.5), 0.5)
                shift += step
                spread = 1.0 / weight
                if abs(step) < 0.005:
                    break
            if abs(shift) > 1.0:
                shift, spread = 0.0, 1.0 / known
            out[y, x] = facet[0] + shift
            variance[y, x] = spread


@kernel(void(_F32_2, _BOOL_2, int64, int64, float64, float64, _OUT))
def facet_residuals(disparity, wanted, stride, half, same_px, least_share, out):
    """How far every stride-th pixel lies off the plane through its surface in a window; NaN elsewhere.

    Only where at least `least_share` of the window belongs to one surface.
    """
    height, width = disparity.shape
    sums, facet = np.empty(9), np.empty(3)
    least = least_share * (2 * half + 1) ** 2
    out[:] = np.nan
    for y in range(0, height, stride):
        for x in range(0, width, stride):
            if wanted[y, x] and _facet(disparity, wanted, y, x, half, same_px, sums, facet) >= least:
                out[y, x] = disparity[y, x] - facet[0]
