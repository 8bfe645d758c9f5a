"""Compiled: one step of the complementary filter on rotations, and the loop over a recording.

Settings p: 0 time constant of the tilt, 1 of the heading (s).  State s: 0-3 quaternion, 4 time since the last
field (s), 5 whether the heading is known.
"""

from __future__ import annotations

import math

from numba import njit, types

from sequential.attitude.turning_kernel import (
    compiled,
    f0,
    f1,
    f2,
    i1,
    level,
    north_of,
    set_north,
    up_of,
    usable,
    w1,
    w2,
)

__all__ = ["STATE", "run_complementary", "start_complementary", "step_complementary"]

STATE = 6
PAUSE = 1.0  # s: nothing is integrated over a longer one


@njit(types.void(w1, f1), **compiled)
def start_complementary(s, a):
    """Level by the accelerometer, yaw 0."""
    s[:] = 0.0
    level(s, a[0], a[1], a[2])


@njit(types.void(w1, f0, f0, f0), **compiled)
def turn_exactly(s, rx, ry, rz):
    """q ⊗ exp(r) for a rotation vector of the body frame."""
    angle = math.sqrt(rx * rx + ry * ry + rz * rz)
    c, scale = math.cos(0.5 * angle), (math.sin(0.5 * angle) / angle if angle > 0.0 else 0.5)
    x, y, z = scale * rx, scale * ry, scale * rz
    w, i, j, k = s[0], s[1], s[2], s[3]
    a, b = w * c - i * x - j * y - k * z, i * c + w * x + j * z - k * y
    d, e = j * c + w * y + k * x - i * z, k * c + w * z + i * y - j * x
    length = math.sqrt(a * a + b * b + d * d + e * e)
    s[0], s[1], s[2], s[3] = a / length, b / length, d / length, e / length


@njit(types.void(w1, f1, f0), **compiled)
def lean(s, a, share):
    """Close a share of the angle between the vertical and the specific force."""
    vx, vy, vz = up_of(s)
    cx, cy, cz = a[1] * vz - a[2] * vy, a[2] * vx - a[0] * vz, a[0] * vy - a[1] * vx
    across = math.sqrt(cx * cx + cy * cy + cz * cz)
    if across > 0.0:
        scale = share * math.atan2(across, a[0] * vx + a[1] * vy + a[2] * vz) / across
        turn_exactly(s, cx * scale, cy * scale, cz * scale)


@njit(types.void(w1, f1, f1, f1, f0, f1), **compiled)
def step_complementary(s, w, a, m, dt, p):
    """Advance the state by one sample that comes dt after the one before."""
    if not abs(w[0]) + abs(w[1]) + abs(w[2]) < math.inf:
        return
    if not 0.0 <= dt <= PAUSE:
        dt = 0.0
    turn_exactly(s, w[0] * dt, w[1] * dt, w[2] * dt)
    if usable(a[0], a[1], a[2]):
        lean(s, a, -math.expm1(-dt / p[0]))
    s[4] += dt
    if not usable(m[0], m[1], m[2]):
        return
    east, north = north_of(s, m[0], m[1], m[2])
    if east == 0.0 and north == 0.0:
        return
    share = 1.0 if s[5] == 0.0 else -math.expm1(-s[4] / p[1])
    s[4], s[5] = 0.0, 1.0
    angle = share * math.atan2(east, north)
    set_north(s, math.sin(angle), math.cos(angle))


@njit(types.void(i1, f2, f2, f2, f1, w1, w2), **compiled)
def run_complementary(t, gyro, accel, mag, p, s, q):
    """Fill q (N, 4), w >= 0; s is the state, `mag` may have one row, of NaN."""
    start_complementary(s, accel[0])
    last = len(mag) - 1
    for k in range(len(t)):
        dt = (t[k] - t[k - 1]) * 1e-9 if k > 0 else 0.0
        step_complementary(s, gyro[k], accel[k], mag[min(k, last)], dt, p)
        sign = math.copysign(1.0, s[0])
        for i in range(4):
            q[k, i] = sign * s[i]
