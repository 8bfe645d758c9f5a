"""Online estimates: iSAM2 over everything, or the last part of the way with the rest marginalised."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.checks import check_problem
from factorlab.graph.slam.feeding import Feed, Step, require_native
from factorlab.graph.slam.marginals import marginals
from factorlab.graph.slam.rows import Rows
from factorlab.graph.slam.variables import SHIFT, keys_of, read_values, require_type
from factorlab.graph.solve import Solved, newton_decrement, optimise, readable
from sequential.errors import ModelError
from sequential.history import Report, Run
from sequential.model import Loss
from sequential.slam import SlamProblem, SlamRun, Values

__all__ = ["FixedLagSlam", "IncrementalSlam"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
ROUNDS = 5  # updates without news at the end of a window
SETTLING = 20  # Gauss-Newton steps after the last measurement, at most


def isam_parameters(threshold: float, every: int) -> Any:
    """Relinearise what moved by more than `threshold`, looked for every so many updates."""
    parameters = gtsam.ISAM2Params()
    parameters.relinearizeSkip = every
    parameters.setRelinearizeThreshold(threshold)
    return parameters


@dataclass(frozen=True, slots=True)
class IncrementalSlam:
    """iSAM2 (Kaess et al. 2012), one update a step.

    Parameters
    ----------
    threshold : tangent step beyond which a variable is relinearised
    every : updates between two looks at what is to be relinearised
    final : end with Gauss-Newton over everything, from what was believed last: the batch's own optimum, where
        iSAM2 alone stays within `threshold` of where it was linearised
    loss : robust loss of groups that bring none of their own
    covariance : marginals at the end, of all kinds, of the named kinds, or none
    online : also the covariance of the newest pose at each step; it is not part of the reported seconds
    """

    threshold: float = 0.01
    every: int = 1
    final: bool = True
    loss: Loss | None = None
    covariance: bool | tuple[str, ...] = True
    online: bool = True

    @property
    def name(self) -> str:
        """`isam2`, or `isam2_final`."""
        return "isam2_final" if self.final else "isam2"

    def solve(self, problem: SlamProblem) -> SlamRun:
        """Feed, and read what is believed; raises `DataError`, `UnderConstrainedError`, `ModelError`."""
        index = {kind: known for kind in problem.kinds if len(known := problem.indices(kind))}
        check_problem(problem, index)
        began = time.perf_counter()
        engine = gtsam.ISAM2(isam_parameters(self.threshold, self.every))
        feed = Feed(problem, believer(problem, engine), self.loss)
        require_native(problem, feed, "iSAM2")
        walk = Walk(problem, feed, engine, online=self.online)
        walk.seconds = time.perf_counter() - began
        with readable():
            walk.run(lambda step: engine.update(step.graph, step.values))
            began = time.perf_counter()
            solved = self._end(engine)
            walk.seconds += time.perf_counter() - began
        values = read_values(problem, solved.values, index)
        report = walk.report(self.name, solved)
        covs: dict[str, Array] = {}
        if self.covariance:
            kinds = tuple(index) if self.covariance is True else tuple(self.covariance)
            covs = marginals(Rows(problem, index, self.loss), values, kinds)
        return SlamRun(values, covs, dict(problem.kinds), report, walk.online_run(report))

    def _end(self, engine: Any) -> Solved:
        """What is believed after the last step, and what one more Gauss-Newton step promises there."""
        values, graph = engine.calculateEstimate(), engine.getFactorsUnsafe()
        if self.final:
            return optimise(graph, values, None, SETTLING, check=False)
        return Solved(values, float(graph.error(values)), 0, newton_decrement(graph.linearize(values)))


@dataclass(frozen=True, slots=True)
class FixedLagSlam:
    """The last part of the way as a graph; what is older is marginalised (GTSAM's own smoother on iSAM2).

    Landmarks and other variables that do not move stay for ever.  A measurement of a pose that has left, such
    as a loop closure, cannot be used: such measurements are dropped and counted in `report.rejected`.

    Parameters
    ----------
    lag : length of the window, in steps, or in seconds where `seconds` is set
    seconds : whether `lag` is in seconds, by the problem's `t`
    threshold, every, loss, online : as of `IncrementalSlam`
    """

    lag: float = 20.0
    seconds: bool = False
    threshold: float = 0.01
    every: int = 1
    loss: Loss | None = None
    online: bool = True
    name: str = "fixed_lag"

    def __post_init__(self) -> None:
        if not self.lag > 0:
            msg = f"the lag of a fixed-lag smoother is positive, got {self.lag}"
            raise ModelError(msg)

    def solve(self, problem: SlamProblem) -> SlamRun:
        """Online estimates, and what was last believed of each variable before it left the window."""
        index = {kind: known for kind in problem.kinds if len(known := problem.indices(kind))}
        check_problem(problem, index)
        if self.seconds and problem.t is None:
            msg = "a lag in seconds needs the times of the steps: give the problem its t, or a lag in steps"
            raise ModelError(msg)
        began = time.perf_counter()
        engine = gtsam.IncrementalFixedLagSmoother(self.lag, isam_parameters(self.threshold, self.every))
        feed = Feed(problem, believer(problem, engine), self.loss)
        require_native(problem, feed, "A fixed-lag smoother")
        window = Window(problem, feed, engine, self.lag, in_seconds=self.seconds)
        walk = Walk(problem, feed, engine, online=self.online)
        walk.seconds = time.perf_counter() - began
        with readable():
            walk.run(window.update)
            window.settle()
            values = window.last_values(index)
        report = walk.report(self.name, None, feed.dropped)
        return SlamRun(values, {}, dict(problem.kinds), report, walk.online_run(report))


class Window:
    """Which variables a fixed-lag smoother holds, and what was last believed of those that left."""

    def __init__(
        self, problem: SlamProblem, feed: Feed, engine: Any, lag: float, *, in_seconds: bool
    ) -> None:
        self.problem, self.feed, self.engine, self.lag = problem, feed, engine, lag
        self.t = None
        if in_seconds and problem.t is not None:
            self.t = ((problem.t - problem.t[0]) * 1e-9).tolist()
        self.moving = {ord(kind) for kind in problem.moving}
        self.staying: list[int] = []
        self.stamped = float("-inf")
        self.inside: deque[tuple[float, int]] = deque()
        self.left: dict[int, Any] = {}

    def update(self, step: Step) -> None:
        """Feed one step, and forget what leaves."""
        now = float(step.number) if self.t is None else self.t[step.number]
        moving = [key for key in step.new if key >> SHIFT in self.moving]
        self.staying += [key for key in step.new if key >> SHIFT not in self.moving]
        stamps = dict.fromkeys(step.new, now)
        if now - self.stamped > self.lag / 3:
            stamps.update(dict.fromkeys(self.staying, now))
            self.stamped = now
        self.inside.extend((now, key) for key in moving)
        leaving = []
        while self.inside and self.inside[0][0] < now - self.lag:
            leaving.append(self.inside.popleft()[1])
        believed = self.feed.believed
        for key in leaving:
            self.left[key] = believed(key) if key not in step.new else step.new[key]
        self.engine.update(step.graph, step.values, stamps)
        for key in leaving:
            self.feed.forget(key)

    def settle(self) -> None:
        """Relinearise what the last measurements moved."""
        for _ in range(ROUNDS):
            self.engine.update()

    def last_values(self, index: dict[str, Ints]) -> Values:
        """What was last believed of every variable."""
        rows = {}
        for kind, known in index.items():
            found = require_type(self.problem.kinds[kind], kind)
            objects = [
                self.left[key] if key in self.left else self.feed.believed(key)
                for key in keys_of(kind, known)
            ]
            row = np.array([found.to_row(one) for one in objects], dtype=np.float64)
            rows[kind] = row.reshape(-1, self.problem.kinds[kind].size)
        return Values(dict(index), rows)


class Walk:
    """An engine fed step by step, and what it believed of the newest pose at each."""

    def __init__(self, problem: SlamProblem, feed: Feed, engine: Any, *, online: bool) -> None:
        self.problem, self.feed, self.engine, self.online = problem, feed, engine, online
        self.kind = problem.moving[0]
        self.numbers: list[int] = []
        self.believed: list[Any] = []
        self.covs: list[Array] = []
        self.each: list[float] = []
        self.seconds = 0.0
        self.steps = 0

    def run(self, update: Callable[[Step], Any]) -> None:
        """Everything that arrives; the seconds leave out the covariances."""
        letter, newest, clock = ord(self.kind), -1, time.perf_counter
        believed, began = self.feed.believed, clock()
        for step in self.feed:
            update(step)
            newest = max(newest, max((key for key in step.new if key >> SHIFT == letter), default=-1))
            if newest >= 0:
                self.numbers.append(step.number)
                self.believed.append(believed(newest))
            self.each.append(clock() - began)
            if self.online and newest >= 0:
                self.covs.append(self.engine.marginalCovariance(newest))
            self.steps += 1
            began = clock()
        self.seconds += sum(self.each)

    def report(self, name: str, solved: Solved | None, dropped: int = 0) -> Report:
        """How it went, with the time that steps took."""
        each = np.array(self.each)
        details = {
            "steps": float(self.steps),
            "measurements": float(self.problem.count),
            "step_median_s": float(np.median(each)),
            "step_worst_s": float(each.max()),
        }
        cost, message, settled = float("nan"), "", True
        if solved is not None:
            details |= {"chi2": 2.0 * solved.cost, "newton_decrement": solved.decrement}
            cost, message, settled = solved.cost, solved.message(), solved.settled
        return Report(
            name, settled, self.steps, self.seconds, cost, message, rejected=dropped, details=details
        )

    def online_run(self, report: Report) -> Run:
        """What was believed of the newest pose at each step."""
        manifold, t = self.problem.kinds[self.kind], self.problem.t
        found = require_type(manifold, self.kind)
        mean = np.array([found.to_row(one) for one in self.believed], dtype=np.float64)
        d, steps = manifold.dim, np.array(self.numbers, dtype=np.int64)
        cov = np.array(self.covs) if self.online else np.full((len(mean), d, d), np.nan)
        times = steps if t is None else np.asarray(t)[steps]
        return Run(times, mean.reshape(-1, manifold.size), cov, manifold, {}, float("nan"), report)


def believer(problem: SlamProblem, engine: Any) -> Callable[[int], Any]:
    """What an engine believes of a variable, as GTSAM's object."""
    ask = {
        ord(kind): getattr(engine, f"calculateEstimate{require_type(m, kind).name}")
        for kind, m in problem.kinds.items()
    }

    def believed(key: int) -> Any:
        return ask[key >> SHIFT](key)

    return believed
