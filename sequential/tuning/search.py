"""Climbing a smooth function of a few variables that has cliffs and false summits.

A likelihood of noise levels is steep and rugged where noise is too small, and gentle where it is too large.
The search therefore comes down from the noisy side (Nelder and Mead 1965), and ends with Newton steps,
whose curvature is also the uncertainty of the answer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Curvature", "Summit", "climb", "curvature"]

Array = NDArray[np.float64]
Function = Callable[[Array], float]

START, FIRST_STEP = 1.5, -0.5  # from well above the prior's centre, downwards
TOLERANCE, GAIN = 0.05, 0.1  # the simplex stops at this size and this difference; Newton does the rest
STEP = 0.02  # of differences: far above rounding, far below the curvature of a prior
CLIFF = 1e300  # stands for minus infinity where differences are taken
SETTLED = 1e-3  # a Newton step that promises less than this is the last one
POLISHES = 3
NO_BETTER = "no better values were found than the initial ones"
LONGEST = 1.0  # a Newton step is trusted over this distance


class Curvature(NamedTuple):
    """Second-order expansion at a point."""

    gradient: Array  # (k,)
    hessian: Array  # (k, k)

    def is_summit(self) -> bool:
        """Whether the function falls in every direction."""
        return bool(np.isfinite(self.hessian).all() and np.linalg.eigvalsh(-self.hessian).min() > 0)

    def newton(self) -> Array:
        """(k,) step to the summit of the expansion."""
        return np.asarray(np.linalg.solve(-self.hessian, self.gradient), dtype=np.float64)

    def sigmas(self) -> Array:
        """(k,) standard deviations of the Gaussian with this curvature, or NaN where there is none."""
        if not self.is_summit():
            return np.full(len(self.gradient), np.nan)
        return np.sqrt(np.diag(np.linalg.inv(-self.hessian)))


class Summit(NamedTuple):
    """Where the climb ended."""

    at: Array  # (k,)
    value: float
    curvature: Curvature
    converged: bool
    message: str


def curvature(function: Function, u: Array, step: float | Array = STEP) -> Curvature:
    """Gradient and Hessian by symmetric differences of one step, or one for each axis.

    Takes 2k + k (k - 1) + 1 calls.
    """
    k = len(u)
    steps = np.broadcast_to(np.asarray(step, dtype=np.float64), (k,))
    axes = np.diag(steps)
    here = function(u)
    ahead = np.array([function(u + e) for e in axes])
    behind = np.array([function(u - e) for e in axes])
    hessian = np.diag((ahead + behind - 2 * here) / steps**2)
    for i in range(k):
        for j in range(i):
            both = function(u + axes[i] + axes[j]) + function(u - axes[i] - axes[j])
            single = ahead[i] + behind[i] + ahead[j] + behind[j]
            hessian[i, j] = hessian[j, i] = (both - single + 2 * here) / (2 * steps[i] * steps[j])
    return Curvature((ahead - behind) / (2 * steps), hessian)


def climb(function: Function, dim: int, max_evaluations: int, step: float | Array = STEP) -> Summit:
    """Maximise a function whose variables are of the order of one, centred on zero.

    `step` is that of the differences at the end.
    """
    from scipy.optimize import minimize

    start = START if np.isfinite(function(np.full(dim, START))) else 0.0
    simplex = np.full((dim + 1, dim), start)
    simplex[1:] += FIRST_STEP * np.eye(dim)
    options = {"initial_simplex": simplex, "xatol": TOLERANCE, "fatol": GAIN, "maxfev": max_evaluations}
    found = minimize(lambda u: min(-function(u), CLIFF), simplex[0], method="Nelder-Mead", options=options)
    message = "" if found.success else f"the simplex had not settled after {max_evaluations} evaluations"
    at = np.asarray(found.x, dtype=np.float64)
    if function(np.zeros(dim)) > function(at):
        at, message = np.zeros(dim), NO_BETTER
    return polish(function, at, step, converged=bool(found.success), message=message)


def polish(
    function: Function, at: Array, apart: float | Array = STEP, *, converged: bool, message: str
) -> Summit:
    """Newton steps while they pay, halved until they do."""
    shape, start = curvature(function, at, apart), function(at)
    for _ in range(POLISHES):
        if not shape.is_summit():
            break
        step = shape.newton()
        if 0.5 * float(shape.gradient @ step) < SETTLED:
            at = at + step if function(at + step) >= function(at) else at
            return Summit(at, function(at), shape, converged=True, message="")
        step *= min(1.0, LONGEST / float(np.linalg.norm(step)))
        while function(at + step) <= function(at) and np.linalg.norm(step) > STEP:
            step = step / 2
        if function(at + step) <= function(at):
            break
        at = at + step
        shape = curvature(function, at, apart)
    if message == NO_BETTER and function(at) > start:
        message = ""  # the simplex stopped short, the Newton steps did not
    if not shape.is_summit():
        reason = (
            "the Hessian at the optimum is not positive definite: some knob is not determined by this log"
        )
        message, converged = "; ".join(filter(None, [message, reason])), False
    return Summit(at, function(at), shape, converged, message)
