"""Run every estimator on one log, time it, score it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from factorlab.compare.accuracy import errors_of
from factorlab.compare.axes import axis_errors
from factorlab.compare.bought import Bought, Told, bought
from factorlab.compare.estimators import EVERY_NAME, KINDS, require_names
from factorlab.compare.fitting import fit
from factorlab.compare.honesty import nis_of, normalised_error_of
from factorlab.compare.lag_sweep import Lag, lag_sweep
from factorlab.compare.pair import filter_of, smoother_of
from factorlab.compare.resources import resources
from factorlab.compare.table import Comparison, Row, Tuned
from factorlab.compare.timing import solve
from factorlab.compare.verdict import Finding, findings_of
from factorlab.datasets import Dataset
from sequential.errors import FactorlabError
from sequential.history import Run
from sequential.model import StateSpace
from sequential.smoothers import FixedLagSmoother
from sequential.timeline import Problem, prepare

__all__ = ["Progress", "compare"]

Progress = Callable[[str, int, int], None]


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
    fitted: tuple[Tuned, StateSpace] | None = None,
    lags: Sequence[float] | None = None,
) -> Comparison:
    """Run estimators side by side on one recording.

    Parameters
    ----------
    estimators : names, see `factorlab.compare.NAMES`; by default those that the dataset recommends
    tune : fit the noise to the readings in use first, and keep the table from before
    seed : of the resampling behind the bootstrap bands
    max_gap : longest pause of the input stream that is bridged, s
    progress : called with what is being done, how much is done, and out of how much
    fitted : noise that was fitted already, in place of `tune`
    lags : windows, in seconds, of a fixed-lag smoother; by default those that the dataset recommends

    Raises
    ------
    DataError, ModelError
        where the log or the model is at fault; a solver that fails becomes a row with its message.
    """
    names = require_names(tuple(estimators) if estimators else _recommended(dataset))
    tune = tune or fitted is not None
    lags = tuple(dataset.lags if lags is None else lags)
    step = _Steps(progress, len(names) * (2 if tune else 1) + tune + 1 + bool(lags))
    untuned: tuple[Row, ...] = ()
    tuned, model = None, dataset.model
    if tune:
        untuned = _rows(names, dataset, _problem(dataset, model, max_gap), seed, step, ", as shipped")
        step("tuning the noise")
        tuned, model = fitted or fit(dataset)
    problem = _problem(dataset, model, max_gap)
    rows = _rows(names, dataset, problem, seed, step, ", tuned" if tune else "")
    step("diagnosis")
    findings = findings_of(problem, rows)
    swept: tuple[Lag, ...] = ()
    if lags:
        step("lags")
        swept = _swept(dataset, problem, lags)
    gain = _gain(rows, findings)
    return Comparison(dataset, model, rows, findings, _readings(dataset), seed, untuned, tuned, swept, gain)


def _swept(dataset: Dataset, problem: Problem, lags: Sequence[float]) -> tuple[Lag, ...]:
    """Windows of several lengths, settled by the chain solver, which takes every model."""
    return lag_sweep(
        lambda lag: FixedLagSmoother(lag).solve_both(problem),
        lambda run: errors_of(dataset, problem.model, run),
        lags,
        _readings(dataset),
        lambda run: axis_errors(dataset, run),
    )


def _gain(rows: tuple[Row, ...], findings: tuple[Finding, ...]) -> Bought | None:
    """The first filter beside the smoother that stands for all; None where one of them is missing."""
    before, after = filter_of(rows), smoother_of(rows)
    return None if before is None or after is None else bought(_told(before), _told(after), findings)


def _told(row: Row) -> Told:
    honest, nis = row.normalised_error, row.nis
    assert row.resources is not None  # noqa: S101 - solved rows have them
    return Told(
        row.name,
        row.title,
        row.rmse,
        None if honest is None else honest.mean / honest.expected,
        None if nis is None or nis.kind != "filter" else nis.mean / nis.expected,
        row.us_per_measurement,
        row.resources.latency_s,
        row.resources.memory_kb,
    )


def _recommended(dataset: Dataset) -> tuple[str, ...]:
    """The dataset's own choice; one pass of iSAM2 gives two rows."""
    chosen = dataset.default_estimators
    wanted = {*chosen, "isam2_final"} if "isam2" in chosen else set(chosen)
    return tuple(name for name in EVERY_NAME if name in wanted)


class _Steps:
    """Counts steps for a progress bar: each call begins the next one."""

    def __init__(self, progress: Progress, total: int) -> None:
        self.progress, self.total, self.begun = progress, total, 0

    def __call__(self, what: str) -> None:
        self.progress(what, self.begun, self.total)
        self.begun += 1


def _problem(dataset: Dataset, model: StateSpace, max_gap: float | None) -> Problem:
    return prepare(model, dataset.log, at=_scored_times(dataset, model), max_gap=max_gap)


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


def _rows(
    names: tuple[str, ...], dataset: Dataset, problem: Problem, seed: int, step: _Steps, when: str
) -> tuple[Row, ...]:
    rows: dict[str, Row] = {}
    for name in names:
        step(f"{KINDS[name].title}{when}")
        if name in rows:
            continue  # the other half of a pass over iSAM2
        try:
            solved = solve(name, problem, names)
        except FactorlabError as error:
            rows[name] = Row(name, message=" ".join(str(error).split()))
            continue
        for found, (run, seconds) in solved.items():
            rows[found] = _row(found, dataset, problem, seed, run, seconds)
    return tuple(rows[name] for name in names)


def _row(name: str, dataset: Dataset, problem: Problem, seed: int, run: Run, seconds: float) -> Row:
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
        axis_errors(dataset, run),
        resources(name, run),
    )
