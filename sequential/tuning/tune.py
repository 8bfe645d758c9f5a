"""Noise levels from the readings themselves: maximum likelihood of the innovations."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.filters import ExtendedKalmanFilter
from sequential.log import SensorLog
from sequential.model import StateSpace
from sequential.run import Estimator
from sequential.timeline import prepare
from sequential.tuning.knobs import Knob
from sequential.tuning.likelihood import Posterior, innovation_log_likelihood
from sequential.tuning.profile import profile_limits
from sequential.tuning.result import Tuning
from sequential.tuning.search import STEP, Summit, climb
from sequential.tuning.verdict import judge

__all__ = ["tune"]

PER_KNOB = 100  # filter passes that the search may take for each knob
OWN = 0.5  # of what is known about a knob, at least this share must come from the readings


def tune(
    build: Callable[[Mapping[str, float]], StateSpace],
    knobs: Sequence[Knob],
    log: SensorLog,
    at: NDArray[np.generic] | None = None,
    estimator: Estimator | None = None,
    *,
    profile: bool = False,
    max_gap: float | None = None,
) -> Tuning:
    """Turn the knobs of a model until a filter finds its readings most probable.

    Maximises the log likelihood of the innovations plus a log-normal prior about the initial values, which
    keeps a level that the log says nothing about where it was; `Tuning.unidentified` names such knobs.  Only
    readings in `log` are used: hold out the others before.

    Parameters
    ----------
    build : from values by name to a model whose layout does not depend on them
    knobs : what to turn
    at : further nodes, as in `run`; they cost time and change nothing
    estimator : a recursive filter; `ExtendedKalmanFilter()` unless given
    profile : 95 % intervals from the profile likelihood, which need not be symmetric and may be open at one
        end; some hundred more filter passes for each knob
    max_gap : longest pause of the input stream that is bridged, s

    Raises
    ------
    ModelError
        where there is no knob, two share a name, or the builder changes the layout.
    DataError, ModelError, SolverError
        what the estimator raises at the initial values.

    Notes
    -----
    Mehra 1970, On the identification of variances and adaptive Kalman filtering; the likelihood is
    Schweppe's.  Uncertainty is the Laplace approximation: the inverse Hessian at the optimum, which the
    search ends with anyway.
    """
    names = require_knobs(knobs)
    began = time.perf_counter()
    initial = {knob.name: knob.initial for knob in knobs}
    problem = prepare(build(initial), log, at, max_gap)
    posterior = Posterior(build, tuple(knobs), problem, estimator or ExtendedKalmanFilter())
    first, declared = posterior.run(np.zeros(len(names)))
    before = innovation_log_likelihood(first, declared)
    apart = STEP / np.maximum([knob.decades for knob in knobs], 1.0)  # no more than that in decades
    summit = climb(posterior, len(names), PER_KNOB * len(names), apart)
    sigmas = summit.curvature.sigmas()
    limits = _profiled(posterior, summit) if profile else {}
    last, tuned = posterior.run(summit.at)
    decades = sigmas * [knob.decades for knob in knobs]
    return Tuning(
        values=posterior.values(summit.at),
        initial=initial,
        log_likelihood_before=before,
        log_likelihood_after=innovation_log_likelihood(last, tuned),
        evaluations=posterior.evaluations,
        seconds=time.perf_counter() - began,
        message=summit.message,
        decades={name: float(sigma) for name, sigma in zip(names, decades, strict=True)},
        converged=summit.converged,
        units={knob.name: knob.unit for knob in knobs},
        limits=limits,
        unidentified=_unidentified(names, summit, limits),
        before=judge(first.innovations, declared.sensors),
        after=judge(last.innovations, tuned.sensors),
        model=tuned,
    )


def require_knobs(knobs: Sequence[Knob]) -> list[str]:
    """Names of the knobs; raises `ModelError` where there is none or two share one."""
    names = [knob.name for knob in knobs]
    if not names or len(set(names)) < len(names):
        raise ModelError(f"tune needs knobs with different names, got {names}")
    return names


def _unidentified(
    names: list[str], summit: Summit, limits: Mapping[str, tuple[float, float]]
) -> tuple[str, ...]:
    """Knobs whose posterior is little narrower than their prior, or whose profile has an open end.

    In units of the prior, precision = 1 (the prior's) + what the readings say with the others profiled out.
    """
    if limits:
        return tuple(n for n in names if limits[n][0] == 0.0 or not np.isfinite(limits[n][1]))
    shape = summit.curvature
    variance = shape.sigmas() ** 2
    if not shape.is_summit():  # which direction rises is not known, so look along the axes alone
        variance = 1.0 / np.maximum(-np.diag(shape.hessian), 1e-300)
    return tuple(name for name, v in zip(names, variance, strict=True) if v > 1.0 - OWN)


def _profiled(posterior: Posterior, summit: Summit) -> dict[str, tuple[float, float]]:
    """Limits of every knob; 0 and infinity stand for open ends."""
    found = {}
    for index, knob in enumerate(posterior.knobs):
        ends = profile_limits(posterior, summit.at, summit.curvature, index)
        low, high = (knob.initial * 10.0 ** (knob.decades * end) for end in ends)
        found[knob.name] = (float(low), float(high))
    return found
