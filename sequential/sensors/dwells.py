"""Dwells of a recording as numbers: mean readings while it is still, and how well each mean is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.sensors.recording import ImuRecording
from sequential.sensors.still import StillDetector

__all__ = ["Dwells", "find_dwells", "join_recordings"]

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
BLOCK = 0.25  # s: means of such blocks are taken for independent of one another


@dataclass(frozen=True, slots=True, eq=False)
class Dwells:
    """Still parts of one recording, in order.

    Parameters
    ----------
    start, stop : (K,) first and last row of each
    rows : (K,) samples in it, knocks left out
    accel : (K, 3) mean reading in the recording's unit, None without an accelerometer
    accel_cov : (K, 3, 3) covariance of that mean, correlation between samples counted in
    gyro, gyro_cov : the same of the gyro
    seconds : (K, 2) first and last instant, s after the recording's first sample
    accel_unit, gyro_unit : units of the means
    name : of the recording
    part : (K,) number of the recording, where several were joined
    """

    start: Stamps
    stop: Stamps
    rows: Stamps
    seconds: Array
    accel: Array | None = None
    accel_cov: Array | None = None
    gyro: Array | None = None
    gyro_cov: Array | None = None
    accel_unit: str = "m/s^2"
    gyro_unit: str = "rad/s"
    name: str = "recording"
    part: Stamps = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        if len(self.part) != len(self.start):
            object.__setattr__(self, "part", np.zeros(len(self.start), dtype=np.int64))

    def __len__(self) -> int:
        return len(self.start)


def find_dwells(recording: ImuRecording, detector: StillDetector | None = None) -> Dwells:
    """Find the still parts of a recording and average them.

    Raises
    ------
    DataError
        where the recording is never still for long enough.
    """
    detector = detector or StillDetector()
    found = detector.find(recording)
    if not found:
        raise DataError(
            f"recording {recording.name!r} is nowhere still for {detector.shortest:g} s: hold every position "
            "for 3 s on a firm support, or allow shorter dwells"
        )
    length = max(2, round(BLOCK * recording.rate))
    times = recording.seconds
    means: dict[str, Any] = {}
    for sensor in ("accel", "gyro"):
        values = getattr(recording, sensor)
        if values is not None:
            means[sensor], means[f"{sensor}_cov"] = _averages([values[rows] for rows in found], length)
    return Dwells(
        start=np.array([rows[0] for rows in found]),
        stop=np.array([rows[-1] for rows in found]),
        rows=np.array([len(rows) for rows in found]),
        seconds=np.array([(times[rows[0]], times[rows[-1]]) for rows in found]),
        accel_unit=recording.accel_unit,
        gyro_unit=recording.gyro_unit,
        name=recording.name,
        **means,
    )


def join_recordings(
    recordings: Sequence[ImuRecording], detector: StillDetector | None = None
) -> tuple[ImuRecording, Dwells]:
    """Several recordings of one sensor as one, ten seconds apart, and the dwells of all.

    Dwells are found in each by itself, so a recording may be of one position only.

    Raises
    ------
    DataError
        where they hold different sensors or units.
    """
    first = recordings[0]
    for other in recordings[1:]:
        for name in ("sensors", "accel_unit", "gyro_unit"):
            if getattr(other, name) != getattr(first, name):
                raise DataError(
                    f"recordings to be joined differ in {name}: {first.name!r} has {getattr(first, name)}, "
                    f"{other.name!r} {getattr(other, name)}; give units for both"
                )
    dwells = [find_dwells(one, detector) for one in recordings]
    if len(recordings) == 1:
        return first, dwells[0]
    shifts = np.cumsum([0.0] + [one.duration + 10.0 for one in recordings[:-1]])
    rows = np.cumsum([0] + [len(one) for one in recordings[:-1]])
    name = " + ".join(one.name for one in recordings)

    def stacked(field_name: str) -> Array | None:
        parts = [getattr(one, field_name) for one in recordings]
        return None if any(part is None for part in parts) else np.concatenate(parts)

    stamps = [one.t - one.t[0] + np.int64(s * 1e9) for one, s in zip(recordings, shifts, strict=True)]
    whole = ImuRecording(
        np.concatenate(stamps),
        stacked("accel"),
        stacked("gyro"),
        name=name,
        accel_unit=first.accel_unit,
        gyro_unit=first.gyro_unit,
    )
    joined: dict[str, Any] = {}
    for key in ("rows", "accel", "accel_cov", "gyro", "gyro_cov"):
        if getattr(dwells[0], key) is not None:
            joined[key] = np.concatenate([getattr(one, key) for one in dwells])
    for key, moved in (("start", rows), ("stop", rows), ("seconds", shifts)):
        joined[key] = np.concatenate([getattr(one, key) + by for one, by in zip(dwells, moved, strict=True)])
    part = np.repeat(np.arange(len(dwells)), [len(one) for one in dwells])
    return whole, replace(dwells[0], name=name, part=part, **joined)


def _averages(parts: list[Array], length: int) -> tuple[Array, Array]:
    """Means (K, 3) and their covariances (K, 3, 3).

    Samples of one sensor are correlated by its filter and by drift: the variance of block means over what
    independent samples would give says by how much.  Its median over the dwells holds for all; a dwell whose
    own blocks scatter more, as in a hand that trembles, gets its own.
    """
    white = [np.cov(part.T) / len(part) for part in parts]
    ratio = np.array([_correlation(part, length) for part in parts])
    usual = max(1.0, float(np.median(ratio)))
    factors = np.where(ratio > 2 * usual, ratio, usual)  # a dozen blocks alone would be a poor estimate
    return np.array([part.mean(axis=0) for part in parts]), factors[:, None, None] * np.array(white)


def _correlation(part: Array, length: int) -> float:
    """Variance of block means over that of independent samples; 1 where there are few blocks."""
    count, total = len(part) // length, float(np.var(part, axis=0, ddof=1).sum())
    if count < 4 or total <= 0:
        return 1.0
    blocks = part[: count * length].reshape(count, length, 3).mean(axis=1)
    return float(np.var(blocks, axis=0, ddof=1).sum()) * length / total
