"""The closed form of Ferraris et al. (1995) over the means of nine sections, and its covariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.sensors.ferraris_sections import POSITIONS, TURNS, Rows
from sequential.sensors.recording import ImuRecording

__all__ = ["Parameters", "SectionMeans", "parameter_cov", "solve"]

Array = NDArray[np.float64]
BLOCKS = 8  # of a section, whose scatter says how well its mean is known


@dataclass(frozen=True, slots=True, eq=False)
class Parameters:
    """Gain K and rotation R of accelerometer and gyro, offsets, and the influence of force on the gyro."""

    accel_gain: Array
    accel_rotation: Array
    accel_offset: Array
    gyro_gain: Array
    gyro_rotation: Array
    gyro_offset: Array
    g_sensitivity: Array

    @property
    def accel_matrix(self) -> Array:
        """(3, 3) from raw to m/s²."""
        return np.asarray(np.linalg.inv(self.accel_gain @ self.accel_rotation))

    @property
    def gyro_matrix(self) -> Array:
        """(3, 3) from raw to rad/s."""
        return np.asarray(np.linalg.inv(self.gyro_gain @ self.gyro_rotation))

    @property
    def stacked(self) -> Array:
        """(33,) accelerometer's matrix and offset, gyro's matrix and offset, g-sensitivity."""
        return np.concatenate(
            [
                self.accel_matrix.ravel(),
                self.accel_offset,
                self.gyro_matrix.ravel(),
                self.gyro_offset,
                self.g_sensitivity.ravel(),
            ]
        )


@dataclass(frozen=True, slots=True, eq=False)
class SectionMeans:
    """Everything that the closed form needs of a session.

    `accel`, `gyro` (6, 3) are means of the positions in the order of `POSITIONS`, `counts` (6,) their
    samples; `turn_accel`, `turn_gyro` (3, 3) are the means during the turns, `turn_seconds` (3,) their
    durations.  Covariances carry `_cov` (…, 3, 3).
    """

    accel: Array
    gyro: Array
    counts: Array
    turn_accel: Array
    turn_gyro: Array
    turn_seconds: Array
    accel_cov: Array
    gyro_cov: Array
    turn_gyro_cov: Array

    @classmethod
    def of(cls, recording: ImuRecording, sections: Mapping[str, Rows]) -> SectionMeans:
        """Means over the sections; turns are integrated over the recording's own stamps."""
        assert recording.accel is not None  # noqa: S101 - required by the caller
        assert recording.gyro is not None  # noqa: S101
        accel = [recording.accel[sections[name]] for name in POSITIONS]
        gyro = [recording.gyro[sections[name]] for name in POSITIONS]
        turn_gyro, turn_accel, seconds = [], [], []
        for name in TURNS:
            rows = sections[name]
            step = np.gradient(recording.seconds[rows])  # what each sample stands for
            seconds.append(step.sum())
            turn_gyro.append(step @ recording.gyro[rows] / step.sum())
            turn_accel.append(step @ recording.accel[rows] / step.sum())
        counts = np.array([len(part) for part in gyro], dtype=np.float64)
        gyro_cov = np.array([_cov_of_mean(part) for part in gyro])
        # a turn is motion, and its noise is that of the still sections
        one_sample = np.mean(gyro_cov * counts[:, None, None], axis=0)
        return cls(
            np.array([part.mean(axis=0) for part in accel]),
            np.array([part.mean(axis=0) for part in gyro]),
            counts,
            np.array(turn_accel),
            np.array(turn_gyro),
            np.array(seconds),
            np.array([_cov_of_mean(part) for part in accel]),
            gyro_cov,
            np.array([one_sample / len(sections[name]) for name in TURNS]),
        )

    def turned(self, found: Parameters) -> Array:
        """(3, 3) raw turn of each rotation (rows), offset and influence of force taken off."""
        force = (self.turn_accel - found.accel_offset) @ found.accel_matrix.T
        rate = self.turn_gyro - found.gyro_offset - force @ found.g_sensitivity.T
        return np.asarray(rate * self.turn_seconds[:, None])


def _cov_of_mean(values: Array) -> Array:
    """(3, 3) of a mean, from block means where there are enough samples: neighbours may be correlated."""
    length = len(values) // BLOCKS
    white = np.cov(values.T) / len(values)
    if length < 2:
        return white
    blocks = np.cov(values[: length * BLOCKS].reshape(BLOCKS, length, 3).mean(axis=1).T) / BLOCKS
    factor = max(1.0, float(np.trace(blocks) / max(np.trace(white), 1e-300)))
    return np.asarray(white * factor)


def solve(data: SectionMeans, gravity: float, turn: float) -> Parameters:
    """Constants from the means.

    Raises
    ------
    DataError
        where an axis does not change between its two positions, or did not turn.
    """
    up, down = data.accel[0::2].T, data.accel[1::2].T  # one position a column
    offset = np.diag(up + down) / 2  # eq. 20
    apart = up - down  # eq. 21
    gain = np.sqrt((apart**2).sum(axis=1)) / (2 * abs(gravity))  # eq. 23
    _require_signal(gain, "accelerometer", "does not change between its positions")
    rotation = apart / gain[:, None] / (2 * gravity)  # eq. 22

    gyro_offset = data.counts @ data.gyro / data.counts.sum()
    sensitivity = (data.gyro[0::2] - data.gyro[1::2]).T / (2 * gravity)  # eq. 9
    partial = Parameters(np.diag(gain), rotation, offset, np.eye(3), np.eye(3), gyro_offset, sensitivity)
    per_angle = data.turned(partial).T / turn  # eqs. 13-15
    gyro_gain = np.sqrt((per_angle**2).sum(axis=1))  # eq. 12
    _require_signal(gyro_gain, "gyro", "reads no turn")
    return replace(partial, gyro_gain=np.diag(gyro_gain), gyro_rotation=per_angle / gyro_gain[:, None])


def _require_signal(gain: Array, sensor: str, what: str) -> None:
    dead = [axis for axis, one in zip("xyz", gain, strict=True) if not one > 1e-9 * gain.max()]
    if dead or not gain.max() > 0:
        raise DataError(
            f"{sensor}: axis {', '.join(dead) or 'x, y, z'} {what}: constant readings, or a broken axis"
        )


def parameter_cov(
    data: SectionMeans, found: Parameters, gravity: float, turn: float, tilt_sigma: float, turn_sigma: float
) -> Array:
    """(33, 33) of `Parameters.stacked`, first order: noise of the means, and how well a hand sets them."""
    to_raw = np.linalg.inv(found.accel_matrix)
    gyro_raw = np.linalg.inv(found.gyro_matrix)
    parts = []
    for k in range(6):
        axis = np.eye(3)[k // 2]
        tilted = gravity * tilt_sigma * (np.eye(3) - np.outer(axis, axis))  # g × a small rotation
        placed = to_raw @ tilted @ tilted.T @ to_raw.T
        parts.append(("accel", k, data.accel_cov[k] + placed))
        parts.append(("gyro", k, data.gyro_cov[k]))
    for k in range(3):
        axis = np.eye(3)[k]
        wrong = turn * tilt_sigma * (np.eye(3) - np.outer(axis, axis)) + turn_sigma * np.outer(axis, axis)
        rate = gyro_raw @ wrong / data.turn_seconds[k]
        parts.append(("turn_gyro", k, data.turn_gyro_cov[k] + rate @ rate.T))
    total = np.zeros((33, 33))
    for name, k, cov in parts:
        jacobian = _jacobian(data, name, k, cov, gravity, turn)
        total += jacobian @ cov @ jacobian.T
    return (total + total.T) / 2


def _jacobian(data: SectionMeans, name: str, k: int, cov: Array, gravity: float, turn: float) -> Array:
    """(33, 3) derivative by one mean, central differences of the closed form."""
    columns = []
    scale = np.abs(getattr(data, name)).max()
    for axis in range(3):
        step = max(1e-6 * scale, 1e-12)
        ends = []
        for sign in (1.0, -1.0):
            moved = getattr(data, name).copy()
            moved[k, axis] += sign * step
            ends.append(solve(replace(data, **{name: moved}), gravity, turn).stacked)
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.stack(columns, axis=1)
