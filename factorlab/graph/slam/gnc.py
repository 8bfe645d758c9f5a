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
from factorlab.graph.slam.graduated import SCHEDULES, Schedule
from factorlab.graph.slam.initial import initial_values
from factorlab.graph.slam.marginals import marginals_of
from factorlab.graph.slam.rows import Rows
from factorlab.graph.slam.sparse import solve_rows
from factorlab.graph.solve import Solved
from sequential.errors import DataError, ModelError, UnderConstrainedError
from sequential.history import Report
from sequential.slam import Factors, SlamProblem, SlamRun, Values

__all__ = ["GncResult", "GncSlam", "is_doubted"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
FIRST = 10  # Gauss-Newton steps with all weights one: a rough answer will do
STEPS = 2  # Gauss-Newton steps between two looks at the weights
OUTER = 200
BELIEVED = 0.5


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
    doubted : names of the groups that may hold outliers; by default loop closures: measurements of two moving
        variables of one kind that are not neighbours.  All others are known inliers
    initial : a start as of `BatchSlam`, tried beside `"trusted"`: what the trusted measurements alone say.
        The lower robust cost wins
    covariance : marginals of all kinds, of the named kinds, or none
    max_iterations : of Gauss-Newton at the end, with the last weights
    check : raise where the last solve has not settled
    """

    loss: str = "tls"
    confidence: float = 0.99
    doubted: tuple[str, ...] | None = None
    initial: str | Values | Callable[[SlamProblem], Values] = "trusted"
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
        for start in self._starts(problem, doubts):
            values, outer = self._graduate(rows, start)
            tried.append((rows.robust_cost(values, SCHEDULES[self.loss]), values, outer, rows.weights_now()))
        cost, values, outer, weights = min(tried, key=lambda one: one[0])
        rows.weigh(weights)
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
        if self.initial != "trusted":
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


class Weighted:
    """The rows of a problem with weights on what is doubted.

    Parameters
    ----------
    doubts : (N,) of each group
    confidence : quantile of χ² that bounds an inlier
    """

    def __init__(
        self,
        problem: SlamProblem,
        index: dict[str, NDArray[np.int64]],
        doubts: list[Flags],
        confidence: float,
    ) -> None:
        from scipy.stats import chi2

        self.problem = problem
        plain = tuple(replace(group, loss=None) for group in problem.factors)
        self.rows = Rows(replace(problem, factors=plain), index)
        self.doubts = [doubt for doubt, group in zip(doubts, problem.factors, strict=True) if len(group)]
        self.roots = [one.root for one in self.rows.whitened]
        dims = [group.model.measured.dim for group in self.rows.groups]
        bounds = [
            np.full(int(doubt.sum()), chi2.ppf(confidence, m))
            for doubt, m in zip(self.doubts, dims, strict=True)
        ]
        self.bound = np.concatenate(bounds) if bounds else np.zeros(0)
        self.count = len(self.bound)
        self._weights = np.ones(self.count)

    def weigh(self, weights: Array) -> None:
        """Set the weights (count,) of all doubted measurements."""
        self._weights, first = weights, 0
        for number, doubt in enumerate(self.doubts):
            here = int(doubt.sum())
            if not here:
                continue
            root = self.roots[number]
            each = np.ones(len(doubt))
            each[doubt] = np.sqrt(weights[first : first + here])
            self.rows.whitened[number].root = each[:, None, None] * root
            first += here

    def weights_now(self) -> Array:
        """(count,)."""
        return self._weights

    def squared(self, values: Values) -> Array:
        """(count,) squared whitened residuals of what is doubted, weights left out."""
        found = []
        for number, doubt in enumerate(self.doubts):
            if doubt.any():
                group = self.rows.groups[number]
                error = group.model.errors(np.asarray(group.z), *self.rows.read(values, number))[doubt]
                root = self.roots[number]
                root = root[doubt] if root.ndim == 3 else root
                found.append(np.square((root @ error[..., None])[..., 0]).sum(axis=1))
        return np.concatenate(found) if found else np.zeros(0)

    def robust_cost(self, values: Values, schedule: Schedule) -> float:
        """Twice the cost of what is trusted, and what the schedule makes of the rest."""
        now, self._weights = self._weights, self._weights
        self.weigh(np.zeros(self.count))
        trusted = 2.0 * self.rows.cost(values)
        self.weigh(now)
        return trusted + schedule.cost(self.squared(values), self.bound)

    def by_group(self) -> tuple[Array, ...]:
        """(N,) for each group of the problem."""
        found, first, full = [], 0, iter(self.doubts)
        for group in self.problem.factors:
            each = np.ones(len(group))
            if len(group):
                doubt = next(full)
                here = int(doubt.sum())
                each[doubt] = self._weights[first : first + here]
                first += here
            each.flags.writeable = False
            found.append(each)
        return tuple(found)
