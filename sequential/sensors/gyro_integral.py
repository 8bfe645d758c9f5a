"""Orientation change between dwells from raw gyro readings, with its derivative by the gyro's constants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply, rotation_matrix
from sequential.manifold.so3 import right_jacobian
from sequential.sensors.recording import ImuRecording

__all__ = ["GyroIntervals", "Turned", "intervals_between", "saturated", "turned", "whole_rotation"]

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class GyroIntervals:
    """Readings of S intervals, padded to the longest one with steps of no length.

    `raw` (S, L, 3) is the mean of the two readings around each step, `dt` (S, L) its length in s;
    `whole` (S,) is False where a reading is at the end of the gyro's range.
    """

    raw: Array
    dt: Array
    clipped: Stamps

    @property
    def seconds(self) -> Array:
        """(S,) length of each interval."""
        return np.asarray(self.dt.sum(axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class Turned:
    """Rotation over each interval, R takes vectors of its end frame to its start frame.

    A small change of the constants turns the end frame by `by_matrix` (S, 3, 9) times the change of the
    matrix, row by row, and `by_offset` (S, 3, 3) times that of the offset (right, in the end frame).
    """

    quaternion: Array  # (S, 4)
    rotation: Array  # (S, 3, 3)
    by_matrix: Array
    by_offset: Array


def intervals_between(recording: ImuRecording, start: Stamps, stop: Stamps) -> GyroIntervals:
    """Readings from row start[k] to row stop[k], both included; `start`, `stop` (S,)."""
    gyro = recording.require("gyro", si=False).gyro
    assert gyro is not None  # noqa: S101 - require() has looked
    longest = int((stop - start).max())
    raw, dt = np.zeros((len(start), longest, 3)), np.zeros((len(start), longest))
    steps, clipped = recording.dt, saturated(gyro)
    for k, (a, b) in enumerate(zip(start.tolist(), stop.tolist(), strict=True)):
        raw[k, : b - a] = (gyro[a:b] + gyro[a + 1 : b + 1]) / 2
        dt[k, : b - a] = steps[a:b]
    # samples that are missing are unknown as clipped ones are
    lost = np.where(steps > 2.5 * np.median(steps), np.round(steps / np.median(steps)) - 1, 0)
    pairs = zip(start.tolist(), stop.tolist(), strict=True)
    count = [int(clipped[a : b + 1].sum() + lost[a:b].sum()) for a, b in pairs]
    return GyroIntervals(raw, dt, np.array(count))


def saturated(values: Array) -> NDArray[np.bool_]:
    """Rows (N,) at an end of their axis' range, where the same reading stands there twice running."""
    middle, spread = np.median(values, axis=0), np.ptp(values, axis=0)
    found = np.zeros(len(values), dtype=bool)
    for end in (values.max(axis=0), values.min(axis=0)):
        at = (np.abs(values - end) <= 1e-9 * spread) & (np.abs(end - middle) > 0.2 * spread)
        running = (at[1:] & at[:-1]).any(axis=0)
        found |= (at & running).any(axis=1)
    return found


def turned(matrix: Array, offset: Array, intervals: GyroIntervals) -> Turned:
    """Integrate matrix @ (raw - offset) over every interval: a product of exponentials of the steps."""
    centred = intervals.raw - offset
    phi = centred @ matrix.T * intervals.dt[..., None]
    q = _running_product(quaternion_exp(phi))
    passed = rotation_matrix(q)
    last = passed[:, -1]
    # what a small turn at step i, right, is worth at the end: (later steps)ᵀ J_r
    weight = last.transpose(0, 2, 1)[:, None] @ passed @ right_jacobian(phi) * intervals.dt[..., None, None]
    by_matrix = np.einsum("slka,slb->skab", weight, centred).reshape(len(phi), 3, 9)
    return Turned(q[:, -1], last, by_matrix, -weight.sum(axis=1) @ matrix)


def whole_rotation(matrix: Array, offset: Array, intervals: GyroIntervals) -> Array:
    """Rotation (S, 3, 3) of each interval alone, by products of pairs, of pairs of pairs …."""
    q = quaternion_exp((intervals.raw - offset) @ matrix.T * intervals.dt[..., None])
    while q.shape[1] > 1:
        odd = q[:, -1:] if q.shape[1] % 2 else q[:, :0]
        even = q.shape[1] - odd.shape[1]
        q = np.concatenate([quaternion_multiply(q[:, 0:even:2], q[:, 1:even:2]), odd], axis=1)
    return rotation_matrix(q[:, 0])


def _running_product(q: Array) -> Array:
    """q0, q0 q1, q0 q1 q2 … along the second axis, in log2(L) passes (Hillis and Steele)."""
    shift = 1
    while shift < q.shape[1]:
        q = np.concatenate([q[:, :shift], quaternion_multiply(q[:, :-shift], q[:, shift:])], axis=1)
        shift *= 2
    return q
