"""The unscented and the cubature Kalman filter: sigma points instead of Jacobians."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.compile import compiled
from sequential.errors import ModelError
from sequential.filters.sigma_sets import SigmaSet
from sequential.filters.solution import allocate, finished
from sequential.filters.specialised import made_for, sizes_of
from sequential.history import Run
from sequential.timeline import Problem, sealed

__all__ = ["CubatureKalmanFilter", "UnscentedKalmanFilter"]


@dataclass(frozen=True, slots=True)
class UnscentedKalmanFilter:
    """Carry sigma points through the models and regress on them (van der Merwe 2004, ch. 3).

    The points are x and x ⊕ L u, with L the lower Cholesky factor of the covariance, drawn again before
    every step and every reading; noise is additive.  A direction without uncertainty is a zero column of L.
    The covariance is updated in Joseph's form, and in UD form where S is nearly singular.

    Parameters
    ----------
    alpha : α of "merwe", spread of the points; on a rotation known to σ rad, γσ must stay well below π
    beta : β of "merwe", 2 is best for Gaussians
    kappa : κ of "merwe" and "julier", secondary spread; below zero a covariance may come out indefinite
    keep : keep predictions and transitions (slopes of the regression), which smoothers need
    specialise : compile the loop for this size of model, once per machine: `sequential.filters.specialised`.
        None does so where the size is a common one
    points : "merwe" (2d + 1 points at ±γ along the columns of L, γ² = α² (d + κ)), "julier" (the same with
        α = 1 and β = 0: Julier, Uhlmann 1997) or "simplex" (d + 1 points: Moireau, Chapelle 2011), which
        takes none of α, β and κ

    Raises
    ------
    ModelError
        where there is no such set, or the points would not spread: α ≤ 0 or d + κ ≤ 0.
    """

    alpha: float = 1.0
    beta: float = 2.0
    kappa: float = 0.0
    keep: bool = False
    specialise: bool | None = None
    points: str = "merwe"

    def __post_init__(self) -> None:
        if self.points == "cubature":
            raise ModelError("cubature points are those of CubatureKalmanFilter()")
        self.set()

    @property
    def name(self) -> str:
        """`ukf`, with the set behind it where it is not the usual one."""
        return "ukf" if self.points == "merwe" else f"ukf_{self.points}"

    def set(self) -> SigmaSet:
        """The set of points."""
        return SigmaSet(self.points, self.alpha, self.beta, self.kappa)

    def weights(self, dim: int) -> NDArray[np.float64]:
        """[γ, weight of the central point in a mean, in a covariance, weight of any other] for d = `dim`."""
        return self.set().weights(dim)

    def solve(self, problem: Problem) -> Run:
        """Filter the whole log."""
        return filter_points(problem, self.name, self.set(), keep=self.keep, specialise=self.specialise)


@dataclass(frozen=True, slots=True)
class CubatureKalmanFilter:
    """The unscented filter without a central point and without a setting (Arasaratnam, Haykin 2009).

    Its 2d points at ±√d along the columns of L integrate polynomials of degree three exactly, all with the
    weight 1/2d, so that no covariance can come out indefinite.

    Parameters
    ----------
    keep : keep predictions and transitions, which smoothers need
    """

    keep: bool = False
    name = "ckf"

    def solve(self, problem: Problem) -> Run:
        """Filter the whole log."""
        return filter_points(problem, self.name, SigmaSet("cubature"), keep=self.keep)


def filter_points(
    problem: Problem, name: str, chosen: SigmaSet, *, keep: bool, specialise: bool | None = None
) -> Run:
    """Run the compiled filter with a set of points and read its arrays."""
    from sequential.kernels.records import Filtered
    from sequential.kernels.unscented import filter_sigma_points

    whole = compiled(problem.model)
    out = Filtered(*allocate(problem, whole.tables, keep=keep))
    prior, d = problem.model.prior, whole.tables.d
    weights, unit = sealed(chosen.weights(d)), sealed(chosen.unit(d))
    sizes = sizes_of(whole.tables, "unscented", specialise=specialise)
    kernel = made_for(filter_sigma_points) if any(sizes) else filter_sigma_points
    tables = whole.with_points(problem.model, 1 + (len(unit) or 2 * d), problem.schedule.z.shape[1])
    began = time.perf_counter()
    log_likelihood, failed = kernel(
        tables, problem.schedule, prior.mean, prior.cov, weights, unit, int(keep), out,
        *sizes,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    return finished(problem, whole, out, name, (log_likelihood, failed, seconds), keep=keep)
