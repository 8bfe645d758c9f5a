"""Compiled: what the attitude filters do to the quaternion at the head of their state."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

import sequential.kernels  # noqa: F401 - compiled code is kept where a digest of all of it says

__all__ = [
    "f0",
    "f1",
    "f2",
    "i1",
    "level",
    "north_of",
    "set_north",
    "turn",
    "up_of",
    "usable",
    "w1",
    "w2",
    "w3",
]

f0 = types.float64
f1 = types.Array(types.float64, 1, "C", readonly=True)
f2 = types.Array(types.float64, 2, "C", readonly=True)
i1 = types.Array(types.int64, 1, "C", readonly=True)
w1, w2, w3 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
three, two = types.UniTuple(types.float64, 3), types.UniTuple(types.float64, 2)
# nothing below allocates, and without the counting of references a step takes a fifth of the time
compiled = {"cache": True, "error_model": "numpy", "nogil": True, "_nrt": False}

STEEP = 1e-3  # sine of the angle between field and vertical below which it tells no heading


@njit(types.boolean(f0, f0, f0), **compiled)
def usable(x, y, z):
    """Whether a vector is finite and not zero."""
    squared = x * x + y * y + z * z
    return squared > 0.0 and squared < np.inf


@njit(three(w1), **compiled)
def up_of(s):
    """The vertical in the body frame: third row of the rotation matrix."""
    w, x, y, z = s[0], s[1], s[2], s[3]
    return 2.0 * (x * z - w * y), 2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)


@njit(two(w1, f0, f0, f0), **compiled)
def north_of(s, mx, my, mz):
    """East and north component of a body vector, of unit length together; (0, 0) where it is vertical."""
    w, x, y, z = s[0], s[1], s[2], s[3]
    east = (1.0 - 2.0 * (y * y + z * z)) * mx + 2.0 * (x * y - w * z) * my + 2.0 * (x * z + w * y) * mz
    north = 2.0 * (x * y + w * z) * mx + (1.0 - 2.0 * (x * x + z * z)) * my + 2.0 * (y * z - w * x) * mz
    squared = east * east + north * north
    if squared <= STEEP * STEEP * (mx * mx + my * my + mz * mz):
        return 0.0, 0.0
    scale = 1.0 / math.sqrt(squared)
    return east * scale, north * scale


@njit(types.void(w1, f0, f0), **compiled)
def set_north(s, east, north):
    """Turn about the vertical, so that the horizontal unit vector (east, north) points north."""
    c, d = 1.0 + north, east  # half of the angle, by the sum of both directions
    length = math.sqrt(c * c + d * d)
    if length < 1e-9:
        c, d, length = 0.0, 1.0, 1.0
    c, d = c / length, d / length
    w, x, y, z = s[0], s[1], s[2], s[3]
    s[0], s[1], s[2], s[3] = c * w - d * z, c * x - d * y, c * y + d * x, c * z + d * w


@njit(types.void(w1, f0, f0, f0), **compiled)
def level(s, ax, ay, az):
    """The attitude of yaw 0 in which the specific force points up; the identity for a bad one."""
    s[0], s[1], s[2], s[3] = 1.0, 0.0, 0.0, 0.0
    if usable(ax, ay, az):
        roll, pitch = 0.5 * math.atan2(ay, az), 0.5 * math.atan2(-ax, math.sqrt(ay * ay + az * az))
        cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
        s[0], s[1], s[2], s[3] = cr * cp, sr * cp, cr * sp, -sr * sp


@njit(types.void(w1, f0, f0, f0, f0), **compiled)
def turn(s, rx, ry, rz, third):
    """Rotate by a small vector of the body frame: q ⊗ (1, ½ r (1 + third |r|²)), normalised.

    With `third` = 1/12 the angle is right to its fifth power; with 0 it is Euler's step, |r|³/12 short.
    """
    half = 0.5 * (1.0 + third * (rx * rx + ry * ry + rz * rz))
    x, y, z = half * rx, half * ry, half * rz
    w, i, j, k = s[0], s[1], s[2], s[3]
    a = w - i * x - j * y - k * z
    b = i + w * x + j * z - k * y
    c = j + w * y + k * x - i * z
    d = k + w * z + i * y - j * x
    scale = 1.0 / math.sqrt(a * a + b * b + c * c + d * d)
    s[0], s[1], s[2], s[3] = a * scale, b * scale, c * scale, d * scale
