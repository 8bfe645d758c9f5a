"""One Gauss-Newton pass over a chain of nodes: smoothers iterate it, graphs read their marginals from it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.compile import compiled
from sequential.filters.solution import require_solved
from sequential.manifold import Vector
from sequential.timeline import Problem, Schedule

__all__ = ["ChainPass"]

Array = NDArray[np.float64]


class ChainPass:
    """Memory for passes over some nodes of a problem, and what the last pass found.

    Parameters
    ----------
    plan : the problem's schedule, or a part of it

    Attributes
    ----------
    forward : beliefs about the steps from the past alone, `kernels.iterated.Linearised`
    step : (K, d) tangent steps to the solution of the linearised chain
    cov : (K, d, d) marginal covariances
    """

    def __init__(self, problem: Problem, plan: Schedule) -> None:
        from sequential.kernels.iterated import Linearised

        self.problem, self.plan, self.whole = problem, plan, compiled(problem.model)
        nodes, d = len(plan.reading_ptr) - 1, self.whole.tables.d
        shapes = ((nodes, d), (nodes, d, d), (nodes, d), (nodes, d, d), (nodes, d, d))
        self.forward: Any = Linearised(*map(np.empty, shapes))
        self.step, self.cov = np.empty((nodes, d)), np.empty((nodes, d, d))
        self.flat = Vector(d).table()

    def solve(self, prior_mean: Array, prior_cov: Array, trajectory: Array) -> None:
        """Linearise about a trajectory (K, n), robust weights taken there, and solve.

        Raises
        ------
        NotPositiveDefiniteError
        """
        from sequential.kernels.iterated import filter_steps
        from sequential.kernels.smoothing import smooth_history

        states = np.ascontiguousarray(trajectory)
        failed = filter_steps(self.whole.tables, self.plan, prior_mean, prior_cov, states, self.forward)
        self.whole.raise_failures()
        require_solved(self.problem, failed)
        smooth_history(self.flat, *self.forward, 1, self.step, self.cov)

    def largest(self) -> float:
        """Largest step, in standard deviations."""
        sigmas = np.sqrt(np.diagonal(self.cov, axis1=1, axis2=2).clip(1e-300))
        return float(np.max(np.abs(self.step) / sigmas))
