"""The unscented Kalman filter: sigma points instead of Jacobians."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.compile import compiled
from sequential.errors import ModelError
from sequential.filters.solution import allocate, as_run, require_finite, require_solved
from sequential.history import Report, Run
from sequential.timeline import Problem, sealed

__all__ = ["UnscentedKalmanFilter"]


@dataclass(frozen=True, slots=True)
class UnscentedKalmanFilter:
    """Carry 2d + 1 points through the models and regress on them (van der Merwe 2004, ch. 3).

    The points are x and x ⊕ ±γ L_i, with L the lower Cholesky factor of the covariance and γ² = α² (d + κ).
    They are drawn again before every step and every reading; noise is additive.

    Parameters
    ----------
    alpha : α, spread of the points; on a rotation known to σ rad, γσ must stay well below π
    beta : β, 2 is best for Gaussians
    kappa : κ, secondary spread
    keep : keep predictions and transitions (slopes of the regression), which smoothers need

    Raises
    ------
    ModelError
        where the points would not spread: α ≤ 0 or d + κ ≤ 0.
    """

    alpha: float = 1.0
    beta: float = 2.0
    kappa: float = 0.0
    keep: bool = False
    name = "ukf"

    def weights(self, dim: int) -> NDArray[np.float64]:
        """[γ, weight of the central point in a mean, in a covariance, weight of any other] for d = `dim`."""
        scale = self.alpha**2 * (dim + self.kappa)
        if not (self.alpha > 0 and scale > 0 and math.isfinite(scale)):
            raise ModelError(
                f"UnscentedKalmanFilter(alpha={self.alpha}, kappa={self.kappa}) does not spread its points "
                f"over {dim} directions: alpha must be positive and kappa above {-dim}"
            )
        central = 1.0 - dim / scale
        return np.array([math.sqrt(scale), central, central + 1.0 - self.alpha**2 + self.beta, 0.5 / scale])

    def solve(self, problem: Problem) -> Run:
        """Filter the whole log."""
        from sequential.kernels.records import Filtered
        from sequential.kernels.unscented import filter_sigma_points

        whole = compiled(problem.model)
        out = Filtered(*allocate(problem, whole.tables, keep=self.keep))
        prior, weights = problem.model.prior, sealed(self.weights(whole.tables.d))
        began = time.perf_counter()
        log_likelihood, failed = filter_sigma_points(
            whole.tables, problem.schedule, prior.mean, prior.cov, weights, int(self.keep), out
        )
        seconds = time.perf_counter() - began
        whole.raise_failures()
        require_solved(problem, failed, out)
        require_finite(problem, out.mean)
        rejected = int((out.accepted == 0).sum())
        report = Report(self.name, seconds=seconds, message=whole.message(), rejected=rejected)
        return as_run(problem, out, log_likelihood, report, keep=self.keep)
