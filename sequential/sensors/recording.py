"""One recording of an inertial measurement unit: what every sensor and attitude tool takes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, MissingStreamError, NotFiniteError, ShapeError, TimeOrderError
from sequential.log import SensorLog, Stream, frozen, nanoseconds
from sequential.sensors.finding import Finding

__all__ = ["ImuRecording"]

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
COUNTS = "counts"
SI = {"accel": "m/s^2", "gyro": "rad/s", "mag": "uT"}


@dataclass(frozen=True, slots=True, eq=False)
class ImuRecording:
    """Accelerometer, gyro, magnetometer and temperature on one time axis; arrays are read-only copies.

    Parameters
    ----------
    t : (N,) int64 nanoseconds, or floats in seconds; strictly increasing
    accel : (N, 3) specific force, m/s² (+g on the axis that points up at rest), or None
    gyro : (N, 3) angular rate, rad/s, or None
    mag : (N, 3) µT, or None; a row of NaN says that the magnetometer has no new sample there
    temperature : (N,) °C, NaN where unknown, or None
    name : of the recording
    accel_unit, gyro_unit, mag_unit : `"m/s^2"`, `"rad/s"`, `"uT"`, or `"counts"` where no scale is known,
        as in a recording that is to be calibrated
    findings : what a reader noticed and mended (units guessed, rows dropped)

    Raises
    ------
    ShapeError, NotFiniteError, TimeOrderError, DataError
        each naming array, sample and remedy.
    """

    t: Stamps
    accel: Array | None = None
    gyro: Array | None = None
    mag: Array | None = None
    temperature: Array | None = None
    name: str = "recording"
    accel_unit: str = SI["accel"]
    gyro_unit: str = SI["gyro"]
    mag_unit: str = SI["mag"]
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", _stamps(self.t, self.name))
        if self.accel is None and self.gyro is None and self.mag is None:
            msg = f"recording {self.name!r} holds no sensor; give accel, gyro or mag, each (N, 3)"
            raise MissingStreamError(msg)
        for sensor in ("accel", "gyro", "mag"):
            if (values := getattr(self, sensor)) is not None:
                object.__setattr__(self, sensor, _vectors(values, len(self.t), sensor, self.name))
            if (unit := getattr(self, f"{sensor}_unit")) not in {SI[sensor], COUNTS}:
                msg = (
                    f"{sensor}_unit is {unit!r}; a recording holds {SI[sensor]!r} or {COUNTS!r}: convert "
                    "before, as read_imu(…, units=…) does"
                )
                raise DataError(msg)
        if self.temperature is not None:
            object.__setattr__(self, "temperature", _scalars(self.temperature, len(self.t), self.name))
        object.__setattr__(self, "findings", tuple(self.findings))

    def __len__(self) -> int:
        return len(self.t)

    @property
    def seconds(self) -> Array:
        """(N,) time since the first sample, s."""
        return np.asarray((self.t - self.t[0]) * 1e-9)

    @property
    def dt(self) -> Array:
        """(N-1,) interval from each sample to the next, s."""
        return np.diff(self.t) * 1e-9

    @property
    def rate(self) -> float:
        """Samples a second: the inverse of the median interval, Hz; NaN for a single sample."""
        return float(1.0 / np.median(self.dt)) if len(self.t) > 1 else float("nan")

    @property
    def duration(self) -> float:
        """From the first stamp to the last, s."""
        return float((self.t[-1] - self.t[0]) * 1e-9)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensors that it holds, of accel, gyro and mag."""
        return tuple(name for name in SI if getattr(self, name) is not None)

    def require(self, *sensors: str, si: bool = True) -> ImuRecording:
        """Give the recording itself where it holds these sensors, inertial ones in SI unless told otherwise.

        A magnetometer passes in any unit: a heading needs no scale.

        Raises
        ------
        MissingStreamError, DataError
        """
        for sensor in sensors:
            if getattr(self, sensor) is None:
                msg = (
                    f"recording {self.name!r} has no {sensor}, which is needed here; it holds "
                    f"{', '.join(self.sensors)}"
                )
                raise MissingStreamError(msg)
            if si and sensor != "mag" and (unit := getattr(self, f"{sensor}_unit")) != SI[sensor]:
                msg = (
                    f"{sensor} of recording {self.name!r} is in {unit}, {SI[sensor]} is needed here; "
                    f"calibrate it first, or give the scale with read_imu(…, units={{'{sensor}': …}})"
                )
                raise DataError(msg)
        return self

    def select(self, rows: NDArray[np.bool_] | NDArray[np.int64] | slice) -> ImuRecording:
        """The samples that a mask, increasing indices or a slice name."""
        chosen = {
            name: values[rows]
            for name in ("accel", "gyro", "mag", "temperature")
            if (values := getattr(self, name)) is not None
        }
        return replace(self, t=self.t[rows], **chosen)

    def slice(self, start_s: float = 0.0, stop_s: float = float("inf")) -> ImuRecording:
        """Samples from `start_s` to `stop_s` seconds after the first one, both included; stamps are kept."""
        inside = (self.seconds >= start_s - 0.5e-9) & (self.seconds <= stop_s + 0.5e-9)
        if not inside.any():
            msg = (
                f"recording {self.name!r} has no sample from {start_s:g} s to {stop_s:g} s; it lasts "
                f"{self.duration:.3f} s"
            )
            raise DataError(msg)
        return self.select(inside)

    def to_log(self) -> SensorLog:
        """Streams for `sequential.run`: `imu` (accelerometer, gyro: the input of `Strapdown`), `mag`.

        With one of the two missing, the other is a stream `accel` or `gyro`; `temperature` is one too.
        Units are those of the recording; magnetometer rows without a sample are left out.
        """
        streams: dict[str, Stream] = {}
        if self.accel is not None and self.gyro is not None:
            streams["imu"] = Stream(self.t, np.hstack([self.accel, self.gyro]))
        elif self.accel is not None:
            streams["accel"] = Stream(self.t, self.accel)
        elif self.gyro is not None:
            streams["gyro"] = Stream(self.t, self.gyro)
        for name in ("mag", "temperature"):
            if (values := getattr(self, name)) is not None:
                known = np.isfinite(values if values.ndim == 1 else values[:, 0])
                streams[name] = Stream(self.t[known], values[known])
        return SensorLog(streams, self.name)

    @classmethod
    def from_log(cls, log: SensorLog) -> ImuRecording:
        """Build from a log with `imu` (6 columns), or `accel` or `gyro`, and maybe `mag`, `temperature`.

        Slower streams get the row of the nearest sample; the rows between are NaN.

        Raises
        ------
        MissingStreamError, ShapeError
        """
        main = next((name for name in ("imu", "accel", "gyro", "mag") if name in log), None)
        if main is None:
            msg = (
                f"log {log.name!r} has none of the streams imu, accel, gyro, mag; it has {', '.join(log)}. "
                "'imu' holds accelerometer (3) and gyro (3)"
            )
            raise MissingStreamError(msg)
        width, t = {"imu": 6}.get(main, 3), log[main].t
        arrays: dict[str, Any] = {
            name: _placed(log, name, 3, t) for name in ("accel", "gyro", "mag") if name in log
        }
        if main == "imu":
            both = _placed(log, main, width, t)
            arrays.update(accel=both[:, :3], gyro=both[:, 3:])
        heat = _placed(log, "temperature", 1, t)[:, 0] if "temperature" in log else None
        return cls(t=t, temperature=heat, name=log.name, **arrays)


def _stamps(given: Stamps, name: str) -> Stamps:
    t = np.array(np.atleast_1d(nanoseconds(given)))
    if t.ndim != 1 or not len(t):
        msg = f"recording {name!r} needs stamps of shape (N,) with N >= 1, got {np.shape(given)}"
        raise ShapeError(msg)
    if len(wrong := np.flatnonzero(np.diff(t) <= 0)):
        k = int(wrong[0]) + 1
        verb = "repeats" if t[k] == t[k - 1] else "goes backwards"
        msg = (
            f"recording {name!r} {verb} at sample {k}: {t[k - 1] * 1e-9:.6f} s then {t[k] * 1e-9:.6f} s "
            f"({len(wrong)} such steps); sort it and drop repeats, as read_imu does"
        )
        raise TimeOrderError(msg)
    t.flags.writeable = False
    return t


def _vectors(given: Array, count: int, sensor: str, name: str) -> Array:
    """(N, 3), finite; for a magnetometer whole rows may be NaN."""
    values = frozen(given)
    if values.shape != (count, 3):
        msg = f"{sensor} of recording {name!r} must be ({count}, 3), one row a stamp; got {values.shape}"
        raise ShapeError(msg)
    bad = ~np.isfinite(values)
    wrong = bad.any(axis=1)
    if sensor == "mag":
        wrong &= ~np.isnan(values).all(axis=1)
    if wrong.any():
        k = int(np.flatnonzero(wrong)[0])
        rule = (
            "a row is three numbers, or three NaN for no new sample" if sensor == "mag" else "drop such rows"
        )
        count = int(wrong.sum())
        msg = f"{sensor} of recording {name!r} is {values[k]} at sample {k} ({count} such rows); {rule}"
        raise NotFiniteError(msg)
    return values


def _scalars(given: Array, count: int, name: str) -> Array:
    values = frozen(given)
    if values.shape != (count,) or np.isinf(values).any():
        msg = f"temperature of recording {name!r} must be ({count},), °C or NaN; got {values.shape}"
        raise ShapeError(msg)
    return values


def _placed(log: SensorLog, name: str, width: int, t: Stamps) -> Array:
    """(N, width): each reading of a stream in the row of the nearest stamp of `t`, NaN in the others."""
    stream = log[name]
    if stream.values.shape[1] != width:
        msg = f"log[{name!r}] must have {width} columns, it has {stream.values.shape[1]}"
        raise ShapeError(msg)
    after = np.clip(np.searchsorted(t, stream.t), 1, max(len(t) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(t) - 1)
    nearest = np.where(stream.t - t[before] <= t[after] - stream.t, before, after)
    rows = np.full((len(t), width), np.nan)
    rows[nearest] = stream.values
    return rows
