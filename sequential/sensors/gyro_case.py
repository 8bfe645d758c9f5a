"""The moves between dwells as a least-squares problem: where the gyro makes gravity arrive."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.sensors.calibration import AffineCalibration
from sequential.sensors.dwells import Dwells
from sequential.sensors.gyro_integral import GyroIntervals, intervals_between, turned, whole_rotation
from sequential.sensors.gyro_rest import GyroAtRest
from sequential.sensors.recording import ImuRecording

__all__ = ["GyroCase"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class GyroCase:
    """Moves to be explained, by the gyro's constants and by what is doubtful about the accelerometer's.

    Parameters
    ----------
    before, after : (S, 3) mean raw accelerometer at the ends of the dwells next to each move
    accel : its calibration; `doubt` (12, q) is a root of the covariance of that
    intervals : readings of the gyro between
    noise : (2 S,) variance of the arriving direction, rad²
    gain : nominal, rad/s per unit of the gyro's reading
    rest : what the gyro reads at rest
    """

    before: Array
    after: Array
    accel: AffineCalibration
    doubt: Array
    intervals: GyroIntervals
    noise: Array
    gain: float
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
        raw = recording.accel
        assert raw is not None  # noqa: S101 - the caller has looked
        assert recording.gyro is not None  # noqa: S101
        if rest.g_sensitivity is not None:
            felt = accel.apply(raw) @ rest.g_sensitivity.T
            recording = replace(recording, gyro=recording.gyro - felt)
        half = max(1, round(edge * recording.rate / 2))
        leave = np.maximum(dwells.stop[moves] - half, dwells.start[moves])
        arrive = np.minimum(dwells.start[moves + 1] + half, dwells.stop[moves + 1])
        before, before_noise = _edges(raw, leave, half, accel)
        after, after_noise = _edges(raw, arrive, half, accel)
        intervals = intervals_between(recording, leave, arrive)
        start, end = (_unit(accel.apply(raw)) for raw in (before, after))
        gain = 1.0 if recording.gyro_unit == "rad/s" else _nominal_gain(start, end, intervals, rest.bias)
        step = float(np.median(intervals.dt[intervals.dt > 0]))
        clipped = (intervals.clipped * gain * step * np.ptp(intervals.raw) / 10) ** 2
        noise = np.repeat(before_noise + after_noise + clipped, 2)
        return cls(before, after, accel, _root(accel.cov), intervals, noise, gain, rest)

    def only(self, used: Mask) -> GyroCase:
        """The same problem with some of the moves."""
        parts = self.intervals
        kept = GyroIntervals(parts.raw[used], parts.dt[used], parts.clipped[used])
        noise = self.noise[np.repeat(used, 2)]
        return replace(self, before=self.before[used], after=self.after[used], intervals=kept, noise=noise)

    def refined(self, x: Array, cov: Array) -> AffineCalibration:
        """The accelerometer's calibration at the fitted parameters (12 + q,), with its covariance."""
        change = self.doubt @ x[12:]
        return replace(
            self.accel,
            matrix=self.accel.matrix + change[:9].reshape(3, 3),
            offset=self.accel.offset + change[9:],
            cov=None if self.accel.cov is None else self.doubt @ cov[12:, 12:] @ self.doubt.T,
        )

    def residuals(self, x: Array) -> tuple[Array, Array]:
        """Arriving direction less the one read, across it (2 S,), and its derivative (2 S, 12 + q)."""
        turn = turned(x[:9].reshape(3, 3) * self.gain, x[9:12] / self.gain, self.intervals)
        change = self.doubt @ x[12:]
        matrix, offset = self.accel.matrix + change[:9].reshape(3, 3), self.accel.offset + change[9:]
        start, by_start = _direction(self.before, matrix, offset)
        end, by_end = _direction(self.after, matrix, offset)
        back = turn.rotation.transpose(0, 2, 1)
        arriving = np.einsum("sij,sj->si", back, start)
        across = _across(self.accel.apply(self.after))  # one plane for all trials
        off = np.einsum("sai,si->sa", across, arriving - end)
        moved = across @ _skew(arriving)
        by_gyro = [moved @ turn.by_matrix * self.gain, moved @ turn.by_offset / self.gain]
        by_accel = across @ (back @ by_start - by_end) @ self.doubt
        return off.ravel(), np.concatenate([*by_gyro, by_accel], axis=2).reshape(off.size, -1)

    def angles(self, matrix: Array, offset: Array, accel: AffineCalibration) -> Array:
        """Angle (S,) between arriving and measured direction, rad."""
        start, end = (_unit(accel.apply(raw)) for raw in (self.before, self.after))
        arriving = np.einsum("sji,sj->si", whole_rotation(matrix, offset, self.intervals), start)
        return _angle(arriving, end)

    def moved(self) -> Array:
        """Angle (S,) between gravity before and after each move, rad."""
        return _angle(*(_unit(self.accel.apply(raw)) for raw in (self.before, self.after)))


def _edges(raw: Array, rows: NDArray[np.int64], half: int, accel: AffineCalibration) -> tuple[Array, Array]:
    """Mean (S, 3) of the samples around each row, and the variance (S,) of its direction, rad²."""
    means, noise = np.empty((len(rows), 3)), np.empty(len(rows))
    for k, row in enumerate(rows.tolist()):
        part = raw[max(row - half, 0) : row + half + 1]
        means[k] = part.mean(axis=0)
        force = accel.apply(part)
        noise[k] = force.var(axis=0).sum() / 3 / len(part) / float(np.sum(force.mean(axis=0) ** 2))
    return means, noise


def _direction(raw: Array, matrix: Array, offset: Array) -> tuple[Array, Array]:
    """Unit calibrated reading (S, 3) and its derivative (S, 3, 12) by matrix and offset."""
    centred = raw - offset
    force = centred @ matrix.T
    length = np.linalg.norm(force, axis=1)[:, None]
    unit = force / length
    flat = (np.eye(3) - unit[:, :, None] * unit[:, None, :]) / length[..., None]
    by_matrix = np.einsum("sia,sb->siab", flat, centred).reshape(len(raw), 3, 9)
    return unit, np.concatenate([by_matrix, -flat @ matrix], axis=2)


def _root(cov: Array | None) -> Array:
    """A root (12, q) of a covariance of rank q; nothing is doubtful without one."""
    if cov is None:
        return np.zeros((12, 0))
    sigma = np.sqrt(np.clip(np.diag(cov), 0.0, None))
    scale = np.where(sigma > 0, sigma, 1.0)
    values, vectors = np.linalg.eigh(cov / np.outer(scale, scale))
    kept = values > 1e-9
    return np.asarray(sigma[:, None] * vectors[:, kept] * np.sqrt(values[kept]))


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def _angle(a: Array, b: Array) -> Array:
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1)))


def _nominal_gain(start: Array, end: Array, intervals: GyroIntervals, bias: Array) -> float:
    """One gain for all axes, where the unit of the readings is not known: the best of a coarse search."""
    most = float(np.abs(intervals.raw - bias)[intervals.dt > 0].max())
    trial = np.geomspace(0.3, 60.0, 90) / most  # the fastest move of a hand lies between, rad/s

    def misfit(gain: float) -> float:
        arriving = np.einsum("sji,sj->si", whole_rotation(np.eye(3) * gain, bias, intervals), start)
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
    direction = _unit(direction)
    away = np.eye(3)[np.argmin(np.abs(direction), axis=1)]
    first = np.cross(direction, away)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(direction, first)], axis=1)
