"""Roll, pitch and yaw: what people read, and what accelerometers and magnetometers say about them.

R = Rz(yaw) Ry(pitch) Rx(roll) turns body into world coordinates, with z up in both.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.manifold.quaternion import quaternion_normalize

__all__ = [
    "attitude_from_angles",
    "attitude_from_vectors",
    "body_rates",
    "euler_rates",
    "roll_pitch_yaw",
    "tilt",
]

Array = NDArray[np.float64]
LEVEL = 1e-6
"""Cosine of the pitch from which roll and yaw are taken apart as if it were this."""


def roll_pitch_yaw(world_q_body: Array) -> Array:
    """Angles (..., 3), rad, of unit quaternions (..., 4); roll and yaw in [-π, π], pitch in [-π/2, π/2]."""
    w, x, y, z = (world_q_body[..., i] for i in range(4))
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.stack([roll, pitch, yaw], axis=-1)


def attitude_from_angles(angles: ArrayLike) -> Array:
    """Unit quaternions (..., 4) of roll, pitch and yaw (..., 3), rad."""
    half = 0.5 * np.asarray(angles, dtype=np.float64)
    (cr, cp, cy), (sr, sp, sy) = ([function(half[..., i]) for i in range(3)] for function in (np.cos, np.sin))
    w = cr * cp * cy + sr * sp * sy
    x = sr * cp * cy - cr * sp * sy
    y = cr * sp * cy + sr * cp * sy
    z = cr * cp * sy - sr * sp * cy
    return np.stack([w, x, y, z], axis=-1)


def tilt(accel: Array) -> Array:
    """Roll and pitch (..., 2), rad, at which gravity alone would give these specific forces (..., 3)."""
    x, y, z = (accel[..., i] for i in range(3))
    return np.stack([np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))], axis=-1)


def attitude_from_vectors(accel: Array, mag: Array | None = None) -> Array:
    """Attitude (..., 4) from readings at rest: up from the accelerometer, north from the magnetometer.

    Parameters
    ----------
    accel : (..., 3) specific force, any unit; points up at rest
    mag : (..., 3) field, any unit; without it the body's x axis points east (yaw 0)

    Notes
    -----
    The triad method of Black 1964 with the accelerometer as the trusted vector.
    """
    roll, pitch = np.moveaxis(tilt(accel), -1, 0)
    yaw = np.zeros_like(roll)
    if mag is not None:
        mx, my, mz = (mag[..., i] for i in range(3))
        sideways = my * np.sin(roll) + mz * np.cos(roll)
        ahead, left = mx * np.cos(pitch) + sideways * np.sin(pitch), my * np.cos(roll) - mz * np.sin(roll)
        # yaw turns the levelled field (ahead, left) to north, which is +y
        yaw = np.arctan2(ahead, left)
    return quaternion_normalize(attitude_from_angles(np.stack([roll, pitch, yaw], axis=-1)))


def euler_rates(angles: Array) -> Array:
    """Matrices (..., 3, 3) that turn body rates into rates of roll, pitch and yaw.

    Notes
    -----
    Singular at a pitch of 90°, where the cosine is kept from zero.
    """
    roll, pitch = angles[..., 0], angles[..., 1]
    cosine = np.cos(pitch)
    cosine = np.where(np.abs(cosine) < LEVEL, np.where(cosine < 0, -LEVEL, LEVEL), cosine)
    sr, cr, tangent = np.sin(roll), np.cos(roll), np.sin(pitch) / cosine
    one, zero = np.ones_like(roll), np.zeros_like(roll)
    rows = [[one, sr * tangent, cr * tangent], [zero, cr, -sr], [zero, sr / cosine, cr / cosine]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def body_rates(angles: Array) -> Array:
    """Matrices (..., 3, 3) that turn rates of roll, pitch and yaw into rates about the body's axes."""
    roll, pitch = angles[..., 0], angles[..., 1]
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    one, zero = np.ones_like(roll), np.zeros_like(roll)
    rows = [[one, zero, -sp], [zero, cr, sr * cp], [zero, -sr, cr * cp]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
