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

__all__ = ["noise_fields", "noise_knobs", "noise_numbers", "scaled", "scaled_process", "with_noise_cov"]

Array = NDArray[np.float64]
PROCESS = "process"
# Fields of the processes in sequential.models by what they hold: variances, or standard deviations.
DENSITIES = ("density", "noise_density", "acceleration_density", "jerk_density", "spectral_density")
VARIANCES = (*DENSITIES, "Q", "cov")
SIGMAS = ("along", "across", "heading", "slip", "turn_slip", "drift", "acceleration_sigma", "sigma")


def noise_knobs(model: StateSpace) -> tuple[Knob, ...]:
    """A factor on the standard deviation of each sensor, and of the process where it can be scaled."""
    names = [PROCESS] if scaled_process(model.process, 1.0) is not None else []
    names += [name for name, sensor in model.sensors.items() if is_dataclass(sensor)]
    return tuple(Knob(f"{name} σ", 1.0, "×") for name in names)


def scaled(model: StateSpace, values: Mapping[str, float]) -> StateSpace:
    """The same model with its noise multiplied by the values of `noise_knobs`."""
    sensors = {}
    for name, sensor in model.sensors.items():
        factor = values.get(f"{name} σ", 1.0)
        sensors[name] = with_noise_cov(sensor, np.asarray(sensor.noise_cov) * factor**2)
    process = scaled_process(model.process, values.get(f"{PROCESS} σ", 1.0)) or model.process
    return replace(model, process=process, sensors=sensors)


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
    for _, value, power in noise_fields(process):
        own = [getattr(value, f.name) for f in fields(value)] if isinstance(value, ImuNoise) else value
        found.append(np.maximum(np.ravel(np.asarray(own, dtype=np.float64)), 0.0) ** (1.0 / power))
    return np.concatenate(found)
