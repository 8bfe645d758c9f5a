"""The moves between dwells as a least-squares problem: where the gyro makes gravity arrive."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.sensors.calibration import AffineCalibration
from sequential.sensors.dwells import Dwells
from sequential.sensors.gyro_integral import GyroIntervals, intervals_between, rotations, turned
from sequential.sensors.gyro_rest import GyroAtRest
from sequential.sensors.recording import ImuRecording

__all__ = ["GyroCase"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class GyroCase:
    """Moves to be explained: gravity before and after (S, 3), readings between, noise of the arrival."""

    start: Array
    end: Array
    intervals: GyroIntervals
    noise: Array  # (2 S,) rad²
    gain: float  # nominal, rad/s per unit of the reading
    rest: GyroAtRest

    @classmethod
    def of(
        cls,
        recording: ImuRecording,
        dwells: Dwells,
        accel: AffineCalibration,
        rest: GyroAtRest,
        moves: NDArray[np.int64],
        edge: float,
    ) -> GyroCase:
        """Gravity `edge` seconds around both ends of every move, and the readings between."""
        assert recording.accel is not None  # noqa: S101 - the caller has looked
        assert recording.gyro is not None  # noqa: S101
        force = accel.apply(recording.accel)
        if rest.g_sensitivity is not None:
            recording = replace(recording, gyro=recording.gyro - force @ rest.g_sensitivity.T)
        half = max(1, round(edge * recording.rate / 2))
        leave = np.maximum(dwells.stop[moves] - half, dwells.start[moves])
        arrive = np.minimum(dwells.start[moves + 1] + half, dwells.stop[moves + 1])
        start, start_noise = _directions(force, leave, half)
        end, end_noise = _directions(force, arrive, half)
        intervals = intervals_between(recording, leave, arrive)
        gain = 1.0 if recording.gyro_unit == "rad/s" else _nominal_gain(start, end, intervals, rest.bias)
        clipped = (intervals.clipped * gain * intervals.dt.max() * np.ptp(intervals.raw) / 10) ** 2
        return cls(start, end, intervals, np.repeat(start_noise + end_noise + clipped, 2), gain, rest)

    def only(self, used: Mask) -> GyroCase:
        """The same problem with some of the moves."""
        parts = self.intervals
        kept = GyroIntervals(parts.raw[used], parts.dt[used], parts.clipped[used])
        noise = self.noise[np.repeat(used, 2)]
        return replace(self, start=self.start[used], end=self.end[used], intervals=kept, noise=noise)

    def residuals(self, x: Array) -> tuple[Array, Array]:
        """Arriving direction less the one read, across it (2 S,), and its derivative (2 S, 12)."""
        turn = turned(x[:9].reshape(3, 3) * self.gain, x[9:] / self.gain, self.intervals)
        arriving = np.einsum("sji,sj->si", turn.rotation, self.start)
        across = _across(self.end)
        off = np.einsum("sai,si->sa", across, arriving - self.end)
        change = np.einsum("sai,sij->saj", across, _skew(arriving))
        J = np.concatenate([change @ turn.by_matrix * self.gain, change @ turn.by_offset / self.gain], axis=2)
        return off.ravel(), J.reshape(-1, 12)

    def angles(self, matrix: Array, offset: Array) -> Array:
        """Angle (S,) between arriving and measured direction, rad."""
        arriving = np.einsum("sji,sj->si", rotations(matrix, offset, self.intervals)[:, -1], self.start)
        cross = np.linalg.norm(np.cross(arriving, self.end), axis=1)
        return np.asarray(np.arctan2(cross, np.sum(arriving * self.end, axis=1)))


def _directions(force: Array, rows: NDArray[np.int64], half: int) -> tuple[Array, Array]:
    """Unit mean (S, 3) of the samples around each row, and its variance per axis across (S,), rad²."""
    found, noise = np.empty((len(rows), 3)), np.empty(len(rows))
    for k, row in enumerate(rows.tolist()):
        part = force[max(row - half, 0) : row + half + 1]
        mean = part.mean(axis=0)
        found[k] = mean / np.linalg.norm(mean)
        noise[k] = part.var(axis=0).sum() / 3 / len(part) / float(mean @ mean)
    return found, noise


def _nominal_gain(start: Array, end: Array, intervals: GyroIntervals, bias: Array) -> float:
    """One gain for all axes, where the unit of the readings is not known: the best of a coarse search."""
    most = float(np.abs(intervals.raw - bias)[intervals.dt > 0].max())
    trial = np.geomspace(0.3, 60.0, 90) / most  # the fastest move of a hand lies between, rad/s

    def misfit(gain: float) -> float:
        arriving = np.einsum("sji,sj->si", rotations(np.eye(3) * gain, bias, intervals)[:, -1], start)
        return float(np.sum(np.minimum(np.sum((arriving - end) ** 2, axis=1), 0.1)))

    costs = [misfit(gain) for gain in trial]
    best = int(np.argmin(costs))
    fine = np.geomspace(trial[max(best - 1, 0)], trial[min(best + 1, len(trial) - 1)], 15)
    return float(fine[int(np.argmin([misfit(gain) for gain in fine]))])


def _skew(v: Array) -> Array:
    """[v]× (S, 3, 3): a frame turned right by δ sees v as v + v × δ."""
    x, y, z = v.T
    o = np.zeros_like(x)
    return np.stack([np.stack([o, -z, y], -1), np.stack([z, o, -x], -1), np.stack([-y, x, o], -1)], -2)


def _across(direction: Array) -> Array:
    """Two unit vectors across each direction, (S, 2, 3)."""
    away = np.eye(3)[np.argmin(np.abs(direction), axis=1)]
    first = np.cross(direction, away)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(direction, first)], axis=1)
