"""What to write into the model: the numbers as its declaration spells them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.datasets import Dataset
from sequential.model import StateSpace
from sequential.tuning import Tuning

__all__ = ["lines_at_rest", "lines_of", "spelled"]

DIGITS = 4
COUPLED = 0.1  # a smaller correlation is not worth a matrix


def lines_of(dataset: Dataset, found: Tuning) -> tuple[str, ...]:
    """Values by name where the model has names for them, else the arguments of its parts."""
    factors = all(found.units.get(name) == "×" for name in found.values)
    if found.method in {"em", "als"} or factors:
        return () if found.model is None else tuple(_changed(dataset.model, found.model))
    units = {name: f"  # {unit}" if (unit := found.units.get(name)) else "" for name in found.values}
    turned = {name: value for name, value in found.values.items() if value != found.initial.get(name)}
    return tuple(f"{name} = {number(value)}{units[name]}" for name, value in turned.items())


def lines_at_rest(name: str, found: Tuning) -> tuple[str, ...]:
    """The noise_cov of a sensor."""
    return (f"{name}: noise_cov = {spelled(found.matrices['noise_cov'])}",)


def _changed(before: StateSpace, after: StateSpace) -> Iterator[str]:
    """Arguments that differ between two models."""
    changes = [f"{name}={text}" for name, text in _arguments(before.process, after.process)]
    if changes:
        yield f"process: {type(after.process).__name__}({', '.join(changes)})"
    for name, sensor in after.sensors.items():
        if not np.array_equal(sensor.noise_cov, before.sensors[name].noise_cov):
            yield f"sensors[{name!r}]: noise_cov = {spelled(np.asarray(sensor.noise_cov))}"


def _arguments(before: Any, after: Any) -> Iterator[tuple[str, str]]:
    for one in fields(after) if is_dataclass(after) else ():
        old, new = getattr(before, one.name), getattr(after, one.name)
        if is_dataclass(new) and not isinstance(new, type):
            inner = [f"{name}={text}" for name, text in _arguments(old, new)]
            if inner:
                yield one.name, f"{type(new).__name__}({', '.join(inner)})"
        elif isinstance(new, float | int | np.ndarray) and not np.array_equal(old, new):
            yield one.name, spelled(np.asarray(new, dtype=np.float64))
        elif hasattr(new, "items"):
            for key, member in new.items():
                inner = [f"{name}={text}" for name, text in _arguments(old[key], member)]
                if inner:
                    yield key, f"{type(member).__name__}({', '.join(inner)})"


def spelled(cov: NDArray[np.float64]) -> str:
    """A covariance as it may be declared: a number, variances, or a matrix where axes are coupled."""
    if cov.ndim == 0:
        return number(float(cov))
    if cov.ndim == 1:
        return f"[{', '.join(number(float(v)) for v in cov)}]"
    if cov.ndim > 2:
        return "…"
    variances = np.diag(cov)
    scale = np.sqrt(np.maximum(np.outer(variances, variances), 1e-300))
    if (np.abs(cov - np.diag(variances)) > COUPLED * scale).any():
        return f"[{', '.join(spelled(row) for row in cov)}]"
    if np.allclose(variances, variances[0], rtol=1e-6):
        return number(float(variances[0]))
    return spelled(variances)


def number(value: float) -> str:
    """Four digits, as Python reads them."""
    return f"{value:.{DIGITS}g}"
