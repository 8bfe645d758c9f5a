"""Compiled: one step of Madgwick's filter, and the loop over a recording.

Settings p: 0 β (rad/s), 1 β at the start, 2 duration of the quick start (s), 3 third-order coefficient of a
turn, 4 largest step as a share of the gradient.  State s: 0-3 quaternion, 4 time since the start, 5 whether
the heading is known.
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
    turn,
    usable,
    w1,
    w2,
)

__all__ = ["STATE", "run_madgwick", "start_madgwick", "step_madgwick"]

STATE = 6
PAUSE = 1.0  # s: nothing is integrated over a longer one
HALF = math.sqrt(0.5)
four, five = types.UniTuple(f0, 4), types.UniTuple(f0, 5)


@njit(types.void(w1, f1), **compiled)
def start_madgwick(s, a):
    """Level by the accelerometer, yaw 0."""
    s[:] = 0.0
    level(s, a[0], a[1], a[2])


@njit(four(f0, f0, f0, f0, f1), **compiled)
def gradient_of_gravity(w, x, y, z, a):
    """Jᵀ f of Madgwick's equations 25 and 26: the vertical, expected minus measured."""
    scale = 1.0 / math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    fx = 2.0 * (x * z - w * y) - a[0] * scale
    fy = 2.0 * (w * x + y * z) - a[1] * scale
    fz = 1.0 - 2.0 * (x * x + y * y) - a[2] * scale
    return (
        -2.0 * y * fx + 2.0 * x * fy,
        2.0 * z * fx + 2.0 * w * fy - 4.0 * x * fz,
        -2.0 * w * fx + 2.0 * z * fy - 4.0 * y * fz,
        2.0 * x * fx + 2.0 * y * fy,
    )


@njit(four(f0, f0, f0, f0, f1), **compiled)
def gradient_of_field(w, x, y, z, m):
    """Jᵀ f of Madgwick's equations 29 and 30, in a world whose x axis points north.

    The reference (b, 0, c) is the measured field turned into the world, its horizontal part laid on x
    (equations 45 and 46), so that a disturbance moves the heading alone.
    """
    scale = 1.0 / math.sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])
    mx, my, mz = m[0] * scale, m[1] * scale, m[2] * scale
    hx = (1.0 - 2.0 * (y * y + z * z)) * mx + 2.0 * (x * y - w * z) * my + 2.0 * (x * z + w * y) * mz
    hy = 2.0 * (x * y + w * z) * mx + (1.0 - 2.0 * (x * x + z * z)) * my + 2.0 * (y * z - w * x) * mz
    c = 2.0 * (x * z - w * y) * mx + 2.0 * (w * x + y * z) * my + (1.0 - 2.0 * (x * x + y * y)) * mz
    b = math.sqrt(hx * hx + hy * hy)
    fx = b * (1.0 - 2.0 * (y * y + z * z)) + 2.0 * c * (x * z - w * y) - mx
    fy = 2.0 * b * (x * y - w * z) + 2.0 * c * (w * x + y * z) - my
    fz = 2.0 * b * (w * y + x * z) + c * (1.0 - 2.0 * (x * x + y * y)) - mz
    return (
        2.0 * (-c * y * fx + (c * x - b * z) * fy + b * y * fz),
        2.0 * (c * z * fx + (b * y + c * w) * fy + (b * z - 2.0 * c * x) * fz),
        2.0 * (-(2.0 * b * y + c * w) * fx + (b * x + c * z) * fy + (b * w - 2.0 * c * y) * fz),
        2.0 * ((c * x - 2.0 * b * z) * fx + (c * y - b * w) * fy + b * x * fz),
    )


@njit(five(w1, f1, f1, types.boolean), **compiled)
def descent(s, a, m, magnetic):
    """Unit gradient of both errors, turned from a world with x north into ours with y north; its length."""
    w, x, y, z = HALF * (s[0] + s[3]), HALF * (s[1] + s[2]), HALF * (s[2] - s[1]), HALF * (s[3] - s[0])
    g0, g1, g2, g3 = gradient_of_gravity(w, x, y, z, a)
    if magnetic:
        h0, h1, h2, h3 = gradient_of_field(w, x, y, z, m)
        g0, g1, g2, g3 = g0 + h0, g1 + h1, g2 + h2, g3 + h3
    length = math.sqrt(g0 * g0 + g1 * g1 + g2 * g2 + g3 * g3)
    if length == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    scale = HALF / length
    return scale * (g0 - g3), scale * (g1 - g2), scale * (g2 + g1), scale * (g3 + g0), length


@njit(types.void(w1, f1, f1, f1, f0, f1), **compiled)
def step_madgwick(s, w, a, m, dt, p):
    """Advance the state by one sample that comes dt after the one before."""
    if not abs(w[0]) + abs(w[1]) + abs(w[2]) < math.inf:
        return
    if not 0.0 <= dt <= PAUSE:
        s[4], dt = 0.0, 0.0
    s[4] += dt
    magnetic = usable(m[0], m[1], m[2])
    if magnetic:
        east, north = north_of(s, m[0], m[1], m[2])
        magnetic = east != 0.0 or north != 0.0
        if magnetic and s[5] == 0.0:
            set_north(s, east, north)
            s[5] = 1.0
    g0 = g1 = g2 = g3 = length = 0.0
    if usable(a[0], a[1], a[2]):
        g0, g1, g2, g3, length = descent(s, a, m, magnetic)
    beta = p[0] if s[4] >= p[2] else p[0] + (p[1] - p[0]) * (1.0 - s[4] / p[2])
    x, y, z = w[0] * dt, w[1] * dt, w[2] * dt
    turn(s, x, y, z, p[3])
    # back to the length before the turn was normalised, so that both parts of the step add up
    half = 0.5 * (1.0 + p[3] * (x * x + y * y + z * z))
    long = math.sqrt(1.0 + half * half * (x * x + y * y + z * z))
    down = min(beta * dt, p[4] * length)
    a0, a1 = long * s[0] - down * g0, long * s[1] - down * g1
    a2, a3 = long * s[2] - down * g2, long * s[3] - down * g3
    scale = 1.0 / math.sqrt(a0 * a0 + a1 * a1 + a2 * a2 + a3 * a3)
    s[0], s[1], s[2], s[3] = a0 * scale, a1 * scale, a2 * scale, a3 * scale


@njit(types.void(i1, f2, f2, f2, f1, w1, w2), **compiled)
def run_madgwick(t, gyro, accel, mag, p, s, q):
    """Fill q (N, 4), w >= 0; s is the state, `mag` may have one row, of NaN."""
    start_madgwick(s, accel[0])
    last = len(mag) - 1
    for k in range(len(t)):
        dt = (t[k] - t[k - 1]) * 1e-9 if k > 0 else 0.0
        step_madgwick(s, gyro[k], accel[k], mag[min(k, last)], dt, p)
        sign = math.copysign(1.0, s[0])
        for i in range(4):
            q[k, i] = sign * s[i]
