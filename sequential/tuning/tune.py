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
from sequential.tuning.knobs import Knob, Tuning
from sequential.tuning.likelihood import Posterior
from sequential.tuning.search import climb

__all__ = ["tune"]

PER_KNOB = 100  # filter passes that the search may take for each knob


def tune(
    build: Callable[[Mapping[str, float]], StateSpace],
    knobs: Sequence[Knob],
    log: SensorLog,
    at: NDArray[np.generic] | None = None,
    estimator: Estimator | None = None,
) -> Tuning:
    """Turn the knobs of a model until a filter finds its readings most probable.

    Maximises the log likelihood of the innovations plus a log-normal prior about the initial values, which
    keeps a level that the log says nothing about where it was.  Only readings in `log` are used: hold out
    the others before.

    Parameters
    ----------
    build : from values by name to a model whose layout does not depend on them
    knobs : what to turn
    at : further nodes, as in `run`; they cost time and change nothing
    estimator : a recursive filter; `ExtendedKalmanFilter()` unless given

    Raises
    ------
    ModelError
        where there is no knob, two share a name, or the builder changes the layout.
    DataError, ModelError, SolverError
        what the estimator raises at the initial values.

    Notes
    -----
    Mehra 1970, On the identification of variances and adaptive Kalman filtering; the likelihood is
    Schweppe's.  Uncertainty is the Laplace approximation: the inverse Hessian at the optimum.
    """
    names = [knob.name for knob in knobs]
    if not names or len(set(names)) < len(names):
        raise ModelError(f"tune needs knobs with different names, got {names}")
    began = time.perf_counter()
    initial = {knob.name: knob.initial for knob in knobs}
    problem = prepare(build(initial), log, at)
    posterior = Posterior(build, tuple(knobs), problem, estimator or ExtendedKalmanFilter())
    before = posterior.log_likelihood(np.zeros(len(names)))
    summit = climb(posterior, len(names), PER_KNOB * len(names))
    decades = summit.curvature.sigmas() * [knob.decades for knob in knobs]
    return Tuning(
        values=posterior.values(summit.at),
        initial=initial,
        log_likelihood_before=before,
        log_likelihood_after=summit.value + 0.5 * float(summit.at @ summit.at),
        evaluations=posterior.evaluations,
        seconds=time.perf_counter() - began,
        message=summit.message,
        decades={name: float(sigma) for name, sigma in zip(names, decades, strict=True)},
        converged=summit.converged,
    )
