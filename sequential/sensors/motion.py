"""Motions whose orientation, angular rate and acceleration are known exactly at any moment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from sequential.manifold.quaternion import (
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_log,
    quaternion_multiply,
)
from sequential.manifold.so3 import right_jacobian

__all__ = ["SIX_POSITIONS", "Motion", "constant_rate", "stationary", "tumble", "waypoints"]

Array = NDArray[np.float64]
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """What a body does from 0 to `duration` seconds; every function takes times (N,) in seconds.

    Parameters
    ----------
    duration : s
    attitude : gives world_q_body (N, 4) and the angular rate (N, 3) in the body frame, rad/s
    acceleration : gives the acceleration (N, 3) in the world frame, z up, m/s²
    rest : gives (N,) True where the body stands still
    """

    duration: float
    attitude: Callable[[Array], tuple[Array, Array]]
    acceleration: Callable[[Array], Array]
    rest: Callable[[Array], NDArray[np.bool_]]

    def __post_init__(self) -> None:
        if not (np.isfinite(self.duration) and self.duration > 0):
            msg = f"a motion lasts a positive number of seconds, got {self.duration}"
            raise DataError(msg)


def stationary(duration: float, world_q_body: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> Motion:
    """Rest for `duration` seconds."""
    q = np.asarray(world_q_body, dtype=np.float64)
    return Motion(
        duration,
        lambda t: (np.tile(q / np.linalg.norm(q), (len(t), 1)), np.zeros((len(t), 3))),
        _unmoved,
        lambda t: np.ones(len(t), dtype=bool),
    )


def constant_rate(duration: float, rate: ArrayLike, start: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> Motion:
    """Turn at a constant angular rate (3,), rad/s in the body frame, from the attitude `start`."""
    omega, q = np.asarray(rate, dtype=np.float64), np.asarray(start, dtype=np.float64)

    def attitude(t: Array) -> tuple[Array, Array]:
        turned = quaternion_exp(t[:, None] * omega)
        return quaternion_multiply(np.broadcast_to(q, turned.shape), turned), np.tile(omega, (len(t), 1))

    return Motion(duration, attitude, _unmoved, lambda t: np.full(len(t), not omega.any()))


def waypoints(attitudes: ArrayLike, dwell: float = 3.0, travel: float = 1.0) -> Motion:
    """Rest at every attitude (K, 4) for `dwell` seconds, and turn to the next one in `travel` seconds.

    Each turn is about an axis fixed in the body and follows 10 s³ - 15 s⁴ + 6 s⁵, so that rate and
    angular acceleration begin and end at zero.
    """
    q = np.atleast_2d(np.asarray(attitudes, dtype=np.float64))
    if q.ndim != 2 or q.shape[1] != 4:
        msg = f"attitudes are quaternions of shape (K, 4), got {q.shape}"
        raise ShapeError(msg)
    q = q / np.linalg.norm(q, axis=1, keepdims=True)
    turns = np.zeros((len(q), 3))
    turns[:-1] = quaternion_log(quaternion_multiply(quaternion_inverse(q[:-1]), q[1:]))
    period = dwell + travel

    def place(t: Array) -> tuple[NDArray[np.int64], Array]:
        leg = np.clip((t // period).astype(np.int64), 0, len(q) - 1)
        return leg, np.clip((t - leg * period - dwell) / travel, 0.0, 1.0)

    def attitude(t: Array) -> tuple[Array, Array]:
        leg, s = place(t)
        way = (s**3 * (10.0 - 15.0 * s + 6.0 * s * s))[:, None]
        speed = (30.0 * (s * (1.0 - s)) ** 2 / travel)[:, None]
        return quaternion_multiply(q[leg], quaternion_exp(way * turns[leg])), speed * turns[leg]

    def rest(t: Array) -> NDArray[np.bool_]:
        leg, s = place(t)
        return np.asarray((s <= 0.0) | (s >= 1.0) | ~turns[leg].any(axis=1))

    return Motion(len(q) * period - travel, attitude, _unmoved, rest)


def tumble(
    duration: float,
    rng: np.random.Generator,
    *,
    angle: float = 0.6,
    sway: float = 0.05,
    period: tuple[float, float] = (2.0, 10.0),
    rest: float = 0.0,
) -> Motion:
    """Turn and sway without end: sums of sines, different in every axis.

    Parameters
    ----------
    angle : amplitude of each of three sines of the rotation vector, in every axis, rad
    sway : amplitude of each of three sines of the position, in every axis, m
    period : shortest and longest period of the sines, s
    rest : seconds of rest at the beginning; the motion then starts without a jump
    """
    omega = 2.0 * np.pi / rng.uniform(*period, size=(2, 3, 3))
    phase = rng.uniform(0.0, 2.0 * np.pi, size=(2, 3, 3))

    def begun(t: Array) -> tuple[Array, Array, Array]:
        """Warped time that starts at 0 with zero speed, its speed and its acceleration."""
        u = np.maximum(t - rest, 0.0)
        if rest <= 0.0:
            return u, np.ones_like(u), np.zeros_like(u)
        return u - np.tanh(u), np.tanh(u) ** 2, 2.0 * np.tanh(u) / np.cosh(np.minimum(u, 300.0)) ** 2

    def attitude(t: Array) -> tuple[Array, Array]:
        u, speed, _ = begun(t)
        wave = u[:, None, None] * omega[0] + phase[0]
        phi = angle * np.sin(wave).sum(axis=1)
        change = angle * (omega[0] * np.cos(wave)).sum(axis=1) * speed[:, None]
        return quaternion_exp(phi), np.einsum("nij,nj->ni", right_jacobian(phi), change)

    def acceleration(t: Array) -> Array:
        u, speed, gain = begun(t)
        wave = u[:, None, None] * omega[1] + phase[1]
        bent = -(omega[1] ** 2 * np.sin(wave)).sum(axis=1) * (speed**2)[:, None]
        return np.asarray(sway * (bent + (omega[1] * np.cos(wave)).sum(axis=1) * gain[:, None]))

    return Motion(duration, attitude, acceleration, lambda t: t < rest)


def _unmoved(t: Array) -> Array:
    return np.zeros((len(t), 3))


def _six() -> Array:
    """Attitudes (6, 4) that point x, -x, y, -y, z, -z up, in this order."""
    found = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            up = sign * np.eye(3)[axis]
            east = np.eye(3)[(axis + 1) % 3]
            found.append(quaternion_from_matrix(np.stack([east, np.cross(up, east), up])))
    return np.array(found)


SIX_POSITIONS = _six()
