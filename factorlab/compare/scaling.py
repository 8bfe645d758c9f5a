"""Knobs for a model that names none: one factor on the σ of each sensor, and one on the process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from sequential.model import ProcessModel, StateSpace
from sequential.models import ConstantVelocity, Process, RandomWalk, Strapdown, Unicycle
from sequential.tuning import Knob

__all__ = ["noise_knobs", "scaled"]

PROCESS = "process"


def noise_knobs(model: StateSpace) -> tuple[Knob, ...]:
    """A factor on the standard deviation of each sensor, and of the process where it can be scaled."""
    names = [PROCESS] if _scaled_process(model.process, 1.0) is not None else []
    names += [name for name, sensor in model.sensors.items() if hasattr(sensor, "__dataclass_fields__")]
    return tuple(Knob(f"{name} σ", 1.0, "×") for name in names)


def scaled(model: StateSpace, values: Mapping[str, float]) -> StateSpace:
    """The same model with its noise multiplied by the values of `noise_knobs`."""
    sensors = {}
    for name, sensor in model.sensors.items():
        factor = values.get(f"{name} σ", 1.0)
        sensors[name] = replace(sensor, noise_cov=np.asarray(sensor.noise_cov) * factor**2)  # type: ignore[type-var]
    process = _scaled_process(model.process, values.get(f"{PROCESS} σ", 1.0)) or model.process
    return replace(model, process=process, sensors=sensors)


def _scaled_process(process: ProcessModel, factor: float) -> ProcessModel | None:
    """The process with its standard deviations multiplied, or None where nobody knows how."""
    change: dict[str, Any]
    if isinstance(process, Process) and process.noise_density is not None:
        change = {"noise_density": np.asarray(process.noise_density) * factor**2}
    elif isinstance(process, RandomWalk):
        change = {"density": np.asarray(process.density) * factor**2}
    elif isinstance(process, ConstantVelocity):
        change = {"acceleration_density": process.acceleration_density * factor**2}
    elif isinstance(process, Unicycle):
        sigmas = ("along", "across", "heading", "slip", "turn_slip", "drift")
        change = {name: getattr(process, name) * factor for name in sigmas}
    elif isinstance(process, Strapdown):
        noise = process.noise
        change = {"noise": replace(noise, **{f.name: getattr(noise, f.name) * factor for f in fields(noise)})}
    else:
        return None
    return replace(process, **change)
