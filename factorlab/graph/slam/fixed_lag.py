"""The last part of the way as a graph, what is older marginalised."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.checks import check_problem
from factorlab.graph.slam.feeding import Feed, Step
from factorlab.graph.slam.variables import SHIFT, keys_of, require_type
from factorlab.graph.slam.walking import ROUNDS, Walk, believer, isam_parameters
from factorlab.graph.solve import readable
from sequential.errors import ModelError
from sequential.model import Loss
from sequential.slam import SlamProblem, SlamRun, Values

__all__ = ["FixedLagSlam"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


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
        feed = Feed(problem, believer(problem, engine), engine.calculateEstimate, self.threshold, self.loss)
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
        self.engine.update(step.graph, step.values, stamps, step.replaced)
        if self.feed.containers is not None:
            self.feed.entered(step, self.engine.getISAM2Result().getNewFactorsIndices())
        if leaving:
            self.feed.forget(leaving)

    def settle(self) -> None:
        """Relinearise what the last measurements moved."""
        for step in self.feed.again_linearised(ROUNDS):
            self.engine.update(step.graph, step.values, {}, step.replaced)
            if self.feed.containers is not None:
                self.feed.entered(step, self.engine.getISAM2Result().getNewFactorsIndices())

    def last_values(self, index: dict[str, Ints]) -> Values:
        """What was last believed of every variable that was ever begun."""
        rows: dict[str, Array] = {}
        which: dict[str, Ints] = {}
        for kind, known in index.items():
            found, left, here = require_type(self.problem.kinds[kind], kind), self.left, self.feed.known
            named = zip(known.tolist(), keys_of(kind, known), strict=True)
            ever = [(i, key) for i, key in named if key in left or key in here]
            objects = [left[key] if key in left else self.feed.believed(key) for _, key in ever]
            row = np.array([found.to_row(one) for one in objects], dtype=np.float64)
            rows[kind] = row.reshape(-1, self.problem.kinds[kind].size)
            which[kind] = np.array([i for i, _ in ever], dtype=np.int64)
        return Values(which, rows)
