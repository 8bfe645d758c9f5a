"""Solve once for the result, and again for the time: the first run of a kernel may have compiled it."""

from __future__ import annotations

import time
from dataclasses import fields, replace
from statistics import median
from typing import Any

from factorlab.compare.estimators import make
from sequential.history import Run
from sequential.run import Estimator
from sequential.timeline import Problem

__all__ = ["solve"]

REPEATS = 3
QUICK_S = 0.3  # a solve that takes longer is timed once
DIAGNOSTICS = ("leave_one_out", "covariance")  # settings that ask for what is not part of the estimate


def solve(name: str, problem: Problem, names: tuple[str, ...]) -> dict[str, tuple[Run, float]]:
    """Run and seconds of an estimator; both halves at once where iSAM2's online and final rows are wanted.

    The seconds are the estimator's own, the median of warm runs: from the schedule to the estimate, without
    the marginal covariances of graphs and without leave-one-out residuals.
    """
    estimator = make(name)
    if {"isam2", "isam2_final"} <= set(names) and name in {"isam2", "isam2_final"}:
        both: Any = estimator
        online, final = both.solve_both(problem)
        return {"isam2": (online, online.report.seconds), "isam2_final": (final, final.report.seconds)}
    began = time.perf_counter()
    run = estimator.solve(problem)
    first = time.perf_counter() - began
    lean = _lean(estimator)
    if lean is estimator and first > QUICK_S and run.report.seconds > 0.5 * first:
        # nothing was compiled outside the estimator's own clock
        return {name: (run, run.report.seconds)}
    return {name: (run, _seconds(lean, problem))}


def _seconds(estimator: Estimator, problem: Problem) -> float:
    times: list[float] = []
    while len(times) < REPEATS and (not times or times[-1] < QUICK_S):
        times.append(estimator.solve(problem).report.seconds)
    return median(times)


def _lean(estimator: Any) -> Any:
    """The same estimator without the diagnostics that can be switched off."""
    present = [field.name for field in fields(estimator) if field.name in DIAGNOSTICS]
    return replace(estimator, **dict.fromkeys(present, False)) if present else estimator
