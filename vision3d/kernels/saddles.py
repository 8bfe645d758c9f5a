"""Corners of a checkerboard to a hundredth of a pixel: a blurred saddle fitted to the pixels around each.

The model of the light around a corner (x0, y0), u = x - x0, v = y - y0, is

    I = (m + h erf(d1 / (s sqrt 2)) erf(d2 / (s sqrt 2))) (1 + gx u + gy v)
    di = u cos ai + v sin ai + bi ti² / 2        ti = -u sin ai + v cos ai

two edges with normals at the angles a1, a2, blurred by a Gaussian of standard deviation s, between light
m + h and m - h, under a light that changes linearly.  The bends b1, b2 of the edges are given: they come from
the neighbours on the board.  The rest is fitted by Levenberg-Marquardt, corner by corner.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from vision3d.kernels import inlined, kernel
from vision3d.kernels.window_fit import covariance, fit_window

__all__ = ["fit_saddles"]

P = 9
SHARPEST, BLURRED = 0.45, 8.0  # px; below the first, pixels beside an edge say nothing of where it is
ROOT2 = math.sqrt(2.0)


@inlined
def _model(q, b1, b2, x, y, row):
    """Light of the model at a pixel; its derivatives by the nine parameters go to row."""
    u, v, s = x - q[0], y - q[1], q[4]
    c1, s1, c2, s2 = math.cos(q[2]), math.sin(q[2]), math.cos(q[3]), math.sin(q[3])
    t1, t2 = v * c1 - u * s1, v * c2 - u * s2
    d1 = u * c1 + v * s1 + 0.5 * b1 * t1 * t1
    d2 = u * c2 + v * s2 + 0.5 * b2 * t2 * t2
    e1, e2 = math.erf(d1 / (s * ROOT2)), math.erf(d2 / (s * ROOT2))
    k = math.sqrt(2.0 / math.pi) / s
    f1, f2 = k * math.exp(-0.5 * d1 * d1 / (s * s)), k * math.exp(-0.5 * d2 * d2 / (s * s))
    light = 1.0 + q[7] * u + q[8] * v
    flat = q[5] + q[6] * e1 * e2
    # derivatives of the distances by u and v
    d1u, d1v = c1 - b1 * t1 * s1, s1 + b1 * t1 * c1
    d2u, d2v = c2 - b2 * t2 * s2, s2 + b2 * t2 * c2
    a, b = q[6] * f1 * e2, q[6] * e1 * f2
    row[0] = -((a * d1u + b * d2u) * light + flat * q[7])
    row[1] = -((a * d1v + b * d2v) * light + flat * q[8])
    # turning the normal by da moves d by t and t by -(u c + v s)
    row[2] = a * (t1 - b1 * t1 * (u * c1 + v * s1)) * light
    row[3] = b * (t2 - b2 * t2 * (u * c2 + v * s2)) * light
    row[4] = -(a * d1 + b * d2) / s * light
    row[5] = light
    row[6] = e1 * e2 * light
    row[7] = flat * u
    row[8] = flat * v
    return flat * light


@inlined
def _inside(u, v, axes, half, inset, reach):
    """Whether an offset lies in the parallelogram of half-width `half`, in its cross, and in the circle."""
    if u * u + v * v > reach * reach:
        return False
    det = axes[0, 0] * axes[1, 1] - axes[0, 1] * axes[1, 0]
    alpha = (u * axes[1, 1] - v * axes[1, 0]) / det
    beta = (v * axes[0, 0] - u * axes[0, 1]) / det
    alpha, beta = abs(alpha), abs(beta)
    return alpha <= half and beta <= half and min(alpha, beta) <= inset


@inlined
def _gather(image, cx, cy, axes, half, inset, reach, px, py, value):
    """Pixels of the window around (cx, cy) that lie in the image; their number."""
    h, w = image.shape
    r = math.ceil(reach)
    x0, y0 = round(cx), round(cy)
    n = 0
    for y in range(max(0, y0 - r), min(h, y0 + r + 1)):
        for x in range(max(0, x0 - r), min(w, x0 + r + 1)):
            if _inside(x - cx, y - cy, axes, half, inset, reach):
                px[n], py[n], value[n] = x, y, image[y, x]
                n += 1
    return n


@inlined
def _start(q, cx, cy, axes, n, px, py, value):
    """Edges along the board's axes, light and contrast from the pixels of the two pairs of quadrants."""
    q[0], q[1] = cx, cy
    q[2] = math.atan2(axes[0, 0], -axes[0, 1])
    q[3] = math.atan2(axes[1, 0], -axes[1, 1])
    c1, s1, c2, s2 = math.cos(q[2]), math.sin(q[2]), math.cos(q[3]), math.sin(q[3])
    plus = minus = 0.0
    np_, nm = 0, 0
    for i in range(n):
        u, v = px[i] - cx, py[i] - cy
        if (u * c1 + v * s1) * (u * c2 + v * s2) > 0.0:
            plus += value[i]
            np_ += 1
        else:
            minus += value[i]
            nm += 1
    if np_ > 0:
        plus /= np_
    if nm > 0:
        minus /= nm
    q[4] = 1.0
    q[5] = 0.5 * (plus + minus)
    q[6] = 0.7 * (plus - minus)
    q[7] = q[8] = 0.0


@kernel(
    numba.void(
        numba.float32[:, ::1], numba.float64[:, ::1], numba.float64[:, :, ::1], numba.float64[:, ::1],
        numba.float64, numba.float64, numba.float64, numba.float64[:, ::1], numba.float64[:, ::1],
        numba.float64[:, ::1],
    )
)  # fmt: skip
def fit_saddles(image, starts, axes, bends, half, inset, reach, corners, covs, facts):
    """Fit a saddle at every start.

    Parameters
    ----------
    image : (h, w) grey values
    starts : (N, 2) px
    axes : (N, 2, 2) the vectors in px from the corner to its neighbours along the board's x and y
    bends : (N, 2) 1/px curvature of the edges along x and along y, towards their normals
    half : half-width of the window in spacings
    inset : how far from the nearer edge a pixel may be, in spacings: less than `half` leaves a cross, which
        keeps what is printed inside the squares out
    reach : largest radius of the window in px
    corners : (N, 2) px out; NaN where the fit failed
    covs : (N, 3) px² out: xx, xy, yy for residuals of the size found
    facts : (N, 5) out: rms of the residuals, h, s, pixels used, px moved from the start
    """
    size = (2 * math.ceil(reach) + 3) ** 2
    px, py, value = np.empty(size), np.empty(size), np.empty(size)
    q, work = np.empty(P), np.empty((4, P))
    A, D, L = np.empty((P, P)), np.empty((P, P)), np.zeros((P, P))
    for c in range(len(starts)):
        corners[c, :] = np.nan
        covs[c, :] = np.nan
        facts[c, :] = np.nan
        cx, cy = starts[c, 0], starts[c, 1]
        b1, b2 = bends[c, 0], bends[c, 1]
        n = _gather(image, cx, cy, axes[c], half, inset, reach, px, py, value)
        facts[c, 3] = n
        if n < 2 * P:
            continue
        _start(q, cx, cy, axes[c], n, px, py, value)
        cost = fit_window(_model, q, b1, b2, n, px, py, value, 4, SHARPEST, BLURRED, reach, work, A, D, L)
        if cost < 0.0:
            continue
        variance = cost / (n - P)
        if not covariance(_model, q, b1, b2, n, px, py, value, 4, SHARPEST, variance, work, A, L, covs[c]):
            continue
        corners[c, 0], corners[c, 1] = q[0], q[1]
        facts[c, 0] = math.sqrt(variance)
        facts[c, 1] = q[6]
        facts[c, 2] = q[4]
        facts[c, 4] = math.hypot(q[0] - cx, q[1] - cy)
