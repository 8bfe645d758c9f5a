"""The forms in which a Kalman filter can carry its covariance: one filter, four ways to round.

"joseph"       the full covariance, P <- (I - K H) P (I - K H)ᵀ + K R Kᵀ: the default, and the quickest.
"ud"           P = U D Uᵀ (Bierman and Thornton): loses least where readings are nearly exact or alike.
"sqrt"         P = L Lᵀ by Householder arrays: never indefinite, half the digits of a condition number saved.
"information"  Y = P⁻¹: a reading is a sum.  Needs transitions that can be inverted, and cannot be iterated.

All four give the same estimates, innovations and likelihood where double precision suffices.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from sequential.errors import ModelError, NotPositiveDefiniteError
from sequential.filters.specialised import Sizes, made_for
from sequential.history import Run
from sequential.timeline import Problem

__all__ = ["FORMS", "kernel_of", "named", "or_in_ud", "require_form", "require_informed"]

FORMS = ("joseph", "ud", "sqrt", "information")


def named(name: str, form: str) -> str:
    """`ekf`, or `ekf_ud` where the form is not the usual one."""
    return name if form == "joseph" else f"{name}_{form}"


def require_form(form: str, *, iterated: bool = False, specialise: bool = False) -> None:
    """Raise `ModelError` where there is no such form, or where it cannot be iterated."""
    if form not in FORMS:
        msg = f"a filter has no form {form!r}; the forms are {', '.join(map(repr, FORMS))}"
        raise ModelError(msg)
    if specialise and form != "joseph":
        msg = f"form {form!r} has no kernels of one size; leave out specialise=True, or take form='joseph'"
        raise ModelError(msg)
    if iterated and form == "information":
        msg = (
            "the information form cannot iterate an update, since it keeps no covariance of the prediction; "
            "use form='ud', or ExtendedKalmanFilter(form='information')"
        )
        raise ModelError(msg)


def kernel_of(form: str, iterations: int, sizes: Sizes) -> Callable[..., tuple[float, int]]:
    """The compiled filter of a form: (tables, schedule, mean, cov, keep, out) -> (log likelihood, code)."""
    if form == "information":
        from sequential.kernels.information import filter_information

        return filter_information  # type: ignore[no-any-return]
    if form in {"ud", "sqrt"}:
        from sequential.kernels.factored import ROOT, UD, filter_factored

        kept = UD if form == "ud" else ROOT
        return lambda a, b, mean, cov, keep, out: filter_factored(
            a, b, mean, cov, kept, iterations, keep, out
        )
    from sequential.kernels.extended import filter_log

    kernel = made_for(filter_log) if any(sizes) else filter_log
    return lambda a, b, mean, cov, keep, out: kernel(a, b, mean, cov, iterations, keep, out, *sizes)


def or_in_ud(default: Callable[[], Run], in_ud: Callable[[], Run]) -> Run:
    """What the default form finds, or UD form where rounding left that an indefinite covariance."""
    try:
        return default()
    except NotPositiveDefiniteError as lost:
        run = in_ud()
        message = f"solved in UD form, since in the default form {lost.args[0].split(':')[0]}"
        kept = f"{run.report.message}; {message}" if run.report.message else message
        return replace(run, report=replace(run.report, message=kept))


def require_informed(problem: Problem, form: str, failed: int, filtered: Any) -> None:
    """Raise `ModelError` where the information form could not move to a node, or take a perfect reading."""
    if form != "information" or failed == -1:
        return
    if failed >= 0:
        name = list(problem.model.sensors)[problem.schedule.sensor[failed]]
        noise = problem.schedule.noise_cov[problem.schedule.noise_row[failed]]
        m = problem.model.sensors[name].manifold.dim
        if not np.linalg.det(noise[:m, :m]) > 0.0:
            msg = f"sensor {name!r} reads without noise, which is infinite information; use form='ud'"
            raise ModelError(msg)
        return
    node = -2 - failed
    if np.isfinite(filtered.mean[node]).all():
        msg = (
            f"the information form cannot move to {problem.t[node] * 1e-9:.6f} s: the transition cannot "
            "be inverted, or so much noise enters that no information is left; use form='ud'"
        )
        raise ModelError(msg)
