"""What a reading or an input must look like to enter a model, and the sentences for what does not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, MissingStreamError, ShapeError
from sequential.model import StateSpace
from sequential.noise import require_covariance

__all__ = ["Port", "ports_of", "require_input", "unknown_sensor"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Port:
    """Where the readings of one sensor enter."""

    name: str
    index: int
    shape: tuple[int]
    dim: int
    context: int
    landmarks: int | None

    def values(self, z: ArrayLike) -> Array:
        """(m,) the numbers of a reading; raises `ShapeError`."""
        given = np.ascontiguousarray(z, dtype=np.float64)
        if given.shape != self.shape:
            raise self.refuse(z)
        return given

    def refuse(self, z: ArrayLike) -> ShapeError:
        """The error for values of another shape."""
        wanted = f"{self.shape[0]} numbers" if self.shape[0] > 1 else "one number"
        return ShapeError(f"a reading of {self.name!r} is {wanted}, got an array of shape {np.shape(z)}")

    def known(self, context: ArrayLike | None) -> Array:
        """(c,) what is known about a reading; raises `ShapeError`, `DataError`."""
        given = np.ascontiguousarray([] if context is None else context, dtype=np.float64)
        if given.ndim != 1 or len(given) < self.context:
            came = "none" if context is None else f"shape {np.shape(context)}"
            msg = (
                f"a reading of {self.name!r} needs {self.context} context numbers (such as the landmark "
                f"seen), got {came}"
            )
            raise ShapeError(msg)
        if self.landmarks is not None and given[0] not in range(self.landmarks):
            msg = (
                f"a reading of {self.name!r} sees landmark {given[0]:g}, but its sensor has {self.landmarks} "
                f"landmarks, 0 to {self.landmarks - 1}; mend the context or the sensor's table"
            )
            raise DataError(msg)
        return given[: self.context]

    def noise(self, noise_cov: ArrayLike) -> Array:
        """(m, m) noise of one reading from a matrix, variances or a number; raises as a sensor would."""
        return require_covariance(noise_cov, self.dim, f"the noise_cov of a reading of {self.name!r}")


def ports_of(model: StateSpace) -> dict[str, Port]:
    """The ports of every sensor of a model, by the sensor's name."""
    found = {}
    for index, (name, sensor) in enumerate(model.sensors.items()):
        landmarks = getattr(sensor, "landmarks", None)
        found[name] = Port(
            name,
            index,
            (sensor.manifold.size,),
            sensor.manifold.dim,
            model.sensor_functions[name].inputs,
            None if landmarks is None else len(landmarks),
        )
    return found


def unknown_sensor(model: StateSpace, name: object) -> MissingStreamError:
    """The error for a reading of a sensor that the model does not have."""
    known = ", ".join(map(repr, model.sensors)) or "no sensors"
    if name == model.input:
        return MissingStreamError(f"{name!r} drives the process; its samples go to predict(belief, dt, u)")
    return MissingStreamError(f"the model has no sensor {name!r}; it has {known}")


def require_input(model: StateSpace, u: ArrayLike | None) -> Array:
    """(inputs,) what drives a step; raises `ShapeError`."""
    size = model.process_functions.inputs
    given = np.ascontiguousarray([] if u is None else u, dtype=np.float64)
    if given.shape == (size,):
        return given
    process = type(model.process).__name__
    if not size:
        msg = f"{process} is not driven by an input; leave u out"
    elif u is None:
        msg = f"{process} is driven by {model.input!r}: give its {size} numbers as u"
    else:
        msg = f"{process} is driven by {size} numbers of {model.input!r}, got an array of shape {np.shape(u)}"
    raise ShapeError(msg)
