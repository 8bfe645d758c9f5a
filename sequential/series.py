"""Many independent series of one linear model in one call."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, NotPositiveDefiniteError, ShapeError
from sequential.log import SensorLog, Stream, nanoseconds
from sequential.model import StateSpace
from sequential.run import Estimator, run
from sequential.timeline import Problem, prepare

__all__ = ["SeriesRun", "filter_series", "run_many"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class SeriesRun:
    """Estimates of N series at K nodes.

    `shared` says that one recursion of the covariance served all series; `cov` is then one seen N times.
    """

    t: Ints  # (K,) ns
    mean: Array  # (N, K, n)
    cov: Array  # (N, K, d, d)
    residual: Array  # (N, M, m) innovations; zero where a component is missing
    innovation_cov: Array  # (N, M, m, m); a missing component has a unit variance of its own
    log_likelihood: Array  # (N,)
    shared: bool

    def nis(self) -> Array:
        """(N, M) normalised innovations squared, χ² with as many degrees of freedom as components there."""
        solved = np.linalg.solve(self.innovation_cov, self.residual[..., None])[..., 0]
        squared: Array = np.einsum("skm,skm->sk", self.residual, solved)
        return squared


def filter_series(
    model: StateSpace,
    t: ArrayLike,
    z: ArrayLike,
    *,
    threads: int | None = None,
    shared: bool | None = None,
    specialise: bool = False,
) -> SeriesRun:
    """Filter many series of readings with one linear model.

    Parameters
    ----------
    model : linear, with one sensor and without an input
    t : (K,) stamps that all series share, float seconds or int nanoseconds
    z : (N, K, m) readings; NaN says that a component is missing
    threads : how many; as many as there are processors unless given
    shared : compute the covariances once for all series.  By default where that is exact: the same components
        are missing in all, the sensor has neither gate nor loss, and no innovation covariance is in doubt
    specialise : compile the loops for this size of model, once per machine

    Raises
    ------
    ModelError, ShapeError, NonlinearModelError, NotPositiveDefiniteError
    """
    name, values, problem = _laid_out(model, t, z)
    obstacle = None if shared is False else _why_not_shared(model, values)
    if shared and obstacle:
        raise ModelError(f"the series cannot share a covariance: {obstacle}")
    threads = (os.cpu_count() or 1) if threads is None else max(1, threads)
    from sequential.filters.series import by_gains, each

    if shared is not False and obstacle is None:
        found = by_gains(problem, values, _spread(len(values), threads), specialise=specialise)
        if found is not None:
            return SeriesRun(problem.t, *found, shared=True)
        if shared:
            raise ModelError("the series cannot share a covariance: an innovation covariance is in doubt")
    found = each(problem, values, _spread(len(values), threads), specialise=specialise)
    lost = np.flatnonzero(np.isnan(found[-1]))
    if len(lost):
        raise NotPositiveDefiniteError(
            f"an innovation covariance of {name!r} is not positive definite in series {lost[0]} "
            f"(and {len(lost) - 1} more); widen the prior or the noise, or look for infinities in z"
        )
    return SeriesRun(problem.t, *found, shared=False)


def run_many(
    estimator: Estimator, model: StateSpace, logs: Iterable[SensorLog], *, threads: int | None = None
) -> list[Any]:
    """`run` on every log, in threads: any estimator and model; for linear models see `filter_series`."""
    workers = (os.cpu_count() or 1) if threads is None else max(1, threads)
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(lambda log: run(estimator, model, log), logs))


def _laid_out(model: StateSpace, t: ArrayLike, z: ArrayLike) -> tuple[str, Array, Problem]:
    """The sensor's name, the readings (N, K, m), and the schedule of a series without gaps."""
    from sequential.filters.kalman import require_linear

    require_linear(model)
    if len(model.sensors) != 1 or model.input is not None:
        raise ModelError(
            f"filter_series takes a model with one sensor and no input, this has {len(model.sensors)} and "
            f"{'no input' if model.input is None else f'the input {model.input!r}'}; use run_many"
        )
    name, sensor = next(iter(model.sensors.items()))
    values = np.ascontiguousarray(z, dtype=np.float64)
    stamps = np.atleast_1d(nanoseconds(t))
    if values.ndim != 3 or values.shape[1:] != (len(stamps), sensor.manifold.dim) or not len(values):
        raise ShapeError(
            f"{len(stamps)} stamps and a sensor of {sensor.manifold.dim} components need z of shape "
            f"(series, {len(stamps)}, {sensor.manifold.dim}), got {values.shape}"
        )
    whole = Stream(stamps, np.zeros(values.shape[1:]))
    problem = prepare(model, SensorLog({name: whole}))
    if len(problem.reading_t) < len(stamps):
        raise ModelError(
            f"the first {len(stamps) - len(problem.reading_t)} stamps are before the model's start"
        )
    return name, values, problem


def _why_not_shared(model: StateSpace, values: Array) -> str | None:
    sensor = next(iter(model.sensors.values()))
    if sensor.gate is not None or sensor.loss is not None:
        return "the sensor has a gate or a loss, so that what is used depends on the readings"
    missing = np.isnan(values)
    if missing.any() and (missing != missing[:1]).any():
        return "they do not miss the same components"
    return None


def _spread(count: int, threads: int) -> Callable[[Callable[[int, int], None]], None]:
    """Calls work(first, last) over shares of the series, in threads."""
    edges = np.linspace(0, count, min(threads, count) + 1).astype(int)

    def over(work: Callable[[int, int], None]) -> None:
        if len(edges) == 2:
            work(0, count)
            return
        with ThreadPoolExecutor(len(edges) - 1) as pool:
            list(pool.map(work, edges[:-1].tolist(), edges[1:].tolist()))

    return over
