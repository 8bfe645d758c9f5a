"""The whole log as one factor graph."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from factorlab.graph.batched import ChainGraph
from factorlab.graph.marginals import chain_marginals
from factorlab.graph.native import NativeGraph, native_graph
from factorlab.graph.solve import Solved, optimise
from sequential.errors import ModelError
from sequential.history import Report, Run
from sequential.smoothers import RauchTungStriebel
from sequential.smoothers.leave_one_out import leave_one_out
from sequential.timeline import Problem

__all__ = ["BatchGraph", "build"]

Array = NDArray[np.float64]
ROUTES = ("auto", "native", "batched")


@dataclass(frozen=True, slots=True)
class BatchGraph:
    """Maximum a posteriori trajectory by GTSAM.

    Parameters
    ----------
    route : `"native"` C++ factors, `"batched"` linearisation (any model), or `"auto"`: native where it can be
    covariance : also compute the marginals of every node; they are not part of the reported seconds
    max_iterations : of Gauss-Newton
    tolerance : the batched route stops at a tangent step below this
    check : raise where the solver has not settled
    """

    route: str = "auto"
    covariance: bool = True
    max_iterations: int = 50
    tolerance: float = 1e-7
    check: bool = True
    name = "batch"

    def __post_init__(self) -> None:
        if self.route not in ROUTES:
            msg = f"route is one of {', '.join(ROUTES)}, got {self.route!r}"
            raise ModelError(msg)

    def solve(self, problem: Problem) -> Run:
        """Build, solve, check; raises `UnderConstrainedError`, `NotConvergedError`, `ModelError`."""
        native = None if self.route == "batched" else native_graph(problem)
        if native is None and self.route == "native":
            msg = "this model has a process or sensor without a native GTSAM factor; use route='batched'"
            raise ModelError(msg)
        began = time.perf_counter()
        start = RauchTungStriebel(leave_one_out=False).solve(problem)
        run = self._native(problem, native, start.mean) if native else self._batched(problem, start.mean)
        details = {**run.report.details, "start_s": start.report.seconds}
        seconds = details["finished"] - began
        report = replace(
            run.report, seconds=seconds, details={k: v for k, v in details.items() if k != "finished"}
        )
        run = replace(run, report=report, log_likelihood=start.log_likelihood)
        return replace(run, innovations=leave_one_out(problem, run)) if self.covariance else run

    def _native(self, problem: Problem, native: NativeGraph, start: Array) -> Run:
        began = time.perf_counter()
        graph, values = build(native, start)
        built = time.perf_counter()
        solved = optimise(graph, values, problem, self.max_iterations, check=self.check)
        finished = time.perf_counter()
        mean = np.stack([native.read(solved.values, k) for k in range(len(problem.t))])
        cov = native.covariances(graph, solved.values, mean) if self.covariance else unknown(problem)
        return self._run(problem, mean, cov, solved, (began, built, finished))

    def _batched(self, problem: Problem, start: Array) -> Run:
        began = time.perf_counter()
        chain = ChainGraph(problem)
        built = time.perf_counter()
        solved = chain.solve(start, self.max_iterations, self.tolerance, check=self.check)
        finished = time.perf_counter()
        cov = chain_marginals(problem, solved.values) if self.covariance else unknown(problem)
        return self._run(problem, solved.values, cov, solved, (began, built, finished))

    def _run(
        self, problem: Problem, mean: Array, cov: Array, solved: Solved, clock: tuple[float, ...]
    ) -> Run:
        began, built, finished = clock
        details = {
            "build_s": built - began,
            "solve_s": finished - built,
            "finished": finished,
            "newton_decrement": solved.decrement,
        }
        report = Report(
            self.name,
            solved.settled,
            solved.iterations,
            cost=solved.cost,
            message=solved.message(),
            details=details,
        )
        return Run(problem.t, mean, cov, problem.model.manifold, {}, float("nan"), report)


def unknown(problem: Problem) -> Array:
    """Covariances (K, d, d) that nobody asked for."""
    d = problem.model.manifold.dim
    return np.full((len(problem.t), d, d), np.nan)


def build(native: NativeGraph, start: Array) -> tuple[Any, Any]:
    """Factors and initial values of a problem, from a trajectory (K, n)."""
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    native.insert_shared(values, start[0])
    for factor in native.prior_factors():
        graph.add(factor)
    for k, x in enumerate(start):
        native.insert(values, k, x)
        factors = native.move(k, start[k - 1])[0] if k else []
        for factor in factors + native.reading_factors(k):
            graph.add(factor)
    return graph, values
