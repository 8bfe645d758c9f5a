"""Graduated non-convexity: a batch that decides for itself which loop closures to believe.

The outer loop is ours: least squares with weights, weights from residuals, the cost made a little less
convex, and again (Yang et al. 2020; see `graduated`).  Everything is linearised in vectorised passes, so that
changing weights cost nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.checks import check_problem
from factorlab.graph.slam.graduated import SCHEDULES
from factorlab.graph.slam.initial import initial_values
from factorlab.graph.slam.marginals import marginals_of
from factorlab.graph.slam.reconsider import reconsidered
from factorlab.graph.slam.sparse import solve_rows
from factorlab.graph.slam.weighted import Weighted
from factorlab.graph.solve import Solved
from sequential.errors import DataError, ModelError, UnderConstrainedError
from sequential.history import Report
from sequential.manifold import SE2, SE3
from sequential.slam import Factors, SlamProblem, SlamRun, Values

__all__ = ["GncResult", "GncSlam", "is_doubted"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
FIRST = 10  # Gauss-Newton steps with all weights one: a rough answer will do
STEPS = 2  # Gauss-Newton steps between two looks at the weights
OUTER = 200
ROUNDS = 5
SLACK = 1e-6  # relative: a cost has to fall by more to count
BELIEVED = 0.5
GENEROUS = 4.0  # times the fitted variance: a stated one beyond that is no measure of an outlier


@dataclass(frozen=True, slots=True, eq=False)
class GncResult:
    """An estimate, and what was believed.

    Parameters
    ----------
    run : as of a batch; `report.rejected` counts weights below one half
    weights : (N,) of each group of the problem, in its order; ones where a group is trusted
    """

    run: SlamRun
    weights: tuple[Array, ...]


@dataclass(frozen=True, slots=True)
class GncSlam:
    """A batch with graduated non-convexity.

    Parameters
    ----------
    loss : `"tls"`, truncated least squares; `"gm"`, Geman-McClure; `"dcs"`, dynamic covariance scaling, which
        is not graduated
    confidence : an outlier lies beyond this quantile of χ²
    doubted : names of the groups that may hold outliers; by default loop closures: measurements of two
        moving variables of one kind that are not neighbours.  All others are known inliers
    initial : a start as of `BatchSlam`, tried beside what the trusted measurements alone say; the lower
        robust cost wins.  `"relaxed"` is LAGO in the plane and the chordal relaxation in space, where there
        are poses to relax and it fits half of what is doubted; `"trusted"` tries nothing else
    reconsider : with `"tls"`, drop or add single measurements afterwards while that lowers the cost; where
        what is believed fits twice as well as its σ say, bounds shrink to twice the σ that are fitted
    covariance : marginals of all kinds, of the named kinds, or none
    max_iterations : of Gauss-Newton at the end, with the last weights
    check : raise where the last solve has not settled
    """

    loss: str = "tls"
    confidence: float = 0.99
    doubted: tuple[str, ...] | None = None
    initial: str | Values | Callable[[SlamProblem], Values] = "relaxed"
    reconsider: bool = True
    covariance: bool | tuple[str, ...] = True
    max_iterations: int = 100
    check: bool = True
    name: str = "gnc"

    def __post_init__(self) -> None:
        if self.loss not in SCHEDULES:
            msg = f"loss is one of {', '.join(SCHEDULES)}, got {self.loss!r}"
            raise ModelError(msg)
        if not 0 < self.confidence < 1:
            msg = f"confidence is a probability between 0 and 1, got {self.confidence}"
            raise ModelError(msg)

    def solve(self, problem: SlamProblem) -> SlamRun:
        """The estimate alone; raises `DataError`, `UnderConstrainedError`, `NotConvergedError`."""
        return self.solve_weighted(problem).run

    def solve_weighted(self, problem: SlamProblem) -> GncResult:
        """The estimate with the weight of every measurement.

        Raises
        ------
        DataError
            for a name of `doubted` that no group has.
        UnderConstrainedError, NotConvergedError, ModelError
        """
        index = {kind: known for kind in problem.kinds if len(known := problem.indices(kind))}
        check_problem(problem, index)
        began = time.perf_counter()
        doubts = self._doubts(problem)
        rows = Weighted(problem, index, doubts, self.confidence)
        tried = []
        for number, start in enumerate(self._starts(problem, doubts)):
            if number and self.initial == "relaxed" and not rows.plausible(start):
                continue  # outliers have spoilt a relaxation, which believes them all
            values, outer = self._graduate(rows, start)
            if self.reconsider and self.loss == "tls":
                values = self._relaxed_again(problem, rows, values)
                values = reconsidered(rows, values, SCHEDULES[self.loss])
            tried.append((rows.robust_cost(values, SCHEDULES[self.loss]), values, outer, rows.weights_now()))
        cost, values, outer, weights = min(tried, key=lambda one: one[0])
        rows.weigh(weights)
        if self.reconsider and self.loss == "tls" and rows.tighten(values, GENEROUS):
            rows.weigh(weights * (rows.squared(values) <= rows.bound))
            values = solve_rows(rows.rows, values, self.max_iterations).values
            values = reconsidered(rows, values, SCHEDULES[self.loss])
            cost = rows.robust_cost(values, SCHEDULES[self.loss])
        solved = solve_rows(rows.rows, values, self.max_iterations)
        if self.check:
            solved.checked()
        seconds = time.perf_counter() - began
        covs: Mapping[str, Array] = {}
        if self.covariance:
            kinds = tuple(index) if self.covariance is True else self.covariance or ()
            covs = marginals_of(rows.rows, solved.values, kinds)
        report = self._report(problem, rows, solved, cost, outer, seconds)
        return GncResult(SlamRun(solved.values, covs, dict(problem.kinds), report), rows.by_group())

    def _doubts(self, problem: SlamProblem) -> list[Flags]:
        """Which measurements of each group may be outliers."""
        if self.doubted is None:
            return [is_doubted(problem, group) for group in problem.factors]
        names = [group.name for group in problem.factors]
        if unknown := [name for name in self.doubted if name not in names]:
            there = ", ".join(filter(None, names))
            msg = f"no group of the problem is called {unknown[0]!r}; there are {there}"
            raise DataError(msg)
        return [np.full(len(group), group.name in self.doubted) for group in problem.factors]

    def _starts(self, problem: SlamProblem, doubts: list[Flags]) -> list[Values]:
        """Where the search begins, once or twice."""
        index = {kind: known for kind in problem.kinds if len(known := problem.indices(kind))}
        sure = _trusted(problem, doubts)
        starts = []
        try:
            starts.append(initial_values(sure, "steps", index))
        except (UnderConstrainedError, DataError):  # the trusted measurements do not reach every variable
            starts.append(initial_values(problem, "steps", index))
        if self.initial == "relaxed":
            starts += _relaxed(problem, index)
        elif self.initial != "trusted":
            starts.append(initial_values(problem, self.initial, index))
        return starts

    def _graduate(self, rows: Weighted, values: Values) -> tuple[Values, int]:
        """From least squares to the robust cost; the rows keep the last weights."""
        schedule = SCHEDULES[self.loss]
        weights = np.ones(rows.count)
        rows.weigh(weights)
        values = solve_rows(rows.rows, values, FIRST).values
        mu = schedule.first(rows.squared(values), rows.bound)
        for outer in range(OUTER):
            if mu is None:
                return values, outer
            before, weights = weights, schedule.weights(rows.squared(values), rows.bound, mu)
            if outer and schedule.finished(mu, weights, before):
                return values, outer
            rows.weigh(weights)
            values = solve_rows(rows.rows, values, STEPS).values
            mu = schedule.next(mu)
        return values, OUTER

    def _relaxed_again(self, problem: SlamProblem, rows: Weighted, values: Values) -> Values:
        """Begin once more from a relaxation of what is believed: without outliers it does its best."""
        schedule = SCHEDULES[self.loss]
        cost = rows.robust_cost(values, schedule)
        for _ in range(ROUNDS):
            weights = rows.weights_now()
            believed = _trusted(problem, [each < BELIEVED for each in rows.by_group()])
            starts = _relaxed(believed, dict(values.index))
            if not starts:
                return values
            moved = solve_rows(rows.rows, starts[0], self.max_iterations).values
            rows.weigh((rows.squared(moved) <= rows.bound).astype(np.float64))
            moved = solve_rows(rows.rows, moved, self.max_iterations).values
            reached = rows.robust_cost(moved, schedule)
            if reached >= cost * (1.0 - SLACK):
                rows.weigh(weights)
                return values
            values, cost = moved, reached
        return values

    def _report(
        self,
        problem: SlamProblem,
        rows: Weighted,
        solved: Solved,
        cost: float,
        outer: int,
        seconds: float,
    ) -> Report:
        weights = rows.weights_now()
        rejected = int(np.sum(weights < BELIEVED))
        details = {
            "chi2": 2.0 * solved.cost,
            "robust_cost": cost,
            "doubted": float(rows.count),
            "believed": float(rows.count - rejected),
            "newton_decrement": solved.decrement,
            "measurements": float(problem.count),
            "outer_iterations": float(outer),
        }
        return Report(
            self.name,
            solved.settled,
            outer,
            seconds,
            solved.cost,
            solved.message(),
            rejected,
            details=details,
        )


def is_doubted(problem: SlamProblem, group: Factors) -> Flags:
    """(N,) whether each measurement of a group is a loop closure: two moving variables, not neighbours."""
    if len(group.slots) != 2 or group.slots[0] != group.slots[1] or group.slots[0] not in problem.moving:
        return np.zeros(len(group), dtype=np.bool_)
    index = np.asarray(group.index)
    return np.asarray(np.abs(index[:, 0] - index[:, 1]) > 1)


def _relaxed(problem: SlamProblem, index: dict[str, NDArray[np.int64]]) -> list[Values]:
    """The start from a linear relaxation of all measurements, or nothing where there is none."""
    pose = problem.kinds.get("x")
    if not isinstance(pose, SE2 | SE3):
        return []
    try:
        return [initial_values(problem, "lago" if isinstance(pose, SE2) else "chordal", index)]
    except (DataError, ModelError, UnderConstrainedError):
        return []


def _trusted(problem: SlamProblem, doubts: list[Flags]) -> SlamProblem:
    """The problem without what is doubted, and without a start of its own."""
    kept = []
    for group, doubt in zip(problem.factors, doubts, strict=True):
        if not doubt.any():
            kept.append(group)
        elif not doubt.all():
            noise = np.asarray(group.noise_cov)
            kept.append(
                replace(
                    group,
                    index=np.asarray(group.index)[~doubt],
                    z=np.asarray(group.z)[~doubt],
                    noise_cov=noise[~doubt] if noise.ndim == 3 else noise,
                    step=None if group.step is None else np.asarray(group.step)[~doubt],
                )
            )
    return SlamProblem(problem.kinds, tuple(kept), problem.moving, None, problem.t)
