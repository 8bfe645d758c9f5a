"""From the last iteration of expectation-maximisation to standard deviations with intervals."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FactorlabError
from sequential.jacobians import unchecked
from sequential.model import SensorModel, StateSpace
from sequential.timeline import Problem
from sequential.tuning.result import Tuning
from sequential.tuning.scaling import noise_numbers, process_parts, with_noise_cov, with_parts_scaled
from sequential.tuning.search import curvature
from sequential.tuning.verdict import judge

__all__ = ["Fit", "as_tuning"]

Array = NDArray[np.float64]
LN10 = math.log(10.0)
MOST = 24  # standard deviations whose intervals are worked out: 1200 filter passes
OWN = 0.5  # share of what is known about a value, prior of one decade included, that the readings must tell


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Where the iterations began and ended."""

    declared: StateSpace
    fitted: StateSpace
    history: tuple[float, ...]
    message: str
    notes: tuple[str, ...]
    form: str


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """One standard deviation of a model: how to read it, and how to multiply it."""

    name: str
    unit: str
    before: float
    after: float
    turn: Callable[[StateSpace, float], StateSpace]


def as_tuning(fit: Fit, problem: Problem, recursive: Any, *, intervals: bool, began: float) -> Tuning:
    """Standard deviations before and after, their intervals, and the verdicts."""
    levels = [*_of_process(fit), *_of_sensors(fit)]
    changed = [level for level in levels if level.after > 0.0]
    first = recursive.solve(replace(problem, model=fit.declared))
    last = recursive.solve(problem)
    passes = len(fit.history) + 2
    decades: dict[str, float] = {level.name: math.nan for level in levels}
    unidentified: tuple[str, ...] = ()
    notes = fit.notes
    if intervals and len(changed) > MOST:
        notes = (*notes, f"intervals of {len(changed)} standard deviations would take too long: left out")
    elif intervals and changed:
        found, unidentified, used = _decades(changed, problem, recursive)
        decades |= found
        passes += used
    declared = {level.name: level.before for level in levels}
    return Tuning(
        values={level.name: level.after for level in levels},
        initial=declared,
        log_likelihood_before=first.log_likelihood,
        log_likelihood_after=last.log_likelihood,
        evaluations=passes,
        seconds=time.perf_counter() - began,
        message=fit.message,
        decades=decades,
        converged=not fit.message,
        method="em",
        units={level.name: level.unit for level in levels},
        matrices=_matrices(fit),
        unidentified=unidentified,
        notes=(*notes, f"{len(fit.history) - 1} iterations"),
        before=judge(first.innovations, fit.declared.sensors),
        after=judge(last.innovations, fit.fitted.sensors),
        model=fit.fitted,
    )


def _decades(
    levels: list[_Level], problem: Problem, recursive: Any
) -> tuple[dict[str, float], tuple[str, ...], int]:
    """Standard deviations of log10(σ), correlations held, with a weak prior that keeps a flat one finite."""
    used = 0

    def log_likelihood(u: Array) -> float:
        nonlocal used
        used += 1
        model = problem.model
        with unchecked():
            for level, move in zip(levels, u, strict=True):
                model = level.turn(model, 10.0 ** float(move)) if move else model
        try:
            value = float(recursive.solve(replace(problem, model=model)).log_likelihood)
        except FactorlabError:
            return -math.inf
        return value - 0.5 * float(u @ u)

    shape = curvature(log_likelihood, np.zeros(len(levels)))
    sigmas = shape.sigmas()
    flat = sigmas**2 if shape.is_summit() else 1.0 / np.maximum(-np.diag(shape.hessian), 1e-300)
    doubtful = tuple(level.name for level, v in zip(levels, flat, strict=True) if not v < 1.0 - OWN)
    return {one.name: float(s) for one, s in zip(levels, sigmas, strict=True)}, doubtful, used


def _of_sensors(fit: Fit) -> list[_Level]:
    found = []
    for name, sensor in fit.fitted.sensors.items():
        before, after = (np.sqrt(np.diag(m.sensors[name].noise_cov)) for m in (fit.declared, fit.fitted))
        m = len(after)
        labels = [""] if m == 1 else [f" {label}" for label in _labels(sensor)]
        found += [
            _Level(f"{name}{labels[k]} σ", "", float(before[k]), float(after[k]), _turn_sensor(name, k))
            for k in range(m)
        ]
    return found


def _labels(sensor: SensorModel) -> tuple[str, ...]:
    return tuple(sensor.manifold.labels())


def _turn_sensor(name: str, axis: int) -> Callable[[StateSpace, float], StateSpace]:
    def turn(model: StateSpace, factor: float) -> StateSpace:
        cov = np.array(model.sensors[name].noise_cov)
        cov[axis] *= factor
        cov[:, axis] *= factor
        return replace(model, sensors={**model.sensors, name: with_noise_cov(model.sensors[name], cov)})

    return turn


def _of_process(fit: Fit) -> list[_Level]:
    field = process_field(fit)
    if fit.form == "held":
        return []
    if not field:
        old, new = (process_parts(m.process) for m in (fit.declared, fit.fitted))
        return [
            _Level(f"{name} σ", "×", 1.0, scale_between(one, new[name]), _turn_part(name))
            for name, one in old.items()
            if name in new
        ]
    dim, unit = fit.fitted.manifold.dim, "/√s" if fit.form == "density" else ""
    before, after = (_diagonal(m.process, field, dim) for m in (fit.declared, fit.fitted))
    labels = fit.fitted.manifold.labels()
    return [
        _Level(
            f"process {labels[k]} σ", unit, float(before[k]), float(after[k]), _turn_process(field, k, dim)
        )
        for k in range(dim)
        if before[k] > 0.0 or after[k] > 0.0
    ]


def _turn_part(name: str) -> Callable[[StateSpace, float], StateSpace]:
    def turn(model: StateSpace, factor: float) -> StateSpace:
        return replace(model, process=with_parts_scaled(model.process, {name: factor}))

    return turn


def process_field(fit: Fit) -> str:
    """The field that holds the process noise as a matrix; empty where it is scaled as a whole."""
    if fit.form not in {"density", "Q"}:
        return ""
    own = fit.fitted.process
    return next(name for name in ("density", "noise_density", "Q") if getattr(own, name, None) is not None)


def _diagonal(process: Any, field: str, dim: int) -> Array:
    given = np.asarray(getattr(process, field), dtype=np.float64)
    variances = np.diag(given) if given.ndim == 2 else np.broadcast_to(given, (dim,))
    return np.asarray(np.sqrt(variances))


def _turn_process(field: str, axis: int, dim: int) -> Callable[[StateSpace, float], StateSpace]:
    def turn(model: StateSpace, factor: float) -> StateSpace:
        given = np.array(getattr(model.process, field), dtype=np.float64)
        cov = given if given.ndim == 2 else np.diag(np.broadcast_to(given, (dim,)))
        cov = cov.copy()
        cov[axis] *= factor
        cov[:, axis] *= factor
        return replace(model, process=replace(model.process, **{field: cov}))  # type: ignore[type-var]

    return turn


def scale_between(before: Any, after: Any) -> float:
    """By which factor on σ a process was scaled, read off one of its numbers."""
    old, new = noise_numbers(before), noise_numbers(after)
    k = int(np.argmax(np.abs(old)))
    return float(new[k] / old[k]) if len(old) and old[k] else math.nan


def _matrices(fit: Fit) -> dict[str, Array]:
    found = {
        f"noise_cov of {name}": np.asarray(sensor.noise_cov) for name, sensor in fit.fitted.sensors.items()
    }
    field = process_field(fit)
    if field:
        given = np.asarray(getattr(fit.fitted.process, field), dtype=np.float64)
        dim = fit.fitted.manifold.dim
        found[f"process {field}"] = given if given.ndim == 2 else np.diag(np.broadcast_to(given, (dim,)))
    return found
