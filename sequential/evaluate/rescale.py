"""The same problem with one of its noises multiplied: what a search for the guilty noise turns."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np
from numpy.typing import NDArray

from sequential.history import Innovations, Run
from sequential.model import Gaussian, Loss, ProcessModel, SensorModel, StateSpace
from sequential.models import Strapdown, Unicycle
from sequential.timeline import Problem, sealed

__all__ = ["Scaling", "accepted_only", "log_likelihood", "process_parts", "scalings"]


@dataclass(frozen=True, slots=True)
class Scaling:
    """One way to multiply standard deviations by a factor.

    `apply(model, factor)` returns a model and a unit: its innovations, and their standard deviations, are
    to be read in that unit, so residuals stay as they are and covariances are multiplied by unit².
    `family` is `process`, or the sensor whose noise it is.
    """

    name: str
    family: str
    apply: Callable[[StateSpace, float], tuple[StateSpace, float]]


def scalings(model: StateSpace) -> list[Scaling]:
    """Every scaling that makes sense for a model: its process, parts of it where known, each sensor."""
    parts = process_parts(model.process)
    found = [Scaling(name, "process", _with_process(make)) for name, make in parts.items()]
    if not parts:
        found.append(Scaling("process noise", "process", _against_everything_else))
    found += [Scaling(f"noise of {name}", name, _with_sensor(name)) for name in model.sensors]
    return found


@singledispatch
def process_parts(process: ProcessModel) -> dict[str, Callable[[float], ProcessModel]]:
    """Noises of a process that can be scaled one by one, by name; empty for a process not known better."""
    return {}


@process_parts.register
def _(process: Strapdown) -> dict[str, Callable[[float], ProcessModel]]:
    noise = process.noise
    return {
        "gyro density": lambda f: replace(process, noise=replace(noise, gyro_density=noise.gyro_density * f)),
        "accelerometer density": lambda f: replace(
            process, noise=replace(noise, accel_density=noise.accel_density * f)
        ),
        "gyro and accelerometer densities": lambda f: replace(process, noise=noise.scaled(f)),
    }


@process_parts.register
def _(process: Unicycle) -> dict[str, Callable[[float], ProcessModel]]:
    def scaled(*names: str) -> Callable[[float], ProcessModel]:
        return lambda f: replace(process, **{name: getattr(process, name) * f for name in names})

    track, heading = ("along", "across", "slip"), ("heading", "turn_slip", "drift")
    return {
        "heading noise": scaled(*heading),
        "track noise": scaled(*track),
        "process noise": scaled(*heading, *track),
    }


def _with_process(
    make: Callable[[float], ProcessModel],
) -> Callable[[StateSpace, float], tuple[StateSpace, float]]:
    return lambda model, factor: (replace(model, process=make(factor), check=False), 1.0)


def _with_sensor(name: str) -> Callable[[StateSpace, float], tuple[StateSpace, float]]:
    def apply(model: StateSpace, factor: float) -> tuple[StateSpace, float]:
        sensors = {**model.sensors, name: _scaled(model.sensors[name], factor)}
        return replace(model, sensors=sensors, check=False), 1.0

    return apply


def _against_everything_else(model: StateSpace, factor: float) -> tuple[StateSpace, float]:
    """Process noise times factor²: the same gains as prior and sensors divided by it, in another unit.

    Exact for every estimator whose means depend on ratios of covariances only (KF, EKF, iterated EKF,
    smoothers), for any process, also one whose noise is a function.
    """
    sensors = {name: _scaled(sensor, 1.0 / factor, factor) for name, sensor in model.sensors.items()}
    prior = Gaussian(model.prior.mean, model.prior.cov / factor**2)
    return replace(model, sensors=sensors, prior=prior, check=False), factor


def _scaled(sensor: SensorModel, factor: float, unit: float = 1.0) -> SensorModel:
    """A sensor with its deviations multiplied; the constant of its loss is read in another unit."""
    own = copy.copy(sensor)
    object.__setattr__(own, "noise_cov", sealed(np.asarray(sensor.noise_cov) * factor**2))
    object.__setattr__(own, "gate", None)
    if sensor.loss is not None:
        object.__setattr__(own, "loss", Loss(sensor.loss.kind, sensor.loss.k * unit))
    return own


def accepted_only(problem: Problem, run: Run) -> Problem:
    """The problem without the readings that gates rejected, and without gates.

    Likelihoods of two models can be compared only on the same readings, and gates choose by the model.
    """
    plan = problem.schedule
    kept = np.ones(len(problem.reading_t), dtype=bool)
    for index, name in enumerate(problem.model.sensors):
        kept[plan.sensor == index] = run.innovations[name].accepted
    sensors = {name: _scaled(sensor, 1.0) for name, sensor in problem.model.sensors.items()}
    model = replace(problem.model, sensors=sensors, check=False)
    return replace(problem.only(kept), model=model)


def log_likelihood(innovations: Innovations, unit: float = 1.0) -> float:
    """Gaussian log density of the residuals when their covariances are multiplied by unit²."""
    count = int(innovations.dof().sum())
    if not count:
        return 0.0
    spread: NDArray[np.float64] = np.linalg.slogdet(innovations.cov)[1]
    constant = count * np.log(2.0 * np.pi * unit**2)
    return float(-0.5 * (np.sum(innovations.nis() / unit**2 + spread) + constant))
