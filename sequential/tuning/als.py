"""Autocovariance least squares: what wrong noises leave in the innovations is linear in the right ones."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError
from sequential.filters import KalmanFilter
from sequential.filters.kalman import require_linear
from sequential.history import Run
from sequential.jacobians import unchecked
from sequential.log import SensorLog
from sequential.model import StateSpace
from sequential.smoothers.leave_one_out import look_back
from sequential.steady_state import SteadyState, steady_state
from sequential.timeline import Problem, prepare
from sequential.tuning.em import require_plain
from sequential.tuning.result import Z95, Tuning
from sequential.tuning.scaling import process_parts, with_noise_cov, with_parts_scaled
from sequential.tuning.verdict import judge

__all__ = ["autocovariance_least_squares"]

Array = NDArray[np.float64]
LN10 = math.log(10.0)
FLOOR = 1e-4  # of its variance before: a noise that comes out as zero is given this for the next round
REGULAR = 1e-3  # of an interval: how far intervals may differ
ENOUGH = 50  # steps after the filter has settled


@dataclass(frozen=True, slots=True, eq=False)
class _Noise:
    """One variance: its share of Q and R in the model that filtered, and how to multiply its σ."""

    name: str
    unit: str
    sigma: float  # declared
    process: Array  # (d, d)
    reading: Array  # (m, m)
    turn: Callable[[StateSpace, float], StateSpace]


def autocovariance_least_squares(
    model: StateSpace,
    log: SensorLog,
    *,
    lags: int | None = None,
    rounds: int = 4,
    max_gap: float | None = None,
) -> Tuning:
    """Estimate process and sensor noise of a linear, time-invariant model from a few filter passes.

    Takes one factor for the process (one for each part of an `Independent`) and one for each axis of a
    sensor whose noise is declared diagonal, else one for the sensor.

    Parameters
    ----------
    lags : of the autocovariance; by default three times what the filter takes to settle, between 5 and 60
    rounds : times the fit is repeated with the gain of the noise just found, which whitens the innovations
        and so makes weights and intervals those of least variance
    max_gap : longest pause of the input stream that is bridged, s

    Raises
    ------
    NonlinearModelError, ModelError
        where the model is not linear, changes with time, or has no steady state; or a sensor has a gate or a
        loss.
    DataError
        where intervals vary, a sensor is silent at some node, or there are too few readings.

    Notes
    -----
    Odelson, Rajamani, Rawlings 2006, A new autocovariance least-squares method for estimating noise
    covariances (after Mehra 1970): with a settled gain, E[e_{k+j} e_kᵀ] is linear in Q and R.  Least squares
    with variances of zero or more, weighted by the variances of autocovariances of white innovations.
    """
    began = time.perf_counter()
    require_plain(model)
    require_linear(model)
    problem = prepare(model, log, None, max_gap)
    dt = _interval(problem)
    first = KalmanFilter(keep=True).solve(problem)
    run, current = first, model
    noises: list[_Noise] = []
    theta, spread, before = np.zeros(0), np.zeros(0), np.zeros(0)
    for _ in range(rounds):
        settled = steady_state(current, dt)
        seen = _settled_innovations(replace(problem, model=current), run, settled)
        count = _lags(settled, lags, len(seen))
        noises = _noises(model, current, settled)
        sigmas = before * np.sqrt(np.maximum(theta, FLOOR))
        before = sigmas if len(theta) else np.array([noise.sigma for noise in noises])
        theta, spread = _fitted(seen, settled, noises, count)
        with unchecked():
            for noise, factor in zip(noises, theta, strict=True):
                current = noise.turn(current, max(factor, FLOOR) ** 0.5)
        run = KalmanFilter(keep=True).solve(replace(problem, model=current))
    names = [noise.name for noise in noises]
    ends = map(_limits, theta.tolist(), spread.tolist(), before.tolist())
    limits = {name: end for name, end in zip(names, ends, strict=True) if end is not None}
    decades = spread / (2.0 * LN10 * np.maximum(theta, FLOOR))
    sigmas = before * np.sqrt(np.maximum(theta, FLOOR))
    return Tuning(
        values=dict(zip(names, sigmas.tolist(), strict=True)),
        initial={noise.name: noise.sigma for noise in noises},
        log_likelihood_before=first.log_likelihood,
        log_likelihood_after=run.log_likelihood,
        evaluations=rounds + 1,
        seconds=time.perf_counter() - began,
        decades={n: float(d) for n, d in zip(names, decades, strict=True) if n not in limits},
        method="als",
        units={noise.name: noise.unit for noise in noises},
        limits=limits,
        unidentified=tuple(limits),
        before=judge(first.innovations, model.sensors),
        after=judge(run.innovations, current.sensors),
        model=current,
    )


def _interval(problem: Problem) -> float:
    """The interval between nodes; raises `DataError` where it varies or a sensor skips a node."""
    steps = np.diff(problem.t) * 1e-9
    if len(steps) < ENOUGH:
        raise DataError(f"autocovariances need {ENOUGH} steps at least, the log has {len(steps)}")
    usual = float(np.median(steps))
    if np.abs(steps - usual).max() > REGULAR * usual:
        raise DataError(
            "autocovariance least squares needs one interval throughout; here they vary from "
            f"{steps.min():.6g} to {steps.max():.6g} s: use tune() or expectation_maximization()"
        )
    plan, sensors = problem.schedule, len(problem.model.sensors)
    widths = np.array([s.manifold.dim for s in problem.model.sensors.values()])
    each = np.diff(plan.reading_ptr)[1:]
    if (each != sensors).any() or (plan.rows != widths[plan.sensor]).any():
        raise DataError(
            "autocovariance least squares needs every sensor, whole, at every step: use tune() or "
            "expectation_maximization(), which take readings as they come"
        )
    return usual


def _settled_innovations(problem: Problem, run: Run, settled: SteadyState) -> Array:
    """(T, m) joint innovations of all sensors, from where the gain no longer changes."""
    ahead = run.predicted
    assert ahead is not None  # noqa: S101 - keep=True
    residual, _, node_of = look_back(problem, ahead.mean)
    columns = []
    for index, sensor in enumerate(problem.model.sensors.values()):
        rows = np.flatnonzero((problem.schedule.sensor == index) & (node_of > 0))
        columns.append(residual[rows, : sensor.manifold.dim])
    whole = np.hstack(columns)
    burnt = min(max(10, round(6.0 * settled.settles)), len(whole) // 2)
    return whole[burnt:]


def _lags(settled: SteadyState, asked: int | None, steps: int) -> int:
    count = asked
    if count is None:
        count = min(int(np.clip(round(3.0 * settled.settles), 5, 60)), steps // 4)
    if not 1 <= count <= steps // 4:
        raise DataError(f"{count} lags need four times as many steps, and there are {steps}")
    return count


def _noises(declared: StateSpace, model: StateSpace, settled: SteadyState) -> list[_Noise]:
    """Every variance that is estimated, with its share of Q and R as `model` has them."""
    m, found = len(settled.matrix), []
    manifold = model.manifold
    for name in process_parts(declared.process):
        rows = np.arange(manifold.dim)
        part = name.partition(" ")[2]
        if part:
            rows = rows[manifold.tangent(part)]  # type: ignore[attr-defined]  # an Independent has parts
        share = np.zeros_like(settled.process_cov)
        share[np.ix_(rows, rows)] = settled.process_cov[np.ix_(rows, rows)]
        found.append(_Noise(f"{name} σ", "×", 1.0, share, np.zeros((m, m)), _turn_part(name)))
    at = 0
    for name, sensor in model.sensors.items():
        cov, labels = np.asarray(sensor.noise_cov), sensor.manifold.labels()
        before = np.asarray(declared.sensors[name].noise_cov)
        apart = bool((cov == np.diag(np.diag(cov))).all())
        groups = [[k] for k in range(len(cov))] if apart else [list(range(len(cov)))]
        for group in groups:
            share = np.zeros((m, m))
            own = np.array(group) + at
            share[np.ix_(own, own)] = cov[np.ix_(group, group)]
            whole = len(group) > 1
            label = "" if whole or len(cov) == 1 else f" {labels[group[0]]}"
            sigma = 1.0 if whole else float(before[group[0], group[0]]) ** 0.5
            none = np.zeros_like(settled.process_cov)
            unit, turn = "×" if whole else "", _turn_sensor(name, group)
            found.append(_Noise(f"{name}{label} σ", unit, sigma, none, share, turn))
        at += len(cov)
    return found


def _turn_part(name: str) -> Callable[[StateSpace, float], StateSpace]:
    return lambda model, by: replace(model, process=with_parts_scaled(model.process, {name: by}))


def _turn_sensor(name: str, group: list[int]) -> Callable[[StateSpace, float], StateSpace]:
    def turn(model: StateSpace, factor: float) -> StateSpace:
        sensor = model.sensors[name]
        cov = np.array(sensor.noise_cov)
        cov[np.ix_(group, group)] *= factor**2
        return replace(model, sensors={**model.sensors, name: with_noise_cov(sensor, cov)})

    return turn


def _fitted(seen: Array, settled: SteadyState, noises: list[_Noise], lags: int) -> tuple[Array, Array]:
    """Factors (k,) on the variances, zero or more, and their standard deviations."""
    from scipy.optimize import nnls

    steps, m = seen.shape
    found = [seen[j:].T @ seen[: steps - j] / (steps - j) for j in range(lags)]
    if not (np.diag(found[0]) > 0.0).all():
        raise DataError("a sensor reads exactly what the filter predicts: there is no noise to be estimated")
    spread = np.sqrt(np.outer(np.diag(found[0]), np.diag(found[0])))
    keep = [np.triu_indices(m) if j == 0 else np.indices((m, m)).reshape(2, -1) for j in range(lags)]
    error = [np.sqrt((spread**2 + (found[0] ** 2 if j == 0 else 0.0)) / steps) for j in range(lags)]
    weight = 1.0 / np.concatenate([e[tuple(at)] for e, at in zip(error, keep, strict=True)])
    right = np.concatenate([c[tuple(at)] for c, at in zip(found, keep, strict=True)])
    columns = [
        np.concatenate([c[tuple(at)] for c, at in zip(_expected(noise, settled, lags), keep, strict=True)])
        for noise in noises
    ]
    left = np.stack(columns, axis=1) * weight[:, None]
    theta, _ = nnls(left, right * weight)
    information = left.T @ left
    if np.linalg.matrix_rank(information) < len(noises):
        names = ", ".join(noise.name for noise in noises)
        raise ModelError(f"the autocovariances do not tell {names} apart: hold one of them, or see more")
    return np.asarray(theta), np.sqrt(np.diag(np.linalg.inv(information)))


def _expected(noise: _Noise, settled: SteadyState, lags: int) -> list[Array]:
    """E[e_{k+j} e_kᵀ] that one noise makes, j = 0 … lags-1, through a filter with the settled gain."""
    from scipy.linalg import solve_discrete_lyapunov

    C, AL = settled.matrix, settled.predictor_gain()
    closed = settled.transition - AL @ C
    P = solve_discrete_lyapunov(closed, noise.process + AL @ noise.reading @ AL.T)
    carried = closed @ P @ C.T - AL @ noise.reading
    found = [C @ P @ C.T + noise.reading]
    for _ in range(1, lags):
        found.append(C @ carried)
        carried = closed @ carried
    return found


def _limits(theta: float, spread: float, before: float) -> tuple[float, float] | None:
    """Limits of σ where zero is among them; `before` is the σ that √θ multiplies."""
    if theta - Z95 * spread > 0.0:
        return None
    return 0.0, before * (theta + Z95 * spread) ** 0.5
