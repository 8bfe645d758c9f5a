"""Sensors that were sampled each at its own moments, brought onto the stamps of one of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.readers.imu.assemble import Channels
from sequential.readers.imu.units import Scale
from sequential.sensors.finding import Finding

__all__ = ["SensorStream", "increasing", "merge"]

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
WORDS = {"accel": "accelerometer", "gyro": "gyro", "mag": "magnetometer"}
FASTER = 1.5  # times the gyro's rate: from there on, interpolation would alias
BRIDGED = 5.0  # median intervals: a longer pause of a stream is not interpolated over


@dataclass(slots=True, eq=False)
class SensorStream:
    """Readings (N, 3) of one sensor at its own stamps, with the unit that is known for it."""

    t: Stamps
    values: Array
    unit: Scale | None = None

    @property
    def rate(self) -> float:
        """Hz, by the median interval."""
        return float(1e9 / np.median(np.diff(self.t))) if len(self.t) > 1 else float("nan")


def merge(streams: Mapping[str, SensorStream], *, where: str, name: str, findings: list[Finding]) -> Channels:
    """Interpolate the accelerometer at the gyro's stamps; give magnetometer readings to the nearest stamp.

    A stream much faster than the gyro is averaged over the gyro's intervals instead, so that it does not
    alias.  Moments at which a stream is missing or pauses are left out; rows between two magnetometer
    readings are NaN.

    Raises
    ------
    FileFormatError
        where the streams have no time in common.
    """
    clean = {sensor: increasing(stream, sensor, findings) for sensor, stream in streams.items()}
    base = next(sensor for sensor in ("gyro", "accel", "mag") if sensor in clean)
    t = clean[base].t
    arrays: dict[str, Array] = {base: clean[base].values}
    inertial = [sensor for sensor in ("gyro", "accel") if sensor in clean and sensor != base]
    keep = np.ones(len(t), dtype=bool)
    for sensor in inertial:
        arrays[sensor], known = _onto(clean[sensor], t, clean[base].rate)
        keep &= known
        if not np.array_equal(clean[sensor].t, t):
            findings.append(_told(sensor, base, clean, int((~known).sum())))
    if not keep.any():
        raise FileFormatError(
            f"{where}: {' and '.join(clean)} have no moment in common; were they recorded together?"
        )
    if "mag" in clean and base != "mag":
        arrays["mag"] = _nearest(clean["mag"], t)
        if not np.array_equal(clean["mag"].t, t):
            what = (
                f"magnetometer ({clean['mag'].rate:.4g} Hz): readings go to the nearest {WORDS[base]} sample"
            )
            findings.append(Finding("note", what))
    units = {sensor: s.unit for sensor, s in clean.items() if s.unit is not None}
    channels = Channels(where, name, t, **arrays, units=units, findings=findings)
    if not keep.all():
        channels.select(keep)
    return channels


def _told(sensor: str, base: str, streams: Mapping[str, SensorStream], lost: int) -> Finding:
    how = (
        "averaged over its intervals"
        if streams[sensor].rate > FASTER * streams[base].rate
        else "interpolated"
    )
    left = f"; {lost} samples where it is missing are left out" if lost else ""
    what = (
        f"{WORDS[sensor]} ({streams[sensor].rate:.4g} Hz) and {WORDS[base]} ({streams[base].rate:.4g} Hz) "
        f"have stamps of their own; the {WORDS[sensor]} is {how}{left}"
    )
    do = "for a noise figure read its file alone, as this takes up to 30 % off its noise"
    return Finding("note" if lost < 0.02 * len(streams[base].t) else "warn", what, do=do)


def increasing(stream: SensorStream, sensor: str, findings: list[Finding]) -> SensorStream:
    """The stream without rows that hold no number, in order, each stamp once.

    Raises
    ------
    FileFormatError
        where nothing is left.
    """
    good = np.isfinite(stream.values).all(axis=1) & (stream.t != np.iinfo(np.int64).min)
    t, first = np.unique(stream.t[good], return_index=True)
    lost = len(stream.t) - len(t)
    if not len(t):
        raise FileFormatError(
            f"the {WORDS.get(sensor, sensor)} stream holds no reading; leave its file out, or record again"
        )
    if lost or (np.diff(stream.t[good]) < 0).any():
        name = WORDS.get(sensor, sensor)
        what = f"{name}: stamps put in order, {lost} rows that repeat one or hold no number left out"
        findings.append(Finding("note" if lost < 0.01 * len(t) else "warn", what))
    return SensorStream(t, stream.values[good][first], stream.unit)


def _onto(stream: SensorStream, t: Stamps, rate: float) -> tuple[Array, NDArray[np.bool_]]:
    """(N, 3) values at other stamps, and (N,) where they are known: within the stream and not in a pause."""
    if np.array_equal(stream.t, t):
        return stream.values, np.ones(len(t), dtype=bool)
    own, wanted = (stream.t - t[0]) * 1e-9, (t - t[0]) * 1e-9
    if stream.rate > FASTER * rate and len(t) > 2:
        steps = np.diff(own)[:, None]
        total = np.vstack(
            [np.zeros(3), np.cumsum(0.5 * (stream.values[1:] + stream.values[:-1]) * steps, axis=0)]
        )
        middle = 0.5 * (wanted[1:] + wanted[:-1])
        edges = np.concatenate([[2 * wanted[0] - middle[0]], middle, [2 * wanted[-1] - middle[-1]]])
        edges = np.clip(edges, own[0], own[-1])
        summed = np.stack([np.interp(edges, own, total[:, k]) for k in range(3)], axis=1)
        width = np.diff(edges)
        values = np.diff(summed, axis=0) / np.where(width > 0, width, np.nan)[:, None]
    else:
        values = np.stack([np.interp(wanted, own, stream.values[:, k]) for k in range(3)], axis=1)
    after = np.clip(np.searchsorted(stream.t, t), 1, max(len(stream.t) - 1, 1))
    longest = BRIDGED * 1e9 / min(stream.rate, rate)
    pause = (stream.t[np.minimum(after, len(stream.t) - 1)] - stream.t[after - 1]) > longest
    exact = np.isin(t, stream.t)
    known = (t >= stream.t[0]) & (t <= stream.t[-1]) & (~pause | exact) & np.isfinite(values[:, 0])
    return values, known


def _nearest(stream: SensorStream, t: Stamps) -> Array:
    """(N, 3) each reading in the row of the nearest stamp, NaN elsewhere; readings beyond are dropped."""
    rows = np.full((len(t), 3), np.nan)
    middle = (t[1:] + t[:-1]) // 2
    at = np.searchsorted(middle, stream.t, side="right")
    step = np.median(np.diff(t)) if len(t) > 1 else 0
    near = np.abs(stream.t - t[at]) <= max(step, 0)
    rows[at[near]] = stream.values[near]
    return rows
