"""Run every estimator on one log, time it, score it."""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median

import numpy as np
from factorlab.compare.fitting import fit
from factorlab.compare.verdict import findings_of
from numpy.typing import NDArray

from factorlab.compare.accuracy import errors_of
from factorlab.compare.estimators import KINDS, make, require_names
from factorlab.compare.honesty import nis_of, normalised_error_of
from factorlab.compare.table import Comparison, Row
from factorlab.datasets import Dataset
from sequential.errors import FactorlabError
from sequential.history import Run
from sequential.model import StateSpace
from sequential.run import Estimator
from sequential.timeline import Problem, prepare

__all__ = ["Progress", "compare"]

Progress = Callable[[str, int, int], None]
REPEATS = 3
QUICK_S = 1.0  # a solve that takes longer is timed once


def silent(what: str, done: int, total: int) -> None:
    """Report progress to nobody."""


def compare(
    dataset: Dataset,
    estimators: tuple[str, ...] | None = None,
    *,
    tune: bool = False,
    seed: int = 0,
    max_gap: float | None = None,
    progress: Progress = silent,
) -> Comparison:
    """Run estimators side by side on one recording.

    Parameters
    ----------
    estimators : names, see `factorlab.compare.NAMES`; by default those that the dataset recommends
    tune : fit the noise to the readings in use first, and keep the table from before
    seed : of the resampling behind the bootstrap bands
    max_gap : longest pause of the input stream that is bridged, s
    progress : called with what is being done, how much is done, and out of how much

    Raises
    ------
    DataError, ModelError
        where the log or the model is at fault; a solver that fails becomes a row with its message.
    """
    names = require_names(tuple(estimators or dataset.default_estimators))
    total = len(names) * (2 if tune else 1) + tune
    done = 0

    def table(model: StateSpace, when: str) -> tuple[Row, ...]:
        nonlocal done
        problem = prepare(model, dataset.log, at=_scored_times(dataset, model), max_gap=max_gap)
        rows = []
        for name in names:
            progress(f"{KINDS[name].title}{when}", done, total)
            rows.append(_row(name, dataset, problem, seed))
            done += 1
        return tuple(rows)

    untuned: tuple[Row, ...] = ()
    tuned, model = None, dataset.model
    if tune:
        untuned = table(model, ", as shipped")
        progress("tuning the noise", done, total)
        tuned, model = fit(dataset)
        done += 1
    rows = table(model, ", tuned" if tune else "")
    progress("done", total, total)
    findings = findings_of(dataset, model, rows)
    return Comparison(dataset, model, rows, findings, _readings(dataset), seed, untuned, tuned)


def _scored_times(dataset: Dataset, model: StateSpace) -> NDArray[np.int64] | None:
    """Times of the held-out readings: an estimate is wanted there."""
    if dataset.held_out is None:
        return None
    t = dataset.held_out.t
    return t if model.start_ns is None else t[t >= model.start_ns]


def _readings(dataset: Dataset) -> int:
    """Readings that the estimators are given, the input's included."""
    model = dataset.model
    streams = [*model.sensors, *([model.input] if model.input else [])]
    return sum(len(dataset.log[name]) for name in streams)


def _row(name: str, dataset: Dataset, problem: Problem, seed: int) -> Row:
    try:
        run, seconds = _timed(make(name), problem, repeat_slow=not KINDS[name].graph)
    except FactorlabError as error:
        return Row(name, message=" ".join(str(error).split()))
    errors = errors_of(dataset, problem.model, run)
    honesty = None if errors is None else normalised_error_of(errors, np.random.default_rng(seed))
    return Row(
        name,
        errors,
        honesty,
        nis_of(run.innovations),
        seconds,
        1e6 * seconds / _readings(dataset),
        run.report.iterations,
        run.report.converged,
        run.report.message,
        run,
    )


def _timed(estimator: Estimator, problem: Problem, *, repeat_slow: bool) -> tuple[Run, float]:
    """A run, and the median wall time of warm ones: the first may have compiled its kernels."""
    run, first = _solve(estimator, problem)
    if first > QUICK_S and not repeat_slow:
        return run, first  # nothing of a graph is compiled here, and once is long enough
    times: list[float] = []
    while len(times) < REPEATS and (not times or times[-1] < QUICK_S):
        times.append(_solve(estimator, problem)[1])
    return run, median(times)


def _solve(estimator: Estimator, problem: Problem) -> tuple[Run, float]:
    began = time.perf_counter()
    run = estimator.solve(problem)
    return run, time.perf_counter() - began
