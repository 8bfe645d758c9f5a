"""An engine fed step by step, and what it believed of the newest pose at each."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.slam.feeding import Feed, Step
from factorlab.graph.slam.variables import SHIFT, require_type
from factorlab.graph.solve import Solved
from sequential.history import Report, Run
from sequential.slam import SlamProblem

__all__ = ["ROUNDS", "Walk", "believer", "isam_parameters"]

Array = NDArray[np.float64]
ROUNDS = 5  # updates without news at the end, at most


def isam_parameters(threshold: float, every: int) -> Any:
    """Relinearise what moved by more than `threshold`, looked for every so many updates."""
    parameters = gtsam.ISAM2Params()
    parameters.relinearizeSkip = every
    parameters.setRelinearizeThreshold(threshold)
    return parameters


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
            for key in step.new:
                if key > newest and key >> SHIFT == letter:
                    newest = key
            if newest >= 0:
                self.numbers.append(step.number)
                self.believed.append(believed(newest))
                self.feed.newest = {newest: self.believed[-1]}
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
            details["chi2"], cost = 2.0 * solved.cost, solved.cost
            if np.isfinite(solved.decrement):
                details["newton_decrement"] = solved.decrement
                message, settled = solved.message(), solved.settled
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
