"""Knobs for a model that names none: one factor on the σ of each sensor, and one on the process."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.model import ProcessModel, StateSpace
from sequential.models import Independent
from sequential.noise import ImuNoise
from sequential.tuning.knobs import Knob

__all__ = [
    "noise_fields",
    "noise_knobs",
    "noise_numbers",
    "process_parts",
    "scaled",
    "scaled_process",
    "with_noise_cov",
    "with_parts_scaled",
]

Array = NDArray[np.float64]
PROCESS = "process"
# Fields of the processes in sequential.models by what they hold: variances, or standard deviations.
DENSITIES = ("density", "noise_density", "acceleration_density", "jerk_density", "spectral_density")
VARIANCES = (*DENSITIES, "Q", "cov")
SIGMAS = ("along", "across", "heading", "slip", "turn_slip", "drift", "acceleration_sigma", "sigma")


def noise_knobs(model: StateSpace) -> tuple[Knob, ...]:
    """A factor on the σ of each sensor, and on that of the process or of each independent part of it."""
    names = list(process_parts(model.process))
    names += [name for name, sensor in model.sensors.items() if is_dataclass(sensor)]
    return tuple(Knob(f"{name} σ", 1.0, "×") for name in names)


def scaled(model: StateSpace, values: Mapping[str, float]) -> StateSpace:
    """The same model with its noise multiplied by the values of `noise_knobs`."""
    sensors = {}
    for name, sensor in model.sensors.items():
        factor = values.get(f"{name} σ", 1.0)
        sensors[name] = with_noise_cov(sensor, np.asarray(sensor.noise_cov) * factor**2)
    factors = {name: values.get(f"{name} σ", 1.0) for name in process_parts(model.process)}
    return replace(model, process=with_parts_scaled(model.process, factors), sensors=sensors)


def process_parts(process: ProcessModel) -> dict[str, ProcessModel]:
    """What can be scaled by itself: parts of an `Independent`, else the process; empty where nothing can."""
    if isinstance(process, Independent):
        parts = {f"{PROCESS} {name}": one for name, one in process.processes.items()}
    else:
        parts = {PROCESS: process}
    return {name: one for name, one in parts.items() if noise_numbers(one).any() and _scaled(one, 1.0)}


def with_parts_scaled(process: ProcessModel, factors: Mapping[str, float]) -> ProcessModel:
    """The process, each part of it with its standard deviations multiplied; parts not named stay."""
    if not isinstance(process, Independent):
        return scaled_process(process, factors.get(PROCESS, 1.0)) or process
    members = {
        name: scaled_process(one, factors.get(f"{PROCESS} {name}", 1.0)) or one
        for name, one in process.processes.items()
    }
    return Independent(**members)


def with_noise_cov(sensor: Any, noise_cov: Any) -> Any:
    """The same sensor with another noise."""
    return replace(sensor, noise_cov=noise_cov) if hasattr(sensor, "__dataclass_fields__") else sensor


def scaled_process(process: ProcessModel, factor: float) -> ProcessModel | None:
    """The process with its standard deviations multiplied, or None where nobody knows how."""
    found: ProcessModel | None = _scaled(process, factor)
    return found


@singledispatch
def _scaled(process: Any, factor: float) -> ProcessModel | None:
    if not is_dataclass(process) or not type(process).__module__.startswith("sequential.models"):
        return None
    change: dict[str, Any] = {}
    for name, value, power in noise_fields(process):
        if isinstance(value, ImuNoise):
            change[name] = replace(value, **{f.name: getattr(value, f.name) * factor for f in fields(value)})
        else:
            change[name] = (np.asarray(value) if np.ndim(value) else float(value)) * factor**power
    made: Any = replace(process, **change)  # type: ignore[type-var]
    return made if change else None


@_scaled.register
def _(process: Independent, factor: float) -> ProcessModel | None:
    members = {name: scaled_process(one, factor) for name, one in process.processes.items()}
    known = {name: one for name, one in members.items() if one is not None}
    return Independent(**known) if len(known) == len(members) else None


def noise_fields(process: Any) -> Iterator[tuple[str, Any, int]]:
    """Fields of a built-in process that hold its noise, and the power of σ that each is."""
    for name in (one.name for one in fields(process)):
        value = getattr(process, name)
        if value is None or callable(value):
            continue
        if name in VARIANCES:
            yield name, value, 2
        elif name in SIGMAS or isinstance(value, ImuNoise):
            yield name, value, 1


def noise_numbers(process: Any) -> Array:
    """(k,) standard deviations that `scaled_process` multiplies, in the order of the fields."""
    if isinstance(process, Independent):
        return np.concatenate([noise_numbers(one) for one in process.processes.values()])
    found = [np.zeros(0)]
    for _, value, power in noise_fields(process) if is_dataclass(process) else ():
        own = [getattr(value, f.name) for f in fields(value)] if isinstance(value, ImuNoise) else value
        found.append(np.maximum(np.ravel(np.asarray(own, dtype=np.float64)), 0.0) ** (1.0 / power))
    return np.concatenate(found)
