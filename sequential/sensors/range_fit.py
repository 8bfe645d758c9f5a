"""Least squares of v = a / (d + b) + c: a start by scanning b, Gauss-Newton steps, and outliers left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotConvergedError, UnderConstrainedError

__all__ = ["NAMES", "curve", "curve_jacobian", "fit_curve", "foreign_rows", "inverse_curve", "starting_curve"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
NAMES = ("a", "b", "c")
SCAN = 80
STEPS, SETTLED = 100, 1e-10
FOREIGN = 0.01  # probability that a good table loses a row
STRAIGHT = 10.0  # times the width of the table: a pole as far away as that cannot be told from a line
NO_BEND = (
    "these readings do not bend: a straight line leaves b of v = a/(d+b)+c free; measure over a wider range "
    "of distances, short ones above all"
)
SPARED = 0.2  # share of rows that may leave


def curve(parameters: Array, d: Array) -> Array:
    """Reading at distances d: a / (d + b) + c."""
    a, b, c = parameters
    return np.asarray(a / (d + b) + c)


def inverse_curve(parameters: Array, v: Array) -> Array:
    """Distance at readings v: a / (v - c) - b; NaN at or beyond the asymptote c."""
    a, b, c = parameters
    beyond = (v - c) * np.sign(a) <= 0
    return np.asarray(np.where(beyond, np.nan, a / np.where(beyond, np.nan, v - c) - b))


def curve_jacobian(parameters: Array, d: Array) -> Array:
    """(N, 3) of the reading by a, b, c."""
    a, b, _ = parameters
    near = 1 / (d + b)
    return np.stack([near, -a * near**2, np.ones_like(d)], axis=1)


def starting_curve(d: Array, v: Array, weights: Array) -> Array:
    """Best (3,) over a scan of b; with b given, a and c are linear."""
    width = float(np.ptp(d))
    best, found = np.inf, np.zeros(3)
    # d + b must not change its sign over the table
    for gap in np.geomspace(1e-3 * width, 30 * width, SCAN):
        b = gap - float(d.min())
        near = np.stack([1 / (d + b), np.ones_like(d)], axis=1)
        root = np.sqrt(weights)
        (a, c), *_ = np.linalg.lstsq(near * root[:, None], v * root, rcond=None)
        cost = float(weights @ (near @ np.array([a, c]) - v) ** 2)
        if cost < best:
            best, found = cost, np.array([a, b, c])
    return found


def fit_curve(d: Array, v: Array, weights: Array) -> tuple[Array, Array]:
    """Parameters (3,) and the inverse of the normal matrix (3, 3), by damped Gauss-Newton.

    Raises
    ------
    UnderConstrainedError
        where the readings do not bend: a straight line has no b.
    NotConvergedError
    """
    p = starting_curve(d, v, weights)
    cost, damping = _cost(p, d, v, weights), 1e-6
    for _ in range(STEPS):
        J = curve_jacobian(p, d)
        normal = (J * weights[:, None]).T @ J
        scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
        scaled = normal * np.outer(scale, scale)
        gradient = scale * (J.T @ (weights * (v - curve(p, d))))
        step = scale * np.linalg.solve(scaled + damping * np.eye(3), gradient)
        trial = p + step
        trial_cost = _cost(trial, d, v, weights) if trial[1] > -d.min() else np.inf
        if trial_cost <= cost * (1 + 1e-14):
            small = np.abs(step) <= SETTLED * np.maximum(np.abs(p), 1e-12)
            p, cost, damping = trial, trial_cost, max(damping / 10, 1e-15)
            if small.all():
                return p, _inverse(p, d, weights)
        else:
            damping *= 10
            if damping > 1e8:
                return p, _inverse(p, d, weights)
    if p[1] + d.min() > STRAIGHT * np.ptp(d):
        raise UnderConstrainedError(NO_BEND)
    raise NotConvergedError(
        f"v = a/(d+b)+c has not settled in {STEPS} steps (a = {p[0]:.4g}, b = {p[1]:.4g}, c = {p[2]:.4g}): "
        "the readings do not follow such a curve; look at them, and leave out those of the folded branch"
    )


def _cost(p: Array, d: Array, v: Array, weights: Array) -> float:
    return float(weights @ (v - curve(p, d)) ** 2)


def _inverse(p: Array, d: Array, weights: Array) -> Array:
    J = curve_jacobian(p, d)
    normal = (J * weights[:, None]).T @ J
    scale = 1 / np.sqrt(np.diag(normal))
    scaled = normal * np.outer(scale, scale)
    if np.linalg.cond(scaled) > 1e13:
        raise UnderConstrainedError(NO_BEND)
    return np.asarray(np.linalg.inv(scaled) * np.outer(scale, scale))


def foreign_rows(d: Array, v: Array, weights: Array) -> Mask:
    """Rows that the curve through all others cannot explain, worst first, a fifth of the table at most.

    Deleted residuals in units of their standard deviation are Student's t with N - 4 degrees (Cook and
    Weisberg, 1982); the limit is Bonferroni's.
    """
    from scipy.special import stdtrit

    used = np.ones(len(d), dtype=bool)
    for _ in range(int(SPARED * len(d))):
        free = int(used.sum()) - 4
        if free < 2:
            break
        p, inverse = fit_curve(d[used], v[used], weights[used])
        root = np.sqrt(weights[used])
        J = curve_jacobian(p, d[used]) * root[:, None]
        lever = np.clip(np.einsum("ni,ij,nj->n", J, inverse, J), 0.0, 1 - 1e-9)
        residual = root * (v[used] - curve(p, d[used]))
        total = float(residual @ residual)
        without = np.maximum(total - residual**2 / (1 - lever), 1e-30) / free
        score = np.abs(residual) / np.sqrt(without * (1 - lever))
        worst = int(np.argmax(score))
        if total < 1e-24 or score[worst] < stdtrit(free, 1 - FOREIGN / 2 / len(residual)):
            break
        used[np.flatnonzero(used)[worst]] = False
    return ~used
