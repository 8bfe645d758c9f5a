"""From a trajectory of markers and an IMU to a first state: gyro bias, velocities, and which way is down.

All linear: the gyro's bias from turns, then gravity and velocities together from the preintegrated forces
(Martinelli 2014, "Closed-form solution of visual-inertial structure from motion"; here the scale is known).
The length of gravity is left free, so that it says whether sizes, units and mount are right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from sequential.errors import DataError
from sequential.manifold import (
    quaternion_exp,
    quaternion_inverse,
    quaternion_log,
    quaternion_multiply,
    quaternion_normalize,
    rotate,
)

if TYPE_CHECKING:
    from factorlab.graph.marker_inertial import Segment

__all__ = ["Delta", "InertialStart", "carried", "deltas", "start_inertial", "upright"]

Array = NDArray[np.float64]
PLACE_M, SPEED = 3e-3, 0.03  # what places of markers and integrated forces are good for, m and m/s
FEWEST = 4


@dataclass(frozen=True, eq=False)
class Delta:
    """What a segment integrates to in the axes of its start, without gravity: (K, …), NaN where it paused."""

    seconds: Array
    turn: Array  # (K, 4)
    velocity: Array  # (K, 3)
    place: Array  # (K, 3)


@dataclass(frozen=True, eq=False)
class InertialStart:
    """Velocities (F, 3) in the axes of the poses given, gravity (3,) there, and the gyro's bias (3,)."""

    velocities: Array
    gravity: Array
    gyro_bias: Array


def deltas(segments: Sequence[Segment | None], biases: Array) -> Delta:
    """Integrate each segment at its bias (K, 6) or (6,): accelerometer, gyro."""
    count = len(segments)
    seconds = np.full(count, np.nan)
    turn, velocity, place = (
        np.full((count, 4), np.nan),
        np.full((count, 3), np.nan),
        np.full((count, 3), np.nan),
    )
    biases = np.broadcast_to(biases, (count, 6))
    for k, segment in enumerate(segments):
        if segment is None:
            continue
        rates = segment.gyro - biases[k, 3:]
        q, v, p = np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3)
        forces = segment.turned(biases[k]) - biases[k, :3]
        steps = quaternion_exp(rates * segment.dt[:, None])
        for force, step, dt in zip(forces, steps, segment.dt.tolist(), strict=True):
            pushed = rotate(q, force)
            p = p + v * dt + 0.5 * dt * dt * pushed
            v = v + dt * pushed
            q = quaternion_multiply(q, step)
        seconds[k], turn[k], velocity[k], place[k] = segment.seconds, quaternion_normalize(q), v, p
    return Delta(seconds, turn, velocity, place)


def start_inertial(poses: Array, segments: Sequence[Segment | None]) -> InertialStart:
    """Solve from poses (F, 7) and the segments between them.

    Raises
    ------
    DataError
        where frames and IMU have too little in common.
    """
    linked = np.array([k for k, segment in enumerate(segments) if segment is not None], dtype=np.int64)
    if len(linked) < FEWEST:
        raise DataError(
            f"camera and IMU share {len(linked)} intervals between frames that show markers; at least "
            f"{FEWEST} are needed"
        )
    bias = np.zeros(3)
    for _ in range(2):
        told = deltas(segments, np.concatenate([np.zeros(3), bias]))
        seen = quaternion_multiply(quaternion_inverse(poses[linked, :4]), poses[linked + 1, :4])
        gap = quaternion_log(quaternion_multiply(quaternion_inverse(told.turn[linked]), seen))
        bias = bias - np.median(gap / told.seconds[linked, None], axis=0)
    told = deltas(segments, np.concatenate([np.zeros(3), bias]))
    velocities, gravity = _velocities(poses, told, linked)
    return InertialStart(velocities, gravity, bias)


def _velocities(poses: Array, told: Delta, linked: NDArray[np.int64]) -> tuple[Array, Array]:
    """Least squares over all velocities (F, 3) and gravity (3,); each axis of the world by itself."""
    count, links = len(poses), len(linked)
    T = told.seconds[linked]
    pushed_p = rotate(poses[linked, :4], told.place[linked])
    pushed_v = rotate(poses[linked, :4], told.velocity[linked])
    row = np.arange(links)
    rows = [row, row, links + row, links + row, links + row, 2 * links + np.arange(count)]
    columns = [linked, np.full(links, count), linked + 1, linked, np.full(links, count), np.arange(count)]
    values = [
        T / PLACE_M, 0.5 * T**2 / PLACE_M, np.full(links, 1 / SPEED), np.full(links, -1 / SPEED), -T / SPEED,
        np.full(count, 1e-3),
    ]  # fmt: skip
    A = coo_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(2 * links + count, count + 1),
    ).tocsc()
    right = np.vstack(
        [
            (poses[linked + 1, 4:] - poses[linked, 4:] - pushed_p) / PLACE_M,
            pushed_v / SPEED,
            np.zeros((count, 3)),
        ]
    )
    solved = splu((A.T @ A).tocsc()).solve(A.T @ right)
    return solved[:-1], solved[-1]


def upright(gravity: Array) -> Array:
    """(7,) pose level_T_world: the least turn that brings gravity down -z."""
    down = gravity / np.linalg.norm(gravity)
    target = np.array([0.0, 0.0, -1.0])
    axis, cosine = np.cross(down, target), float(np.clip(down @ target, -1.0, 1.0))
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        turn = np.zeros(3) if cosine > 0 else np.array([np.pi, 0.0, 0.0])
    else:
        turn = axis / sine * np.arctan2(sine, cosine)
    return np.concatenate([quaternion_exp(turn), np.zeros(3)])


def carried(
    pose: Array, velocity: Array, told: Delta, k: int, gravity: Array, *, back: bool
) -> tuple[Array, Array]:
    """Pose and velocity at the other end of segment k."""
    T = told.seconds[k]
    if not back:
        place = pose[4:] + velocity * T + 0.5 * gravity * T**2 + rotate(pose[:4], told.place[k])
        speed = velocity + gravity * T + rotate(pose[:4], told.velocity[k])
        return np.concatenate(
            [quaternion_normalize(quaternion_multiply(pose[:4], told.turn[k])), place]
        ), speed
    q = quaternion_normalize(quaternion_multiply(pose[:4], quaternion_inverse(told.turn[k])))
    speed = velocity - gravity * T - rotate(q, told.velocity[k])
    place = pose[4:] - speed * T - 0.5 * gravity * T**2 - rotate(q, told.place[k])
    return np.concatenate([q, place]), speed
