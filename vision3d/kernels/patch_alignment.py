"""Where a patch of one image lies in another, to hundredths of a pixel: Lucas and Kanade's alignment.

The light about a point of A is sought in B under an affine warp, a gain and an offset,

    B(t + M u) = g A(u + d + D u) + c      over a window of offsets u, weighted by a Gaussian,

linear in (g d, g D, g, c) with A's gradients only, so that the normal matrix of a patch is factored once
(inverse compositional; Baker and Matthews, IJCV 2004).  Then M <- M (I + D)^-1, t <- t - M d, until t rests.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from vision3d.kernels import kernel
from vision3d.kernels.arrays import b0, f0, f2, i0, w2, w3
from vision3d.kernels.cubic import inside, slopes_at, value_at
from vision3d.kernels.patch_covariance import P, correlate, factor, information, place_cov, solve

__all__ = ["align"]

STILL_PX = 2e-3
image = numba.types.Array(numba.float32, 2, "C", readonly=True)


@kernel(numba.void(image, image, f2, w2, w3, i0, b0, i0, f0, f2, w2, w2, w2))
def align(first, second, points, at, warps, radius, affine, most, reach, rho, covs, facts, lags):
    """Refine the place and the warp of every patch of the first image in the second.

    Parameters
    ----------
    first, second : grey levels, float32
    points : (N, 2) px in the first
    at : (N, 2) px in the second, in and out
    warps : (N, 2, 2) d second / d first, in and out
    radius : half the side of the window, px of the first
    affine : estimate the warp; otherwise shift, gain and offset only
    most : iterations
    reach : farthest that a patch may move, px of the second
    rho : (7, 7) correlation of residuals three pixels either way, 1 in its middle
    covs : (N, 3) px² out: xx, xy, yy in the second for residuals of the size found
    facts : (N, 4) out: correlation after the fit (-1 where it failed), iterations, gain, rms of the residuals
    lags : (7, 7) in and out: sums of the correlation that the residuals of each patch have
    """
    side = 2 * radius + 1
    J = np.empty((side * side, P))
    weight = np.empty(side * side)
    A, L = np.empty((P, P)), np.zeros((P, P))
    residual, field, along = np.empty(side * side), np.empty((2, side * side)), np.empty((2, P))
    light = np.empty(side * side)
    q, column, cov = np.empty(P), np.empty(P), np.empty(3)
    wx, wy, slope = np.empty(4), np.empty(4), np.empty(2)
    spread = 2.0 / (radius * radius)
    # parameters in order d, then D, then gain and offset; without D the order is D (unused), d, gain, offset
    lead = 0 if affine else 4
    shift = lead
    for n in range(len(points)):
        covs[n, :] = np.nan
        facts[n, 0] = -1.0
        facts[n, 1] = facts[n, 2] = facts[n, 3] = 0.0
        px, py = points[n, 0], points[n, 1]
        if not (inside(first, px - radius, py - radius) and inside(first, px + radius, py + radius)):
            continue
        A[:] = 0.0
        k = 0
        total = mean = 0.0
        for v in range(-radius, radius + 1):
            for u in range(-radius, radius + 1):
                slopes_at(first, px + u, py + v, wx, wy, slope)
                w = math.exp(-spread * (u * u + v * v))
                row = J[k]
                row[shift], row[shift + 1] = slope[0], slope[1]
                if affine:
                    row[2], row[3] = slope[0] * u, slope[0] * v
                    row[4], row[5] = slope[1] * u, slope[1] * v
                row[6], row[7] = value_at(first, px + u, py + v, wx, wy), 1.0
                weight[k] = w
                total += w
                mean += w * row[6]
                k += 1
        mean /= total
        for k in range(side * side):
            J[k, 6] -= mean
            for i in range(lead, P):
                for j in range(lead, i + 1):
                    A[i, j] += weight[k] * J[k, i] * J[k, j]
        if not factor(A, L, lead):
            continue
        x0, y0 = at[n, 0], at[n, 1]
        x, y = x0, y0
        a, b, c, d = warps[n, 0, 0], warps[n, 0, 1], warps[n, 1, 0], warps[n, 1, 1]
        settled = False
        failed = False
        steps = 0
        cost = energy = level = 0.0
        while steps < most:
            steps += 1
            q[:] = 0.0
            k = 0
            energy = level = 0.0
            for v in range(-radius, radius + 1):
                for u in range(-radius, radius + 1):
                    bx, by = x + a * u + b * v, y + c * u + d * v
                    if not inside(second, bx, by):
                        failed = True
                        break
                    value = value_at(second, bx, by, wx, wy)
                    light[k] = value
                    w = weight[k] * value
                    energy += w * value
                    level += w
                    for i in range(lead, P):
                        q[i] += w * J[k, i]
                    k += 1
                if failed:
                    break
            if failed:
                break
            cost = energy
            for i in range(lead, P):
                column[i] = q[i]
            solve(L, lead, q)
            for i in range(lead, P):
                cost -= column[i] * q[i]
            g = q[6]
            if g < 0.05:
                failed = True
                break
            dx, dy = q[shift] / g, q[shift + 1] / g
            if affine:
                e, f, h, m = 1.0 + q[2] / g, q[3] / g, q[4] / g, 1.0 + q[5] / g
                det = e * m - f * h
                if not 0.25 < det < 4.0:
                    failed = True
                    break
                a, b, c, d = (
                    (a * m - b * h) / det, (b * e - a * f) / det, (c * m - d * h) / det, (d * e - c * f) / det
                )  # fmt: skip
            mx, my = a * dx + b * dy, c * dx + d * dy
            x -= mx
            y -= my
            if (x - x0) ** 2 + (y - y0) ** 2 > reach * reach:
                failed = True
                break
            if mx * mx + my * my < STILL_PX * STILL_PX:
                settled = True
                break
        facts[n, 1] = steps
        if failed or not settled:
            continue
        # what the last fit leaves, against the variance there was to explain
        variance = max(energy - level * level / total, 1e-12)
        cost = max(cost, 0.0)
        facts[n, 0] = math.sqrt(max(0.0, 1.0 - cost / variance))
        facts[n, 2] = q[6]
        facts[n, 3] = math.sqrt(cost / total)
        at[n, 0], at[n, 1] = x, y
        warps[n, 0, 0], warps[n, 0, 1], warps[n, 1, 0], warps[n, 1, 1] = a, b, c, d
        for k in range(side * side):
            residual[k] = light[k]
            for i in range(lead, P):
                residual[k] -= q[i] * J[k, i]
        correlate(residual, weight, side, lags)
        if not information(second, x, y, warps[n], q[6], J, weight, radius, lead, shift, wx, wy, slope, A, L):
            facts[n, 0] = -1.0
            continue
        # weights are no precisions and residuals no white noise, so the sandwich
        plain = place_cov(L, J, weight, side, lead, shift, rho, along, field, cov)
        # every parameter takes about as much of the cost as the two of the place do
        taken = (P - lead) * max(cov[0] + cov[2], 0.0) / plain
        noise = cost / max(total - taken, 0.25 * total) / (q[6] * q[6])
        xx, xy, yy = noise * cov[0], noise * cov[1], noise * cov[2]
        covs[n, 0] = a * a * xx + 2.0 * a * b * xy + b * b * yy
        covs[n, 1] = a * c * xx + (a * d + b * c) * xy + b * d * yy
        covs[n, 2] = c * c * xx + 2.0 * c * d * xy + d * d * yy
