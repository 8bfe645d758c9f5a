"""Centres of discs to a hundredth of a pixel: a blurred ellipse fitted to the pixels around its border.

The model of the light around a disc, u = x - x0, v = y - y0, is

    I = (m + h erf(d / (s sqrt 2))) (1 + gx u + gy v)
    d = (rho - 1) rho / |M (u, v)|        rho² = (u, v) M (u, v)ᵀ        M = [[a, b], [b, c]]

d being the distance from the ellipse to first order.  The disc is dark where h > 0.  The derivatives leave
out those of the scale of d, which vanish on the border; the model is even about the centre, so that this
costs steps, not accuracy.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from vision3d.kernels import inlined, kernel
from vision3d.kernels.window_fit import covariance, fit_window

__all__ = ["fit_discs"]

P = 10
ROOT2 = math.sqrt(2.0)
SHARPEST, BLURRED = 0.45, 8.0  # px


@inlined
def _model(q, unused, unused_too, x, y, row):
    """Light of the model at a pixel; its derivatives by the ten parameters go to row."""
    u, v, s = x - q[0], y - q[1], q[5]
    mu, mv = q[2] * u + q[3] * v, q[3] * u + q[4] * v
    rho = math.sqrt(max(u * mu + v * mv, 1e-12))
    steep = max(math.sqrt(mu * mu + mv * mv) / rho, 1e-9)
    d = (rho - 1.0) / steep
    e = math.erf(d / (s * ROOT2))
    f = math.sqrt(2.0 / math.pi) / s * math.exp(-0.5 * d * d / (s * s))
    light = 1.0 + q[8] * u + q[9] * v
    flat = q[6] + q[7] * e
    k = q[7] * f / steep * light
    row[0] = -k * mu / rho - flat * q[8]
    row[1] = -k * mv / rho - flat * q[9]
    row[2] = k * u * u / (2.0 * rho)
    row[3] = k * u * v / rho
    row[4] = k * v * v / (2.0 * rho)
    row[5] = -q[7] * f * d / s * light
    row[6] = light
    row[7] = e * light
    row[8] = flat * u
    row[9] = flat * v
    return flat * light


@inlined
def _gather(image, cx, cy, shape, outer, border, px, py, value):
    """Pixels near the border of the expected ellipse, out to `outer` radii; their number."""
    h, w = image.shape
    det = shape[0] * shape[2] - shape[1] * shape[1]
    rx, ry = math.sqrt(shape[2] / det) * outer, math.sqrt(shape[0] / det) * outer
    n = 0
    for y in range(max(0, math.ceil(cy - ry)), min(h, math.floor(cy + ry) + 1)):
        for x in range(max(0, math.ceil(cx - rx)), min(w, math.floor(cx + rx) + 1)):
            u, v = x - cx, y - cy
            mu, mv = shape[0] * u + shape[1] * v, shape[1] * u + shape[2] * v
            rho = math.sqrt(max(u * mu + v * mv, 1e-12))
            d = (rho - 1.0) * rho / max(math.sqrt(mu * mu + mv * mv), 1e-12)
            if rho <= outer and abs(d) <= border and n < len(px):
                px[n], py[n], value[n] = x, y, image[y, x]
                n += 1
    return n


@inlined
def _start(q, cx, cy, shape, n, px, py, value):
    """The expected ellipse, with the light inside and outside it."""
    q[0], q[1] = cx, cy
    q[2], q[3], q[4] = shape[0], shape[1], shape[2]
    inside = outside = 0.0
    ni, no = 0, 0
    for i in range(n):
        u, v = px[i] - cx, py[i] - cy
        if shape[0] * u * u + 2.0 * shape[1] * u * v + shape[2] * v * v < 1.0:
            inside += value[i]
            ni += 1
        else:
            outside += value[i]
            no += 1
    inside /= max(ni, 1)
    outside /= max(no, 1)
    q[5] = 1.0
    q[6], q[7] = 0.5 * (outside + inside), 0.5 * (outside - inside)
    q[8] = q[9] = 0.0


@kernel(
    numba.void(
        numba.float32[:, ::1], numba.float64[:, ::1], numba.float64[:, ::1], numba.float64,
        numba.float64, numba.float64[:, ::1], numba.float64[:, ::1], numba.float64[:, ::1],
    )
)  # fmt: skip
def fit_discs(image, starts, shapes, outer, border, centres, covs, facts):
    """Fit an ellipse at every start.

    Parameters
    ----------
    image : (h, w) grey values
    starts : (N, 2) px
    shapes : (N, 3) 1/px² expected M of the ellipses: a, b, c
    outer : how far out pixels are looked at, in radii
    border : how far from the border of the ellipse pixels are looked at, in px
    centres : (N, 2) px out, of the ellipses; NaN where the fit failed
    covs : (N, 3) px² out: xx, xy, yy for residuals of the size found
    facts : (N, 8) out: rms of the residuals, h, s, pixels used, px moved from the start, M of the ellipse
    """
    largest = 0
    for c in range(len(starts)):
        det = shapes[c, 0] * shapes[c, 2] - shapes[c, 1] ** 2
        area = (
            4.0
            * (math.sqrt(shapes[c, 2] / det) * outer + 1.0)
            * (math.sqrt(shapes[c, 0] / det) * outer + 1.0)
        )
        largest = max(largest, math.ceil(area))
    px, py, value = np.empty(largest), np.empty(largest), np.empty(largest)
    q, work = np.empty(P), np.empty((4, P))
    A, D, L = np.empty((P, P)), np.empty((P, P)), np.zeros((P, P))
    for c in range(len(starts)):
        centres[c, :] = np.nan
        covs[c, :] = np.nan
        facts[c, :] = np.nan
        cx, cy = starts[c, 0], starts[c, 1]
        n = _gather(image, cx, cy, shapes[c], outer, border, px, py, value)
        facts[c, 3] = n
        if n < 2 * P:
            continue
        _start(q, cx, cy, shapes[c], n, px, py, value)
        radius = 1.0 / math.sqrt(math.sqrt(max(shapes[c, 0] * shapes[c, 2] - shapes[c, 1] ** 2, 1e-12)))
        cost = fit_window(_model, q, 0.0, 0.0, n, px, py, value, 5, SHARPEST, BLURRED, radius, work, A, D, L)
        if cost < 0.0:
            continue
        variance = cost / (n - P)
        if not covariance(_model, q, 0.0, 0.0, n, px, py, value, 5, SHARPEST, variance, work, A, L, covs[c]):
            continue
        centres[c, 0], centres[c, 1] = q[0], q[1]
        facts[c, 0] = math.sqrt(variance)
        facts[c, 1] = q[7]
        facts[c, 2] = q[5]
        facts[c, 4] = math.hypot(q[0] - cx, q[1] - cy)
        facts[c, 5], facts[c, 6], facts[c, 7] = q[2], q[3], q[4]
