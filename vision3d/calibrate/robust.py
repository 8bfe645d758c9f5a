"""Corners and views that do not fit: found, weighted down, named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.descent import FAR_PX, ITERATIONS, Solution, State

__all__ = ["Corners", "Trusted", "fit_robustly", "weights_of", "weights_of_views"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CAUCHY = 2.385
"""Tuning of Cauchy's loss: 95 % efficiency under Gaussian noise.  Holland, Welsch 1977, table 1."""
MEDIAN_OF_RAYLEIGH = float(np.sqrt(2.0 * np.log(2.0)))
FALSE_ALARMS = 0.02
"""Good corners that a calibration may expect to lose under Gaussian noise."""
WORSE_VIEW = 3.0
"""A view whose typical residual is this many times that of all views is named and counts accordingly less."""
ROUNDS = 12


class Corners(Protocol):
    """What of a problem is asked here: its corners view by view, and how sure each is."""

    @property
    def sigma_px(self) -> Array:
        """(M,), standard deviation of every corner, per axis."""

    @property
    def starts(self) -> NDArray[np.int64]:
        """(V + 1,): view v has the corners starts[v] to starts[v + 1]."""

    @property
    def count(self) -> int:
        """How many views there are."""

    @property
    def owner(self) -> NDArray[np.int64]:
        """Number of the view of every corner, (M,)."""

    def split(self, values: Array) -> tuple[Array, ...]:
        """Cut an array (M, ...) into one array a view."""


@dataclass(frozen=True, eq=False)
class Trusted(Generic[State]):
    """Where a robust fit ended: the solution, its weights, and whom it trusts.

    Attributes
    ----------
    solution : Solution
        Least squares over the corners kept.
    weights : Array
        (M,), in units of 1 / sigma²: 1 for a corner of an ordinary view, 0 for one left out.
    outlier_views : tuple[int, ...]
        Views weighted down as a whole.
    iterations : int
        Steps of all rounds.
    """

    solution: Solution[State]
    weights: Array
    outlier_views: tuple[int, ...]
    iterations: int


def weights_of(problem: Corners, relative: Array) -> Array:
    """Weights in 1/px² from weights in units of 1 / sigma²."""
    return relative / problem.sigma_px**2


def weights_of_views(problem: Corners, residuals: Array) -> Array:
    """Weight (M,) of every corner by its view: 1, or less where the whole view fits badly."""
    norms = np.linalg.norm(residuals, axis=1) / problem.sigma_px
    norms = np.where(np.isfinite(norms), norms, FAR_PX)
    typical = np.array([np.median(one) for one in problem.split(norms)])
    ratio = typical / max(float(np.median(typical)), 1e-12)
    weight: Array = np.where(ratio > WORSE_VIEW, np.maximum(ratio, 1.0) ** -2.0, 1.0)
    return weight[problem.owner]


def fit_robustly(
    problem: Corners,
    begun: Solution[State],
    solve: Callable[[State, Array, int], Solution[State]],
    *,
    robust: bool = True,
) -> Trusted[State]:
    """Least squares over the corners that can be believed.

    `solve` is given where to begin, weights (M,) in 1/px², and how many steps it may try.

    Least squares first.  If a corner is then further off than Gaussian noise explains, Cauchy's loss takes
    over until it settles, the corners beyond the limit leave, and least squares ends it, so that the
    covariance is that of least squares.  Scales are medians, which a half of wrong corners cannot move.
    """
    views = np.ones(len(problem.sigma_px))
    solution = solve(begun.unknowns, weights_of(problem, views), ITERATIONS)
    iterations = begun.iterations + solution.iterations
    if not robust or not _doubtful(problem, solution, views).any():
        return Trusted(solution, views, (), iterations)
    relative = views
    for _ in range(ROUNDS):
        views = weights_of_views(problem, solution.blocks.residuals)
        ahead = views / (1.0 + (_distance(problem, solution, views) / CAUCHY) ** 2)
        solution = solve(solution.unknowns, weights_of(problem, ahead), 15)
        iterations += solution.iterations
        if np.abs(ahead - relative).max() < 1e-3:
            break
        relative = ahead
    for _ in range(ROUNDS):
        views = weights_of_views(problem, solution.blocks.residuals)
        ahead = np.where(_doubtful(problem, solution, views), 0.0, views)
        ahead = _enough(problem, ahead, views)
        solution = solve(solution.unknowns, weights_of(problem, ahead), ITERATIONS)
        iterations += solution.iterations
        settled = np.array_equal(ahead > 0.0, relative > 0.0) and np.allclose(ahead, relative, rtol=1e-2)
        relative = ahead
        if settled:
            break
    worse = np.flatnonzero([one.max() < 1.0 for one in problem.split(views)])
    return Trusted(solution, relative, tuple(int(v) for v in worse), iterations)


def _distance(problem: Corners, solution: Solution[State], views: Array) -> Array:
    """Residuals in units of the typical one, whitened, (M,); infinite where there is no projection."""
    norms = np.linalg.norm(solution.blocks.residuals, axis=1) / problem.sigma_px
    norms = np.where(np.isfinite(norms), norms, np.inf) * np.sqrt(views)
    return norms / max(float(np.median(norms)) / MEDIAN_OF_RAYLEIGH, 1e-9)


def _doubtful(problem: Corners, solution: Solution[State], views: Array) -> Mask:
    """Corners further off than any of M Gaussian ones would be, but for a rare false alarm."""
    limit = np.sqrt(2.0 * np.log(len(problem.sigma_px) / FALSE_ALARMS))
    doubtful: Mask = _distance(problem, solution, views) > limit
    return doubtful


def _enough(problem: Corners, relative: Array, views: Array) -> Array:
    """Give a view back its corners where too few would be left to say where the board is."""
    kept = relative.copy()
    for v in range(problem.count):
        rows = slice(problem.starts[v], problem.starts[v + 1])
        if np.count_nonzero(kept[rows]) < 4:
            kept[rows] = views[rows]
    return kept
