"""The Kalman filter of linear models."""

from __future__ import annotations

from dataclasses import dataclass

from sequential.errors import ModelError, NonlinearModelError
from sequential.filters.extended import filter_problem
from sequential.filters.forms import named, or_in_ud, require_form
from sequential.filters.linear import filter_linear_problem
from sequential.history import Run
from sequential.model import StateSpace
from sequential.timeline import Problem

__all__ = ["KalmanFilter"]


@dataclass(frozen=True, slots=True)
class KalmanFilter:
    """Exact for linear models with Gaussian noise (Kalman 1960); refuses any other model.

    Parameters
    ----------
    keep : keep predictions and transitions, which smoothers need
    form : how the covariance is carried, see `sequential.filters.forms`
    freeze : keep the gain once the covariance changes by less than this share of itself from reading to
        reading, such as 1e-12, until the rhythm of the readings changes: several times as quick on a long,
        even log.  Without effect with `keep`, or where an input drives the process
    specialise : compile the loop for this size of model, once per machine: `sequential.filters.specialised`.
        By default for the sizes of tracks on a line, in the plane and in space, which `make` compiles before
    """

    keep: bool = False
    form: str = "joseph"
    freeze: float | None = None
    specialise: bool | None = None

    def __post_init__(self) -> None:
        require_form(self.form, specialise=bool(self.specialise))
        require_freeze(self.freeze, self.form)

    @property
    def name(self) -> str:
        """Short name, with the form behind it where it is not the usual one."""
        return named("kf", self.form)

    def solve(self, problem: Problem) -> Run:
        """Filter the whole log; raises `NonlinearModelError` where the model is not linear."""
        require_linear(problem.model)
        if self.form != "joseph":
            return filter_problem(problem, self.name, 1, keep=self.keep, form=self.form)
        name, keep, freeze = self.name, self.keep, self.freeze or 0.0
        return or_in_ud(
            lambda: filter_linear_problem(
                problem, name, keep=keep, specialise=self.specialise, freeze=freeze
            ),
            lambda: filter_problem(problem, name, 1, keep=keep, form="ud"),
        )


def require_freeze(freeze: float | None, form: str) -> None:
    """Raise where a gain cannot be frozen."""
    if freeze is None:
        return
    if not 0.0 < freeze < 1.0:
        msg = f"freeze is a share of the covariance between 0 and 1, such as 1e-12; got {freeze}"
        raise ModelError(msg)
    if form != "joseph":
        msg = f"form {form!r} computes its factors at every reading; freeze the gain of form='joseph'"
        raise ModelError(msg)


def require_linear(model: StateSpace) -> None:
    """Raise a sentence that names what is not linear."""
    if model.manifold.size != model.manifold.dim or any(b.kind != 0 for b in model.manifold.blocks()):
        culprit = f"the state lives on {model.manifold}"
    elif not model.process.linear:
        culprit = f"{type(model.process).__name__} is not declared linear"
    else:
        curved = [name for name, sensor in model.sensors.items() if not sensor.linear]
        if not curved:
            return
        culprit = f"sensor {curved[0]!r} is not declared linear"
    msg = f"KalmanFilter takes linear models only: {culprit}; use ExtendedKalmanFilter()"
    raise NonlinearModelError(msg)
