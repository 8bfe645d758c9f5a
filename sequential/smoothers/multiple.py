"""Smoothing what an interacting multiple model filter believed."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from sequential.compile import compiled
from sequential.filters.multiple import InteractingMultipleModel
from sequential.filters.switching import stack, transitions_of
from sequential.history import ModeHistory, Report, Run
from sequential.timeline import Problem, sealed

__all__ = ["smooth_multiple"]


def smooth_multiple(estimator: InteractingMultipleModel, problem: Problem, name: str) -> Run:
    """Filter forwards and smooth backwards, each model after each (Kim 1994; see the kernel).

    The innovations stay those of the filter: leaving a reading out of a mixture has no closed form.
    """
    from sequential.kernels.multiple_smoothing import smooth_modes

    forward = estimator.solve(problem)
    assert forward.modes is not None  # noqa: S101 - for the type checker
    modes, alive = stack(problem, estimator.models)
    count = len(estimator.models)
    transitions = transitions_of(problem.t, count, estimator.transition, estimator.switching_rate)
    like = (forward.modes.mean, forward.modes.cov, forward.modes.probability, forward.mean, forward.cov)
    out = tuple(map(np.empty_like, like))
    began = time.perf_counter()
    base = compiled(problem.model).tables
    smooth_modes(base, modes, problem.schedule, sealed(transitions), *like[:3], out)
    for whole in alive[0]:
        whole.raise_failures()
    seconds = forward.report.seconds + time.perf_counter() - began
    report = Report(name, seconds=seconds, message=forward.report.message, rejected=forward.report.rejected)
    history = ModeHistory(out[2], out[0], out[1])
    return replace(forward, mean=out[3], cov=out[4], report=report, modes=history)
