"""Gauss-Newton on the whole chain, by linear filtering and smoothing about the last trajectory."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from sequential.errors import NotConvergedError
from sequential.filters.solution import require_finite
from sequential.history import Report, Run
from sequential.smoothers.chain import ChainPass
from sequential.smoothers.leave_one_out import leave_one_out, require_noise
from sequential.smoothers.rauch_tung_striebel import RauchTungStriebel
from sequential.timeline import Problem

__all__ = ["IteratedSmoother"]


@dataclass(frozen=True, slots=True)
class IteratedSmoother:
    """Maximum a posteriori trajectory: the iterated Kalman smoother (Bell 1994), from an EKF + RTS start.

    Solves the same least-squares problem as a batch factor graph, at the cost of a few filter passes.

    Parameters
    ----------
    max_iterations : Gauss-Newton steps; six or so without a robust loss, dozens with a Cauchy loss
    tolerance : stop when no tangent step exceeds this many standard deviations of the state
    check : raise where it has not settled
    leave_one_out : also predict each reading from all others (`Run.innovations`)
    """

    max_iterations: int = 100
    tolerance: float = 1e-4
    check: bool = True
    leave_one_out: bool = True
    name = "ieks"

    def solve(self, problem: Problem) -> Run:
        """Smooth the whole log; raises `NotConvergedError` unless `check` is False."""
        require_noise(problem, "the iterated smoother cannot tell when it has settled: use RauchTungStriebel")
        began = time.perf_counter()
        start = RauchTungStriebel(leave_one_out=False).solve(problem)
        run = self.refine(problem, start.mean)
        seconds = time.perf_counter() - began
        run = replace(run, report=replace(run.report, seconds=seconds), log_likelihood=start.log_likelihood)
        return replace(run, innovations=leave_one_out(problem, run)) if self.leave_one_out else run

    def refine(self, problem: Problem, trajectory: np.ndarray) -> Run:
        """Gauss-Newton from a given trajectory (K, n)."""
        chain = ChainPass(problem, problem.schedule)
        prior, manifold = problem.model.prior, problem.model.manifold
        largest, iteration = np.inf, 0
        while iteration < self.max_iterations and largest > self.tolerance:
            iteration += 1
            chain.solve(prior.mean, prior.cov, trajectory)
            largest = chain.largest()
            trajectory = manifold.retract(trajectory, chain.step)
            require_finite(problem, trajectory)
        converged = largest <= self.tolerance
        message = "" if converged else f"still moving by {largest:.2g} σ after {iteration} iterations"
        if not converged and self.check:
            raise NotConvergedError(
                f"the iterated smoother is {message}; raise max_iterations or mend the start"
            )
        report = Report(self.name, converged, iteration, message=message or chain.whole.message())
        return Run(problem.t, trajectory, chain.cov, manifold, {}, float("nan"), report)
