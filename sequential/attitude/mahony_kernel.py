"""Compiled: one step of Mahony's filter, and the loop over a recording.

Settings p: 0 k_P, 1 k_P of the heading, 2 k_I, 3 limit of the bias (rad/s), 4 k_P at the start, 5 duration of
the quick start (s), 6 third-order coefficient of a turn, 7 whether the magnetometer turns about the vertical
only, 8 limit of the accelerometer's error (sine), 9 gate of the heading error (cosine), 10 its timeout (s),
11 and 12 what a gyro (rad/s) and an accelerometer (m/s²) at rest depart by, 13 how long rest lasts before it
counts (s), 14 time constant of the bias at rest (s), 15 of the lasting error (s).

State s: 0-3 quaternion, 4-6 bias, 7 time since the start, 8 time since the last field, 9 for how long the
field has been out of its gate, 10-12 and 13-15 gyro and accelerometer low-passed, 16 time at rest,
17 whether the heading is known, 18-19 the lasting error, east and north.
"""

from __future__ import annotations

import math

import numpy as np
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
    turn,
    up_of,
    usable,
    w1,
    w2,
)

__all__ = ["STATE", "run_mahony", "start_mahony", "step_mahony"]

STATE = 20
PAUSE = 1.0  # s: nothing is integrated over a longer one
OLDEST = 0.2  # s that one reading of the field stands for at most
SMOOTH = 0.5  # s, time constant of what rest is judged by


@njit(types.void(w1, f1, f1), **compiled)
def start_mahony(s, w, a):
    """Level by the accelerometer, yaw 0, no bias."""
    s[:] = 0.0
    level(s, a[0], a[1], a[2])
    for i in range(3):
        s[10 + i] = w[i] if math.isfinite(w[i]) else 0.0
        s[13 + i] = a[i] if math.isfinite(a[i]) else 0.0


@njit(types.void(w1, f1, f1, f0, f1), **compiled)
def rest(s, w, a, dt, p):
    """Low-pass both, count the time at rest, and draw the bias to the low-passed gyro."""
    keep = dt / (SMOOTH + dt)
    shaken = pushed = 0.0
    for i in range(3):
        s[10 + i] += keep * (w[i] - s[10 + i])
        s[13 + i] += keep * (a[i] - s[13 + i])
        shaken = max(shaken, abs(w[i] - s[10 + i]))
        if abs(s[10 + i]) > p[3]:
            shaken = np.inf  # too quick to be a bias
        pushed = max(pushed, abs(a[i] - s[13 + i]))
    s[16] = s[16] + dt if shaken < p[11] and pushed < p[12] else 0.0
    if s[16] > p[13]:
        for i in range(3):
            s[4 + i] += dt / (p[14] + dt) * (s[10 + i] - s[4 + i])


@njit(f0(w1, f0, f0, f0, f0, f1), **compiled)
def limit_of(s, ex, ey, ez, dt, p):
    """What the accelerometer's error is shortened to: a tilt error lasts in the world, a push does not."""
    w, x, y, z = s[0], s[1], s[2], s[3]
    east = (1.0 - 2.0 * (y * y + z * z)) * ex + 2.0 * (x * y - w * z) * ey + 2.0 * (x * z + w * y) * ez
    north = 2.0 * (x * y + w * z) * ex + (1.0 - 2.0 * (x * x + z * z)) * ey + 2.0 * (y * z - w * x) * ez
    keep = dt / (p[15] + dt)
    s[18] += keep * (east - s[18])
    s[19] += keep * (north - s[19])
    return p[8] + math.sqrt(s[18] * s[18] + s[19] * s[19])


@njit(types.UniTuple(f0, 3)(w1, f1, f0, f1), **compiled)
def of_field(s, m, dt, p):
    """What the magnetometer adds to the error times time, in the body frame."""
    s[8] += dt
    if not usable(m[0], m[1], m[2]):
        return 0.0, 0.0, 0.0
    east, north = north_of(s, m[0], m[1], m[2])
    if east == 0.0 and north == 0.0:
        return 0.0, 0.0, 0.0
    stands_for = min(s[8], OLDEST)
    s[8] = 0.0
    if s[17] == 0.0:
        set_north(s, east, north)
        s[17] = 1.0
        return 0.0, 0.0, 0.0
    vx, vy, vz = up_of(s)
    if north < p[9]:
        s[9] += stands_for
        if s[9] <= p[10]:
            return 0.0, 0.0, 0.0
    else:
        s[9] = 0.0
    if p[7] != 0.0:
        e = east if north > 0.0 else math.copysign(1.0, east)
        return e * vx * stands_for, e * vy * stands_for, e * vz * stands_for
    w, x, y, z = s[0], s[1], s[2], s[3]
    scale = 1.0 / math.sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])
    mx, my, mz = m[0] * scale, m[1] * scale, m[2] * scale
    along = vx * mx + vy * my + vz * mz  # component of the field along the vertical
    flat = math.sqrt(max(1.0 - along * along, 0.0))
    nx = flat * 2.0 * (x * y + w * z) + along * vx
    ny = flat * (1.0 - 2.0 * (x * x + z * z)) + along * vy
    nz = flat * 2.0 * (y * z - w * x) + along * vz
    return (
        (my * nz - mz * ny) * stands_for,
        (mz * nx - mx * nz) * stands_for,
        (mx * ny - my * nx) * stands_for,
    )


@njit(types.void(w1, f1, f1, f1, f0, f1), **compiled)
def step_mahony(s, w, a, m, dt, p):
    """Advance the state by one sample that comes dt after the one before."""
    if not abs(w[0]) + abs(w[1]) + abs(w[2]) < math.inf:
        return
    if not 0.0 <= dt <= PAUSE:
        s[7], s[16], dt = 0.0, 0.0, 0.0
    s[7] += dt
    if usable(a[0], a[1], a[2]):
        rest(s, w, a, dt, p)
    else:
        s[16] = 0.0
    ex = ey = ez = 0.0
    if usable(a[0], a[1], a[2]):
        vx, vy, vz = up_of(s)
        scale = 1.0 / math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
        ex = scale * (a[1] * vz - a[2] * vy)
        ey = scale * (a[2] * vx - a[0] * vz)
        ez = scale * (a[0] * vy - a[1] * vx)
        size = math.sqrt(ex * ex + ey * ey + ez * ez)
        limit = limit_of(s, ex, ey, ez, dt, p)
        if size > limit and s[7] >= p[5]:
            ex, ey, ez = ex * limit / size, ey * limit / size, ez * limit / size
        ex, ey, ez = ex * dt, ey * dt, ez * dt
    mx, my, mz = of_field(s, m, dt, p)
    boost = 0.0
    if s[7] < p[5]:
        boost = (p[4] - p[0]) * (1.0 - s[7] / p[5])
    elif s[16] <= p[13]:
        s[4] -= p[2] * (ex + mx)
        s[5] -= p[2] * (ey + my)
        s[6] -= p[2] * (ez + mz)
    for i in range(4, 7):
        s[i] = min(max(s[i], -p[3]), p[3])
    kp, kh = p[0] + boost, p[1] + boost
    turn(
        s,
        (w[0] - s[4]) * dt + kp * ex + kh * mx,
        (w[1] - s[5]) * dt + kp * ey + kh * my,
        (w[2] - s[6]) * dt + kp * ez + kh * mz,
        p[6],
    )


@njit(types.void(i1, f2, f2, f2, f1, w1, w2, w2, w2), **compiled)
def run_mahony(t, gyro, accel, mag, p, s, q, bias, seen):
    """Fill q (N, 4), bias (N, 3), and times at rest and out of the gate (N, 2); `mag` may have one row."""
    start_mahony(s, gyro[0], accel[0])
    last = len(mag) - 1
    for k in range(len(t)):
        dt = (t[k] - t[k - 1]) * 1e-9 if k > 0 else 0.0
        step_mahony(s, gyro[k], accel[k], mag[min(k, last)], dt, p)
        sign = math.copysign(1.0, s[0])
        for i in range(4):
            q[k, i] = sign * s[i]
        for i in range(3):
            bias[k, i] = s[4 + i]
        seen[k, 0], seen[k, 1] = s[16], s[9]
