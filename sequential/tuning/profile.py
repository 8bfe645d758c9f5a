"""How far one knob may be turned while the others make the best of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sequential.tuning.search import STEP, Curvature

__all__ = ["profile_limits"]

Array = NDArray[np.float64]
Function = Callable[[Array], float]

DROP = 1.920729  # nats: half the 0.95 quantile of χ² with one degree of freedom
REACH = 3.0  # prior standard deviations: farther out an end is called open
ROUNDS = 12  # bisections of an end, at most
CLOSE = 0.02  # prior standard deviations: an end is known to this


def profile_limits(function: Function, at: Array, shape: Curvature, index: int) -> tuple[float, float]:
    """Ends of a 95 % interval of one variable by its profile likelihood (Wilks 1938), or ±infinity.

    Parameters
    ----------
    function : log posterior with a standard normal prior on every variable; the prior of the variable itself
        is taken out again, that of the others keeps them where they mean something
    at : (k,) its maximum
    shape : the curvature there; the others follow it, and take a Newton step with it
    """
    cov = np.linalg.inv(-shape.hessian) if shape.is_summit() else np.eye(len(at))
    others = np.delete(np.arange(len(at)), index)
    along = cov[:, index] / cov[index, index]
    within = -np.asarray(shape.hessian[np.ix_(others, others)], dtype=np.float64)
    solve = np.eye(len(others))
    if shape.is_summit() and len(others):
        solve = np.asarray(np.linalg.inv(within), dtype=np.float64)

    def drop(offset: float) -> float:
        u = at + offset * along
        best = _improved(function, u, others, solve)
        return top - (best + 0.5 * float(u[index] ** 2))

    top = function(at) + 0.5 * float(at[index] ** 2)
    guess = 2.0 * float(np.sqrt(cov[index, index]))
    low, high = (_end(drop, side * guess, side) for side in (-1.0, 1.0))
    return float(at[index] + low), float(at[index] + high)


def _improved(function: Function, u: Array, others: NDArray[np.int64], solve: Array) -> float:
    """The best value near u with one variable held: one Newton step of the others, if it pays."""
    here = function(u)
    if not len(others) or not np.isfinite(here):
        return here
    gradient = np.zeros(len(others))
    for k, other in enumerate(others):
        step = np.zeros(len(u))
        step[other] = STEP
        gradient[k] = (function(u + step) - function(u - step)) / (2.0 * STEP)
    if not np.isfinite(gradient).all():
        return here
    moved = u.copy()
    moved[others] += np.clip(solve @ gradient, -1.0, 1.0)
    return max(here, function(moved))


def _end(drop: Callable[[float], float], guess: float, side: float) -> float:
    """Offset at which the drop reaches its limit, by bisection; infinite where it does not within reach."""
    inside, outside = 0.0, min(abs(guess), REACH)
    while drop(side * outside) < DROP:
        inside = outside
        if outside >= REACH:
            return side * float("inf")
        outside = min(2.0 * outside, REACH)
    for _ in range(ROUNDS):
        if outside - inside < CLOSE:
            break
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if drop(side * middle) < DROP else (inside, middle)
    return side * 0.5 * (inside + outside)
