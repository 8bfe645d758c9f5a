"""Whether the points of one view lie as the points of a board can: a plane seen through a radial distortion.

The model has the eight numbers of a homography, four of a radial distortion, and its centre, expected
near the middle of the image; fitted to the view alone, robustly, what is left of each corner is its residual.
It needs no camera, so that it can be said of a single image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.detection.lattice import Array

__all__ = ["Smooth", "fit_smooth"]

RADIAL_FROM = 20
"""Points from which the distortion is fitted as well."""
STEPS, ROBUST_STEPS = 40, 8
"""Least squares to its end first: points that a half-way model cannot explain would lose their weight."""
MOST_FREE = 0.9
BEND = 2.0
PRIOR_PX = 0.05
"""A centre off the middle by a quarter of the image's radius weighs as much as this error of a point."""


@dataclass(frozen=True, slots=True)
class Smooth:
    """What is left of each point, and how much of it is the fit's own doing.

    Attributes
    ----------
    residuals : (N, 2) px
    leverage : (N,) between 0 (the point decides nothing) and 1 (the fit follows it)
    scale_px : standard deviation of a coordinate, from the middle of the residuals
    parameters, origin, unit, middle, radius : of the model, for `at`
    """

    residuals: Array
    leverage: Array
    scale_px: float
    parameters: Array
    origin: Array
    unit: float
    middle: Array
    radius: float

    def at(self, plane: Array) -> Array:
        """Where the model puts points (N, 2) of the board's plane, (N, 2) px."""
        xy = (plane - self.origin) / self.unit
        r, _ = _linearise(self.parameters, xy, np.zeros_like(xy), 8)
        return self.middle - r * self.radius


def fit_smooth(points: Array, pixels: Array, size: tuple[int, int], bend: float = BEND) -> Smooth | None:
    """Fit the model to points (N, 3) m and pixels (N, 2); None for fewer than four.

    `bend` is the standard deviation of the coefficients of the distortion, at the corners of the image.
    """
    n = len(pixels)
    if n < 4:
        return None
    origin = points[:, :2].mean(axis=0)
    unit = max(float(np.abs(points[:, :2] - origin).max()), 1e-12)
    flat = (points[:, :2] - origin) / unit
    middle, radius = 0.5 * (np.array(size, dtype=np.float64) - 1.0), 0.5 * float(np.hypot(*size))
    target = (pixels - middle) / radius
    free = 14 if n >= RADIAL_FROM else 8
    q = np.concatenate([_homography(flat, target), np.zeros(6)])
    prior = np.zeros(free)
    prior[8:] = (PRIOR_PX / radius / np.array([bend, bend, bend, bend, 0.25, 0.25])[: free - 8]) ** 2
    weights = np.ones(n)
    q = _solved(q, flat, target, weights, prior)
    for _ in range(ROBUST_STEPS):
        r, _ = _linearise(q, flat, target, free)
        scale = max(_scale(r, n, free), 1e-7)
        weights = _tukey(np.linalg.norm(r, axis=1) / (scale * 4.685))
        if weights.min() > 0.3:
            break  # nothing sticks out
        q = _solved(q, flat, target, weights, prior)
    r, J = _linearise(q, flat, target, free)
    inverse = np.linalg.pinv(np.einsum("n,nik,nil->kl", weights, J, J) + np.diag(prior), rcond=1e-14)
    hat = np.einsum("n,nik,kl,nil->n", weights, J, inverse, J) / 2.0
    return Smooth(
        r * radius, np.clip(hat, 0.0, MOST_FREE), _scale(r, n, free) * radius, q, origin, unit, middle, radius
    )


def _solved(q: Array, xy: Array, target: Array, weights: Array, prior: Array) -> Array:
    """Levenberg-Marquardt from q to the least of the weighted squares and the prior."""
    free = len(prior)

    def linearised(at: Array) -> tuple[Array, Array, float]:
        r, J = _linearise(at, xy, target, free)
        cost = float(np.einsum("n,ni,ni->", weights, r, r) + prior @ at[:free] ** 2)
        return r, J, cost

    r, J, cost = linearised(q)
    damping = 1e-4
    for _ in range(STEPS):
        A = np.einsum("n,nik,nil->kl", weights, J, J) + np.diag(prior)
        g = np.einsum("n,nik,ni->k", weights, J, r) - prior * q[:free]
        tried = q.copy()
        tried[:free] += np.linalg.solve(A + np.diag(damping * np.diag(A) + 1e-15), g)
        r_new, J_new, new = linearised(tried)
        if new <= cost:
            q, r, J, damping = tried, r_new, J_new, max(0.1 * damping, 1e-9)
            if cost - new <= 1e-6 * cost:
                break
            cost = new
        elif (damping := 10.0 * damping) > 1e6:
            break
    return q


def _homography(xy: Array, target: Array) -> Array:
    """Eight numbers of the homography that takes xy to target, last entry 1, by least squares."""
    x, y = xy.T
    one, nil = np.ones_like(x), np.zeros_like(x)
    rows = []
    for k in range(2):
        t = target[:, k]
        head = [x, y, one, nil, nil, nil] if k == 0 else [nil, nil, nil, x, y, one]
        rows.append(np.stack([*head, -t * x, -t * y], axis=1))
    solution: Array = np.linalg.lstsq(np.concatenate(rows), target.T.reshape(-1), rcond=None)[0]
    return solution


def _linearise(q: Array, xy: Array, target: Array, free: int) -> tuple[Array, Array]:
    """Residual target - model (N, 2) and the Jacobian of the model (N, 2, free)."""
    x, y = xy.T
    depth = q[6] * x + q[7] * y + 1.0
    u, v = (q[0] * x + q[1] * y + q[2]) / depth, (q[3] * x + q[4] * y + q[5]) / depth
    a, b = u - q[12], v - q[13]
    rho = a * a + b * b
    above, below = 1.0 + rho * (q[8] + rho * q[9]), np.maximum(1.0 + rho * (q[10] + rho * q[11]), 0.1)
    gain = above / below
    slope = 2.0 * (q[8] + 2.0 * rho * q[9] - gain * (q[10] + 2.0 * rho * q[11])) / below
    one, nil = np.ones_like(x), np.zeros_like(x)
    du = np.stack([x, y, one, nil, nil, nil, -u * x, -u * y], axis=1) / depth[:, None]
    dv = np.stack([nil, nil, nil, x, y, one, -v * x, -v * y], axis=1) / depth[:, None]
    along = a[:, None] * du + b[:, None] * dv
    J = np.empty((len(x), 2, 14))
    J[:, 0, :8] = gain[:, None] * du + (slope * a)[:, None] * along
    J[:, 1, :8] = gain[:, None] * dv + (slope * b)[:, None] * along
    for k, part in enumerate((rho, rho**2, -gain * rho, -gain * rho**2)):
        J[:, 0, 8 + k], J[:, 1, 8 + k] = a * part / below, b * part / below
    for k, (e, f) in enumerate(((1.0, 0.0), (0.0, 1.0))):
        toward = slope * (a * e + b * f)
        J[:, 0, 12 + k] = e * (1.0 - gain) - a * toward
        J[:, 1, 12 + k] = f * (1.0 - gain) - b * toward
    model = np.stack([q[12] + gain * a, q[13] + gain * b], axis=1)
    return target - model, J[:, :, :free]


def _scale(r: Array, n: int, free: int) -> float:
    """Standard deviation of a coordinate from the median of the absolute residuals."""
    freedom = max((2 * n - free) / (2 * n), 0.1)
    return float(1.4826 * np.median(np.abs(r)) / np.sqrt(freedom))


def _tukey(distance: NDArray[np.float64]) -> Array:
    """Tukey's biweight of a distance in cuts."""
    inside = np.clip(1.0 - distance**2, 0.0, 1.0)
    weights: Array = np.maximum(inside**2, 1e-6)
    return weights
