"""The readings of a log, sensor after sensor, with the noise of each.

NaN in a sensor's stream says that a component is missing.  A reading without any component is dropped; one
that has some keeps its place, and its noise decouples what is missing, with a unit variance that cancels
from gain, innovation and likelihood.  So every estimator takes partial readings without a branch for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, MissingStreamError, NotFiniteError, ShapeError
from sequential.log import SensorLog, Stream
from sequential.model import SensorModel, StateSpace

__all__ = ["ReadingNoise", "Readings", "gather", "noise_of", "require_columns"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class ReadingNoise:
    """Which noise each reading has: a table of distinct ones, made anew for every model of a family.

    A row of the table belongs to a sensor, to a pattern of present components, and, where the stream brings
    covariances of its own, to one of those.
    """

    sensor: Ints  # (T,)
    present: NDArray[np.bool_]  # (T, w) components that are there; w is the widest measurement
    given: Array | None  # (T, w, w) covariances that the streams brought, NaN where the sensor's holds
    row: Ints  # (M,) row of the table for each reading
    rows: Ints  # (M,) how many components each reading has

    def table(self, model: StateSpace) -> Array:
        """(T, w, w) covariances; a missing component has a unit variance of its own."""
        width = self.present.shape[1]
        sensors = list(model.sensors.values())
        own = np.zeros((len(sensors), width, width))
        dims = np.array([s.manifold.dim for s in sensors], dtype=np.int64)
        for k, sensor in enumerate(sensors):
            own[k, : dims[k], : dims[k]] = sensor.noise_cov
        cov: Array = own[self.sensor]
        if self.given is not None:
            cov = np.where(np.isnan(self.given), cov, self.given)
        if self.present.all():
            return cov
        cov = cov * (self.present[:, :, None] & self.present[:, None, :])
        each = np.arange(width)
        cov[:, each, each] += ~self.present & (each < dims[self.sensor][:, None])
        return cov


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """All readings at or after the start, sensor after sensor; z is NaN where a component is missing."""

    t: Ints  # (M,) ns
    row: Ints  # (M,) row in its stream
    sensor: Ints  # (M,)
    z: Array  # (M, widest storage)
    context: Array  # (M, widest context)
    given: Array | None  # (M, w, w) covariances that the streams brought, NaN where the sensor's holds
    stamps: Ints  # of all readings, also of those without any component
    dropped: int  # readings without any component


def gather(model: StateSpace, log: SensorLog, start: int) -> Readings:
    """Collect the readings that a model takes.

    Raises
    ------
    MissingStreamError, ShapeError, DataError, NotFiniteError
    """
    size = max([s.manifold.size for s in model.sensors.values()] or [1])
    width = max([f.inputs for f in model.sensor_functions.values()] + [1])
    parts = [_of_sensor(model, log, start, index, (size, width)) for index in range(len(model.sensors))] or [
        _nothing(size, width)
    ]
    given = None
    if any(part.given is not None for part in parts):
        wide = max(s.manifold.dim for s in model.sensors.values())
        given = np.concatenate([_padded(part, wide) for part in parts])
    joined = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("t", "row", "sensor", "z", "context")
    }
    stamps = np.concatenate([part.stamps for part in parts])
    return Readings(**joined, given=given, stamps=stamps, dropped=sum(part.dropped for part in parts))


def noise_of(model: StateSpace, readings: Readings) -> ReadingNoise:
    """Sort the readings by sensor, pattern of components and covariance."""
    sensors = list(model.sensors.values())
    dims = np.array([s.manifold.dim for s in sensors] or [0], dtype=np.int64)
    width, each = max(int(dims.max()), 1), np.arange(max(int(dims.max()), 1))
    missing = np.isnan(readings.z[:, :width])
    everything = each < dims[:, None]
    if readings.given is None and not missing.any():
        of = np.arange(len(sensors), dtype=np.int64)
        return ReadingNoise(of, everything[: len(of)], None, readings.sensor, dims[readings.sensor])
    present = everything[readings.sensor] & ~missing
    keys = [readings.sensor, *present.T]
    if readings.given is not None:
        own = ~np.isnan(readings.given[:, 0, 0])
        keys.append(np.where(own, np.arange(len(own)), -1))
    _, first, row = np.unique(np.column_stack(keys), axis=0, return_index=True, return_inverse=True)
    given = None if readings.given is None else readings.given[first]
    row = row.reshape(-1).astype(np.int64)
    return ReadingNoise(readings.sensor[first], present[first], given, row, present.sum(axis=1))


def _nothing(size: int, width: int) -> Readings:
    none = np.zeros(0, dtype=np.int64)
    return Readings(none, none, none, np.zeros((0, size)), np.zeros((0, width)), None, none, 0)


def _of_sensor(
    model: StateSpace, log: SensorLog, start: int, index: int, widths: tuple[int, int]
) -> Readings:
    name, sensor = list(model.sensors.items())[index]
    stream = log[name]
    require_columns(name, stream, sensor.manifold.size, model.sensor_functions[name].inputs)
    after = np.flatnonzero(stream.t >= start)
    if not len(after):
        msg = f"log[{name!r}] has no reading at or after the start; drop the sensor or mend the log"
        raise MissingStreamError(msg)
    kept = after
    missing = np.isnan(stream.values[after])
    if missing.any():
        kept = after[~missing.all(axis=1)]
        _require_scalars(name, sensor, stream, kept)
    z, context = np.zeros((len(kept), widths[0])), np.zeros((len(kept), widths[1]))
    z[:, : stream.values.shape[1]] = stream.values[kept]
    if stream.context is not None:
        _require_landmarks(name, stream.context[:, 0], kept, getattr(sensor, "landmarks", None))
        width = min(stream.context.shape[1], widths[1])
        context[:, :width] = stream.context[kept, :width]
    given = None
    if stream.noise_cov is not None:
        m = sensor.manifold.dim
        if stream.noise_cov.shape[1] != m:
            msg = f"log[{name!r}] brings noise_cov of {stream.noise_cov.shape[1:]}, its sensor has {m} axes"
            raise ShapeError(msg)
        given = stream.noise_cov[kept]
    of = np.full(len(kept), index, dtype=np.int64)
    dropped = len(after) - len(kept)
    return Readings(stream.t[kept], kept, of, z, context, given, stream.t[after], dropped)


def _padded(part: Readings, wide: int) -> Array:
    """(M, wide, wide) covariances of one sensor's readings, NaN throughout where it brings none."""
    if part.given is None:
        return np.full((len(part.t), wide, wide), np.nan)
    padded = np.zeros((len(part.t), wide, wide))
    padded[:, : part.given.shape[1], : part.given.shape[2]] = part.given
    return padded


def require_columns(name: str, stream: Stream, size: int, context: int) -> None:
    """Raise `ShapeError` where a stream has other columns than a model takes."""
    if stream.values.shape[1] != size:
        msg = f"log[{name!r}] has {stream.values.shape[1]} columns, the model takes {size}"
        raise ShapeError(msg)
    given = 0 if stream.context is None else stream.context.shape[1]
    if given < context:
        msg = f"log[{name!r}] needs {context} context columns (such as the landmark seen), it has {given}"
        raise ShapeError(msg)


def _require_scalars(name: str, sensor: SensorModel, stream: Stream, kept: NDArray[Any]) -> None:
    """A component can be missing alone where it is a number or an angle, not half of a rotation."""
    partly = kept[np.isnan(stream.values[kept]).any(axis=1)]
    if len(partly) and sensor.manifold.size != sensor.manifold.dim:
        msg = (
            f"log[{name!r}] holds NaN in a part of sample {partly[0]}, but a reading on {sensor.manifold} is "
            "whole or missing: make the whole row NaN, or mend it"
        )
        raise NotFiniteError(msg)


def _require_landmarks(name: str, index: Array, kept: NDArray[Any], landmarks: Any) -> None:
    """A compiled sensor reads its table at the index in the context, so the index must be a row of it."""
    if landmarks is None:
        return
    seen, count = index[kept], len(landmarks)
    wrong = np.flatnonzero((seen != np.floor(seen)) | (seen < 0) | (seen >= count))
    if len(wrong):
        msg = (
            f"log[{name!r}] sees landmark {seen[wrong[0]]:g} at sample {kept[wrong[0]]}, but its sensor has "
            f"{count} landmarks, 0 to {count - 1}; mend the context or the sensor's table"
        )
        raise DataError(msg)
