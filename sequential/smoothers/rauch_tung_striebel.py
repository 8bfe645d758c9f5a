"""The fixed-interval smoother of Rauch, Tung and Striebel, behind any filter that keeps its predictions."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sequential.errors import ModelError
from sequential.filters.extended import ExtendedKalmanFilter
from sequential.filters.multiple import InteractingMultipleModel
from sequential.filters.particle import ParticleFilter
from sequential.history import Report, Run
from sequential.smoothers.leave_one_out import leave_one_out
from sequential.smoothers.multiple import smooth_multiple
from sequential.timeline import Problem

__all__ = ["RauchTungStriebel"]


@dataclass(frozen=True, slots=True)
class RauchTungStriebel:
    """Filter forwards, smooth backwards (Rauch, Tung, Striebel 1965; on a manifold as the error state).

    Parameters
    ----------
    filter : any recursive filter with a `keep` setting, or an `InteractingMultipleModel`
    leave_one_out : also predict each reading from all others (`Run.innovations`); costs 50 µs a reading
    """

    filter: Any = field(default_factory=ExtendedKalmanFilter)
    leave_one_out: bool = True

    @property
    def name(self) -> str:
        """The filter's name with `_rts` behind it."""
        return f"{self.filter.name}_rts"

    def solve(self, problem: Problem) -> Run:
        """Smooth the whole log."""
        from sequential.kernels.smoothing import smooth_history

        if isinstance(self.filter, ParticleFilter):
            raise ModelError(
                "particles keep no Gaussian prediction to smooth backwards from; take "
                "BackwardSimulation(ParticleFilter(…)), which draws whole trajectories"
            )
        if isinstance(self.filter, InteractingMultipleModel):
            return smooth_multiple(self.filter, problem, self.name)
        forward = replace(self.filter, keep=True).solve(problem)
        before = forward.predicted
        assert before is not None  # noqa: S101 - keep=True, for the type checker
        mean, cov = np.empty_like(forward.mean), np.empty_like(forward.cov)
        began = time.perf_counter()
        table = problem.model.manifold.table()
        smooth_history(
            table, forward.mean, forward.cov, before.mean, before.cov, before.transition, 1, mean, cov
        )
        seconds = forward.report.seconds + time.perf_counter() - began
        report = Report(
            self.name, seconds=seconds, message=forward.report.message, rejected=forward.report.rejected
        )
        smoothed = Run(
            problem.t, mean, cov, forward.manifold, {}, forward.log_likelihood, report, forward.predicted
        )
        if not self.leave_one_out:
            return smoothed
        return replace(smoothed, innovations=leave_one_out(problem, smoothed, forward))
