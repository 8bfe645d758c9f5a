"""The compiled filter of linear models."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from sequential.compile import compiled
from sequential.filters.solution import allocate, finished
from sequential.filters.specialised import made_for, sizes_of
from sequential.history import Run
from sequential.model import StateSpace
from sequential.timeline import Problem, sealed

__all__ = ["filter_linear_problem", "without_context"]


def filter_linear_problem(
    problem: Problem, name: str, *, keep: bool, specialise: bool | None, freeze: float = 0.0
) -> Run:
    """Run the compiled linear filter and read its arrays."""
    from sequential.kernels.linear import filter_linear
    from sequential.kernels.records import Filtered

    whole, model = compiled(problem.model), problem.model
    out = Filtered(*allocate(problem, whole.tables, keep=keep))
    constant = without_context(model)
    freeze = 0.0 if keep or model.process_functions.inputs else freeze
    driven = int(model.process_functions.inputs > 0)
    began = time.perf_counter()
    _, state, reading = sizes_of(whole.tables, "linear", specialise=specialise)
    kernel = made_for(filter_linear) if state or reading else filter_linear
    log_likelihood, failed = kernel(
        whole.tables, problem.schedule, model.prior.mean, model.prior.cov, driven, constant, int(keep),
        freeze, out, state, reading,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    return finished(problem, whole, out, name, (log_likelihood, failed, seconds), keep=keep)


def without_context(model: StateSpace) -> NDArray[np.int64]:
    """(S,) 1 for the sensors whose matrix is the same at every reading."""
    return sealed(np.array([f.inputs == 0 for f in model.sensor_functions.values()], dtype=np.int64))
