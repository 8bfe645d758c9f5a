"""The extended Kalman filter and its iterated form: on a manifold, the error-state filter."""

from __future__ import annotations

import time
from dataclasses import dataclass

from sequential.compile import compiled
from sequential.filters.forms import kernel_of, named, or_in_ud, require_form, require_informed
from sequential.filters.solution import allocate, finished
from sequential.filters.specialised import sizes_of
from sequential.history import Run
from sequential.timeline import Problem

__all__ = ["ExtendedKalmanFilter", "IteratedExtendedKalmanFilter"]


@dataclass(frozen=True, slots=True)
class ExtendedKalmanFilter:
    """Linearise at the prediction, update in Joseph's form.

    On a manifold the error lives in the tangent at the estimate (right perturbations), so this is the
    error-state filter (Solà 2017, Quaternion kinematics for the error-state Kalman filter).  The update
    equals one Gauss-Newton step from the prediction; the covariance stays in the predicted tangent.

    Parameters
    ----------
    keep : keep predictions and transitions, which smoothers need; costs a third of the time
    form : how the covariance is carried, see `sequential.filters.forms`
    specialise : compile the loop for this size of model, once per machine: `sequential.filters.specialised`.
        None does so where the size is a common one
    """

    keep: bool = False
    form: str = "joseph"
    specialise: bool | None = None

    def __post_init__(self) -> None:
        require_form(self.form, specialise=bool(self.specialise))

    @property
    def name(self) -> str:
        """Short name, with the form behind it where it is not the usual one."""
        return named("ekf", self.form)

    def solve(self, problem: Problem) -> Run:
        """Filter the whole log."""
        return filter_safely(problem, self.name, 1, self.form, keep=self.keep, specialise=self.specialise)


@dataclass(frozen=True, slots=True)
class IteratedExtendedKalmanFilter:
    """Iterate each update to the maximum a posteriori estimate (Bell and Cathey 1993).

    Takes every form but "information", which keeps no prediction to iterate from.
    """

    max_iterations: int = 10
    keep: bool = False
    form: str = "joseph"

    def __post_init__(self) -> None:
        require_form(self.form, iterated=True)

    @property
    def name(self) -> str:
        """Short name, with the form behind it where it is not the usual one."""
        return named("iekf", self.form)

    def solve(self, problem: Problem) -> Run:
        """Filter the whole log."""
        iterations = max(self.max_iterations, 2)
        return filter_safely(problem, self.name, iterations, self.form, keep=self.keep)


def filter_safely(
    problem: Problem, name: str, iterations: int, form: str, *, keep: bool, specialise: bool | None = None
) -> Run:
    """Filter in a form; the default one gives way to UD where it ends in an indefinite covariance."""
    if form != "joseph":
        return filter_problem(problem, name, iterations, keep=keep, form=form)
    return or_in_ud(
        lambda: filter_problem(problem, name, iterations, keep=keep, specialise=specialise),
        lambda: filter_problem(problem, name, iterations, keep=keep, form="ud"),
    )


def filter_problem(
    problem: Problem,
    name: str,
    iterations: int,
    *,
    keep: bool,
    form: str = "joseph",
    specialise: bool | None = None,
) -> Run:
    """Run the compiled filter and read its arrays."""
    from sequential.kernels.records import Filtered

    whole = compiled(problem.model)
    out = Filtered(*allocate(problem, whole.tables, keep=keep))
    prior = problem.model.prior
    special = specialise if form == "joseph" and iterations == 1 else False
    filter_log = kernel_of(form, iterations, sizes_of(whole.tables, "extended", specialise=special))
    began = time.perf_counter()
    log_likelihood, failed = filter_log(whole.tables, problem.schedule, prior.mean, prior.cov, int(keep), out)
    seconds = time.perf_counter() - began
    whole.raise_failures()
    require_informed(problem, form, failed, out)
    return finished(problem, whole, out, name, (log_likelihood, failed, seconds), keep=keep)
