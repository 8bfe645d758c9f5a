"""One verb: run(estimator, model, log)."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sequential.history import Run
from sequential.log import SensorLog
from sequential.model import StateSpace
from sequential.timeline import Problem, prepare

__all__ = ["Estimator", "run"]


class Estimator(Protocol):
    """Anything that solves a problem: filters and smoothers here, graphs in `factorlab.graph`."""

    @property
    def name(self) -> str:
        """Short name, as in tables and on the command line."""
        ...

    def solve(self, problem: Problem) -> Run:
        """Estimate the state at every node."""
        ...


def run(
    estimator: Estimator,
    model: StateSpace,
    log: SensorLog,
    *,
    at: NDArray[np.generic] | None = None,
    max_gap: float | None = None,
) -> Run:
    """Estimate the states of a model from a log.

    Parameters
    ----------
    estimator : which one; swapping it is the only edit
    at : further times at which an estimate is wanted, float seconds or int nanoseconds
    max_gap : longest pause of the input stream that is bridged, s

    Raises
    ------
    DataError, ModelError, SolverError
        see `sequential.errors`; each says what to do.
    """
    problem = prepare(model, log, at, max_gap)
    solved = estimator.solve(problem)
    if not problem.missing:
        return solved
    return replace(solved, report=replace(solved.report, missing=problem.missing))
