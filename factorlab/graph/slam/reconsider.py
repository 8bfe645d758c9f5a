"""A second look at what was believed: whether the truncated cost falls without a measurement, or with it.

Graduation ends in a local minimum now and then: one false loop closure, believed early, bends the odometry
until it fits.  Its own residual is then small, but what its removal frees is not.  With e and J the whitened
residual and Jacobian of a measurement and P the covariance of the variables, removal takes
eᵀ (I - J P Jᵀ)⁻¹ e off the cost, and adding one costs eᵀ (I + J P Jᵀ)⁻¹ e (Cook 1977, "Detection of
influential observation in linear regression", Technometrics; exact where everything is linear).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.sparse import Normal, solve_rows
from sequential.slam import Values

if TYPE_CHECKING:
    from factorlab.graph.slam.graduated import Schedule
    from factorlab.graph.slam.weighted import Weighted

__all__ = ["influence", "reconsidered"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LOOKED_AT = 300  # measurements of either kind whose influence is computed, the likeliest first
AT_ONCE = 100
ROUNDS = 30
TRIES = 3  # candidates of a round before the search ends
STEPS = 5
SLACK = 1e-6  # relative: a cost has to fall by more to count


def reconsidered(rows: Weighted, values: Values, schedule: Schedule) -> Values:
    """Values and weights of a lower robust cost, found by dropping or adding one measurement at a time."""
    cost = rows.robust_cost(values, schedule)
    for _ in range(ROUNDS):
        weights = rows.weights_now()
        found = None
        for candidate in candidates(rows, values)[:TRIES].tolist():
            trial = weights.copy()
            trial[candidate] = 1.0 - trial[candidate]
            rows.weigh(trial)
            moved = solve_rows(rows.rows, values, STEPS).values
            reached = rows.robust_cost(moved, schedule)
            if reached < cost * (1.0 - SLACK):
                found = moved, reached
                break
        if found is None:
            rows.weigh(weights)
            return values
        values, cost = found
    return values


def candidates(rows: Weighted, values: Values) -> Ints:
    """Doubted measurements whose other weight promises a lower cost, the best promise first."""
    weights, squared = rows.weights_now(), rows.squared(values)
    believed = weights > 0.5
    inside, outside = np.flatnonzero(believed), np.flatnonzero(~believed)
    share = squared / rows.bound
    inside = inside[np.argsort(-share[inside], kind="stable")][:LOOKED_AT]
    outside = outside[np.argsort(share[outside], kind="stable")][:LOOKED_AT]
    worst = np.concatenate([inside, outside])
    change = influence(rows, values, worst)
    promise = np.where(believed[worst], change - rows.bound[worst], rows.bound[worst] - change)
    kept = promise > SLACK * rows.bound[worst]
    return np.asarray(worst[kept][np.argsort(-promise[kept], kind="stable")])


def influence(rows: Weighted, values: Values, which: Ints) -> Array:
    """What the removal of a believed measurement takes off the cost, or a rejected one would add: (N,)."""
    matrix, _, _ = rows.rows.linearise(values)
    normal = Normal(rows.rows, matrix)
    weights, found = rows.weights_now(), np.zeros(len(which))
    slots = rows.residuals_and_slopes(values, which)
    for first in range(0, len(which), AT_ONCE):
        part = slots[first : first + AT_ONCE]
        wide = sum(len(error) for error, _, _ in part)
        right, at = np.zeros((rows.rows.columns, wide)), 0
        for error, slope, columns in part:
            right[columns, at : at + len(error)] = slope.T
            at += len(error)
        solved = normal.scale[:, None] * normal.factor.solve(normal.scale[:, None] * right)
        at = 0
        for k, (error, slope, columns) in enumerate(part):
            m = len(error)
            spread = slope @ solved[columns, at : at + m]
            sign = -1.0 if weights[which[first + k]] > 0.5 else 1.0
            inner = np.eye(m) + sign * 0.5 * (spread + spread.T)
            # a measurement that alone holds a variable cannot go
            low = np.linalg.eigvalsh(inner)[0]
            found[first + k] = float(error @ np.linalg.solve(inner, error)) if low > 1e-9 else 0.0
            at += m
    return found
