"""A calibration tried on another recording: |g| in its dwells, and gravity carried over its moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import quaternion_log, rotate
from sequential.sensors.calibration import AffineCalibration, ImuCalibration
from sequential.sensors.dwells import Dwells, join_recordings
from sequential.sensors.gravity import STANDARD_GRAVITY
from sequential.sensors.gyro_integral import intervals_between, turned
from sequential.sensors.recording import ImuRecording
from sequential.sensors.still import StillDetector

__all__ = ["Move", "Verification", "verify"]

Array = NDArray[np.float64]
SMALL = np.radians(5.0)  # a move by less is no move


@dataclass(frozen=True, slots=True, eq=False)
class Move:
    """One move between two dwells, as the calibrated gyro sees it, beside gravity.

    `vector` (3,) is the whole rotation, rad; `rates` (3,) the plain integral of each axis, rad;
    `by_gyro` and `by_gravity` are the angle between the directions of gravity before and after; `off` is
    the angle between gravity as the gyro carries it and as the accelerometer reads it, rad.
    """

    seconds: tuple[float, float]
    vector: Array
    rates: Array
    by_gyro: float
    by_gravity: float
    off: float


@dataclass(frozen=True, slots=True, eq=False)
class Verification:
    """What a calibration makes of another recording.

    `before` and `after` (K,) are |mean| - g, m/s², None without an accelerometer; `bias_change` (3,) is the
    gyro's mean at rest less the calibration's offset, rad/s, None without a gyro; the moves are integrated
    with this recording's own bias, which no calibration can know.
    """

    name: str
    dwells: Dwells
    before: Array | None
    after: Array | None
    bias_change: Array | None
    moves: tuple[Move, ...]

    @property
    def rms(self) -> float | None:
        """Root mean square of `after`."""
        return None if self.after is None else float(np.sqrt(np.mean(self.after**2)))


def verify(
    calibration: ImuCalibration,
    recording: ImuRecording,
    *,
    gravity: float = STANDARD_GRAVITY,
    detector: StillDetector | None = None,
    edge: float = 0.3,
) -> Verification:
    """Try a calibration on a recording that it was not made from.

    Raises
    ------
    DataError
        where the recording is nowhere still, or in another unit.
    """
    done = calibration.apply(recording)
    _, dwells = join_recordings([recording], detector)
    before = after = change = None
    if dwells.accel is not None and calibration.accel is not None:
        after = np.linalg.norm(calibration.accel.apply(dwells.accel), axis=1) - gravity
        if recording.accel_unit == "m/s^2":
            before = np.linalg.norm(dwells.accel, axis=1) - gravity
    if recording.gyro is not None and calibration.gyro is not None:
        change = _rest(done, dwells, calibration.gyro)
    moves = () if change is None or after is None else _moves(done, dwells, edge)
    return Verification(recording.name, dwells, before, after, change, moves)


def _rest(done: ImuRecording, dwells: Dwells, gyro: AffineCalibration) -> Array:
    assert done.gyro is not None  # noqa: S101 - the caller has looked
    parts = [done.gyro[a : b + 1].mean(axis=0) for a, b in zip(dwells.start, dwells.stop, strict=True)]
    return np.asarray(np.average(parts, axis=0, weights=dwells.rows))


def _moves(done: ImuRecording, dwells: Dwells, edge: float) -> tuple[Move, ...]:
    """Every move, from 0.3 s before it to 0.3 s after it, with the bias of the dwell before."""
    assert done.accel is not None  # noqa: S101 - the caller has looked
    assert done.gyro is not None  # noqa: S101
    half = max(1, round(edge * done.rate / 2))
    found = []
    for k in range(len(dwells) - 1):
        a, b = int(dwells.stop[k]) - half, int(dwells.start[k + 1]) + half
        before, after = (done.accel[max(row - half, 0) : row + half + 1].mean(axis=0) for row in (a, b))
        bias = done.gyro[dwells.start[k] : dwells.stop[k] + 1].mean(axis=0)
        interval = intervals_between(done, np.array([a]), np.array([b]))
        q = turned(np.eye(3), bias, interval).quaternion[0]
        arriving = rotate(q * np.array([1.0, -1.0, -1.0, -1.0]), before)
        move = Move(
            (float(dwells.seconds[k, 1]), float(dwells.seconds[k + 1, 0])),
            quaternion_log(q),
            ((interval.raw[0] - bias) * interval.dt[0][:, None]).sum(axis=0),
            _angle(before, arriving),
            _angle(before, after),
            _angle(arriving, after),
        )
        if max(float(np.linalg.norm(move.vector)), move.by_gravity) > SMALL:
            found.append(move)
    return tuple(found)


def _angle(a: Array, b: Array) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
