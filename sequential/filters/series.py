"""The compiled filter over many series, one by one or by the gains that all of them share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.compile import compiled
from sequential.filters.linear import filter_linear_problem, without_context
from sequential.filters.specialised import made_for, sizes_of
from sequential.log import SensorLog, Stream
from sequential.model import evaluate
from sequential.readings import ReadingNoise
from sequential.timeline import Problem, prepare, sealed

__all__ = ["by_gains", "each"]

Array = NDArray[np.float64]
Spread = Callable[[Callable[[int, int], None]], None]
Found = tuple[Array, Array, Array, Array, Array]


def each(problem: Problem, z: Array, spread: Spread, *, specialise: bool) -> Found:
    """(mean, cov, residual, innovation covariance, log likelihood) of every series by itself."""
    from sequential.kernels.series import filter_each

    whole, prior, m = compiled(problem.model), problem.model.prior, z.shape[2]
    patterns, row = patterns_of(~np.isnan(z))
    rows = sealed(patterns.sum(axis=1)[row].astype(np.int64))
    noise = ReadingNoise(np.zeros(len(patterns), dtype=np.int64), patterns, None, row, rows)
    plan = problem.schedule._replace(noise_cov=sealed(noise.table(problem.model)))
    nodes, n, d = len(problem.t), whole.tables.n, whole.tables.d
    count, readings = z.shape[:2]
    mean, cov = np.empty((count, nodes, n)), np.empty((count, nodes, d, d))
    residual, spread_of = np.zeros((count, readings, m)), np.zeros((count, readings, m, m))
    spread_of[...] = np.eye(m)
    accepted, found = np.ones((count, readings), dtype=np.int64), np.empty(count)
    constant = without_context(problem.model)
    _, state, reading = sizes_of(whole.tables, "linear", specialise=specialise)
    kernel: Any = made_for(filter_each) if specialise else filter_each
    values = sealed(z)

    def work(first: int, last: int) -> None:
        kernel(
            whole.tables, plan, prior.mean, prior.cov, constant, values, sealed(row), rows, mean, cov,
            residual, spread_of, accepted, found, first, last, state, reading,
        )  # fmt: skip

    spread(work)
    whole.raise_failures()
    return mean, cov, residual, spread_of, found


def by_gains(problem: Problem, z: Array, spread: Spread, *, specialise: bool) -> Found | None:
    """The same from one recursion of the covariance; None where an innovation covariance is in doubt."""
    from sequential.kernels.correcting import DOUBTFUL
    from sequential.kernels.series import filter_by_gains

    model = problem.model
    name = next(iter(model.sensors))
    first = SensorLog({name: Stream(problem.reading_t, z[0])})
    one = prepare(model, first, at=problem.t)
    run = filter_linear_problem(one, "kf", keep=True, specialise=specialise)
    assert run.predicted is not None  # noqa: S101 - keep=True
    n, m = model.manifold.dim, z.shape[2]
    H, h = look(model, name)
    used = run.innovations[name]
    at = np.searchsorted(one.t, used.t)
    there = np.isfinite(used.residual)
    lower = np.linalg.cholesky(used.cov) if len(at) else np.zeros((0, m, m))
    pivots = np.diagonal(lower, axis1=1, axis2=2) ** 2 / np.diagonal(used.cov, axis1=1, axis2=2)
    if len(at) and pivots.min() < DOUBTFUL:
        return None  # such an update is redone in UD form, which gives no gain
    # every stamp has a row here; those without a reading have a gain of zero
    row = np.searchsorted(problem.reading_t, used.t)
    readings = len(problem.reading_t)
    gain, whitener, log_det = np.zeros((readings, m, n)), np.zeros((readings, m, m)), np.zeros(readings)
    seen = H * there[:, :, None]
    gain[row] = np.linalg.solve(used.cov, seen @ run.predicted.cov[at])
    whitener[row] = np.linalg.inv(lower)
    log_det[row] = np.linalg.slogdet(used.cov)[1] + there.sum(axis=1) * np.log(2.0 * np.pi)
    innovation_cov = np.broadcast_to(np.eye(m), (readings, m, m)).copy()
    innovation_cov[row] = used.cov
    before = np.concatenate([model.prior.mean[None], run.mean[:-1]])
    offset = run.predicted.mean - np.einsum("kij,kj->ki", run.predicted.transition, before)
    reading_of = np.full(len(problem.t), -1, dtype=np.int64)
    reading_of[np.searchsorted(problem.t, problem.reading_t)] = np.arange(readings)
    count = len(z)
    mean, residual, found = (
        np.empty((count, len(problem.t), n)),
        np.empty((count, readings, m)),
        np.empty(count),
    )
    _, state, reading = sizes_of(compiled(model).tables, "linear", specialise=specialise)
    kernel: Any = made_for(filter_by_gains) if specialise else filter_by_gains
    fixed = [
        sealed(a)
        for a in (
            model.prior.mean, run.predicted.transition, offset, reading_of, H, h, gain, whitener, log_det, z
        )
    ]  # fmt: skip
    spread(lambda a, b: kernel(*fixed, mean, residual, found, a, b, state, reading))
    cov = np.broadcast_to(run.cov, (count, *run.cov.shape))
    return mean, cov, residual, np.broadcast_to(innovation_cov, (count, *innovation_cov.shape)), found


def look(model: Any, name: str) -> tuple[Array, Array]:
    """H (m, d) and h (m,) of a linear sensor: what it sees at the origin, and at unit steps from there."""
    f, m, d = model.sensor_functions[name], model.sensors[name].manifold.dim, model.manifold.dim
    none = np.zeros(max(1, f.inputs))
    h = evaluate(f.value, np.zeros(d), none, 0.0, f.params, m)
    columns = [evaluate(f.value, unit, none, 0.0, f.params, m) - h for unit in np.eye(d)]
    return np.array(columns).T.copy(), h


def patterns_of(present: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Distinct patterns (T, m) of present components, and the one of each reading (N, K)."""
    if present.all():
        return present[:1, 0], np.zeros(present.shape[:2], dtype=np.int64)
    powers = 1 << np.arange(present.shape[2], dtype=np.int64)
    codes, row = np.unique(present @ powers, return_inverse=True)
    return (codes[:, None] & powers) > 0, row.reshape(present.shape[:2]).astype(np.int64)
