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

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import b0, f0, f2, i0, w2, w3

__all__ = ["align"]

P = 8
STILL_PX = 2e-3
image = numba.types.Array(numba.float32, 2, "C", readonly=True)


@inlined
def _cubic(f, w):
    """Weights of four neighbours at a fraction f past the second (Catmull and Rom)."""
    w[0] = f * (-0.5 + f * (1.0 - 0.5 * f))
    w[1] = 1.0 + f * f * (-2.5 + 1.5 * f)
    w[2] = f * (0.5 + f * (2.0 - 1.5 * f))
    w[3] = f * f * (-0.5 + 0.5 * f)


@inlined
def _cubic_slope(f, w):
    """Derivatives of those weights."""
    w[0] = -0.5 + f * (2.0 - 1.5 * f)
    w[1] = f * (-5.0 + 4.5 * f)
    w[2] = 0.5 + f * (4.0 - 4.5 * f)
    w[3] = f * (-1.0 + 1.5 * f)


@inlined
def _value(picture, x, y, wx, wy):
    """The image between its pixels, 1 to size - 2."""
    i, j = math.floor(x), math.floor(y)
    _cubic(x - i, wx)
    _cubic(y - j, wy)
    total = 0.0
    for n in range(4):
        line = picture[j - 1 + n]
        total += wy[n] * (wx[0] * line[i - 1] + wx[1] * line[i] + wx[2] * line[i + 1] + wx[3] * line[i + 2])
    return total


@inlined
def _slopes(picture, x, y, wx, wy, out):
    """Its derivatives by x and y."""
    i, j = math.floor(x), math.floor(y)
    _cubic_slope(x - i, wx)
    _cubic(y - j, wy)
    dx = 0.0
    for n in range(4):
        for m in range(4):
            dx += wy[n] * wx[m] * picture[j - 1 + n, i - 1 + m]
    _cubic(x - i, wx)
    _cubic_slope(y - j, wy)
    dy = 0.0
    for n in range(4):
        for m in range(4):
            dy += wy[n] * wx[m] * picture[j - 1 + n, i - 1 + m]
    out[0], out[1] = dx, dy


@inlined
def _inside(picture, x, y):
    return 1.0 <= x < picture.shape[1] - 2.0 and 1.0 <= y < picture.shape[0] - 2.0


@inlined
def _factor(A, L, first):
    """Cholesky of the rows and columns from `first` on; whether it exists."""
    for i in range(first, P):
        for j in range(first, i + 1):
            s = A[i, j]
            for k in range(first, j):
                s -= L[i, k] * L[j, k]
            if i == j:
                if s <= 1e-9 * A[i, i] or s <= 0.0:
                    return False
                L[i, i] = math.sqrt(s)
            else:
                L[i, j] = s / L[j, j]
    return True


@inlined
def _solve(L, first, x):
    for i in range(first, P):
        for k in range(first, i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    for i in range(P - 1, first - 1, -1):
        for k in range(i + 1, P):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]


@inlined
def _place_cov(L, G, lead, shift, noise, q, column, A, a, b, c, d, out):
    """xx, xy, yy of M d for the covariance of d in the sandwich; A is overwritten."""
    for r in range(2):
        for i in range(P):
            q[i] = 0.0
        q[shift + r] = 1.0
        _solve(L, lead, q)
        for i in range(lead, P):
            A[r, i] = q[i]
    for r in range(2):
        for s in range(r, 2):
            total = 0.0
            for i in range(lead, P):
                for j in range(lead, P):
                    total += A[r, i] * G[i, j] * A[s, j]
            column[r + s] = noise * total
    xx, xy, yy = column[0], column[1], column[2]
    out[0] = a * a * xx + 2.0 * a * b * xy + b * b * yy
    out[1] = a * c * xx + (a * d + b * c) * xy + b * d * yy
    out[2] = c * c * xx + 2.0 * c * d * xy + d * d * yy


@kernel(numba.void(image, image, f2, w2, w3, i0, b0, i0, f0, w2, w2))
def align(first, second, points, at, warps, radius, affine, most, reach, covs, facts):
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
    covs : (N, 3) px² out: xx, xy, yy in the second for residuals of the size found
    facts : (N, 4) out: correlation after the fit (-1 where it failed), iterations, gain, rms of the residuals
    """
    side = 2 * radius + 1
    J = np.empty((side * side, P))
    weight = np.empty(side * side)
    A, L, G = np.empty((P, P)), np.zeros((P, P)), np.empty((P, P))
    q, column = np.empty(P), np.empty(P)
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
        if not (_inside(first, px - radius, py - radius) and _inside(first, px + radius, py + radius)):
            continue
        A[:] = 0.0
        k = 0
        total = mean = 0.0
        for v in range(-radius, radius + 1):
            for u in range(-radius, radius + 1):
                _slopes(first, px + u, py + v, wx, wy, slope)
                w = math.exp(-spread * (u * u + v * v))
                row = J[k]
                row[shift], row[shift + 1] = slope[0], slope[1]
                if affine:
                    row[2], row[3] = slope[0] * u, slope[0] * v
                    row[4], row[5] = slope[1] * u, slope[1] * v
                row[6], row[7] = _value(first, px + u, py + v, wx, wy), 1.0
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
        if not _factor(A, L, lead):
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
                    if not _inside(second, bx, by):
                        failed = True
                        break
                    value = _value(second, bx, by, wx, wy)
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
            _solve(L, lead, q)
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
        # weights are no precisions, so the sandwich: A^-1 (sum w² J Jᵀ) A^-1
        G[:] = 0.0
        for k in range(side * side):
            for i in range(lead, P):
                for j in range(lead, i + 1):
                    G[i, j] += weight[k] * weight[k] * J[k, i] * J[k, j]
        for i in range(lead, P):
            for j in range(lead, i):
                G[j, i] = G[i, j]
        # the weighted residuals stand for as many samples as the window has room for, less the parameters
        samples = 0.0
        for k in range(side * side):
            samples += weight[k] * weight[k]
        samples = total * total / samples
        noise = cost / total * samples / max(samples - (P - lead), 1.0) / (q[6] * q[6])
        _place_cov(L, G, lead, shift, noise, q, column, A, a, b, c, d, covs[n])
