"""Compiled: the model of the attitude smoother, one node at a time; the graph linearises with the same.

State (23,): rotation error in the world (3), gyro bias (3), velocity (3), magnetic disturbance towards
east (1); and constants: delay of the magnetometer (1), accelerometer bias (3), gyro gain and misalignment
(9, row by row).  The rotation itself is kept beside it.
"""

from __future__ import annotations

import math

from numba import njit, types

from sequential.attitude.smoother_nodes_kernel import (
    ANGLE2,
    FIELD,
    GAIN,
    LEVER,
    LOST,
    PUSH,
    SWEEP,
    TIME,
    TURN,
    compiled,
    f0,
    f1,
    f2,
    w1,
    w2,
)

__all__ = ["difference", "heading_row", "retract", "step", "step_noise"]

ROTATION, BIAS, VELOCITY, EAST, DELAY, PULL, MATRIX, SIZE = 0, 3, 6, 9, 10, 11, 14, 23
# The vertical velocity is held this much more loosely: it says nothing of the tilt, and a wrong scale of the
# accelerometer ends there.
UPRIGHT = 30.0
# settings
(GYRO, SCALE, WALK, PUSHED, SPREAD, STILL_RATE, STILL_SPEED, MAG, DISTURBED, MEMORY, GRAVITY, GATE,
 UNKNOWN_RATE, UNKNOWN_PUSH, RESTING, REFERENCE) = range(16)  # fmt: skip


@njit(types.void(w2, f0, f0, f0), **compiled)
def retract(r, x, y, z):
    """R ← exp((x, y, z)×) R: a turn in the world."""
    square = x * x + y * y + z * z
    if square > 1e-8:
        angle = math.sqrt(square)
        s, c = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    else:
        s, c = 1.0 - square / 6.0, 0.5 - square / 24.0
    for j in range(3):
        a, b, d = r[0, j], r[1, j], r[2, j]
        k0, k1, k2 = y * d - z * b, z * a - x * d, x * b - y * a
        r[0, j] = a + s * k0 + c * (y * k2 - z * k1)
        r[1, j] = b + s * k1 + c * (z * k0 - x * k2)
        r[2, j] = d + s * k2 + c * (x * k1 - y * k0)


@njit(types.void(f2, f2, w1), **compiled)
def difference(a, b, out):
    """out ← log(A Bᵀ): the turn in the world that leads from B to A; both close to each other or not."""
    m00 = a[0, 0] * b[0, 0] + a[0, 1] * b[0, 1] + a[0, 2] * b[0, 2]
    m11 = a[1, 0] * b[1, 0] + a[1, 1] * b[1, 1] + a[1, 2] * b[1, 2]
    m22 = a[2, 0] * b[2, 0] + a[2, 1] * b[2, 1] + a[2, 2] * b[2, 2]
    m21 = a[2, 0] * b[1, 0] + a[2, 1] * b[1, 1] + a[2, 2] * b[1, 2]
    m12 = a[1, 0] * b[2, 0] + a[1, 1] * b[2, 1] + a[1, 2] * b[2, 2]
    m02 = a[0, 0] * b[2, 0] + a[0, 1] * b[2, 1] + a[0, 2] * b[2, 2]
    m20 = a[2, 0] * b[0, 0] + a[2, 1] * b[0, 1] + a[2, 2] * b[0, 2]
    m10 = a[1, 0] * b[0, 0] + a[1, 1] * b[0, 1] + a[1, 2] * b[0, 2]
    m01 = a[0, 0] * b[1, 0] + a[0, 1] * b[1, 1] + a[0, 2] * b[1, 2]
    x, y, z = 0.5 * (m21 - m12), 0.5 * (m02 - m20), 0.5 * (m10 - m01)
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 1.0
    if sine > 1e-7:
        scale = math.atan2(sine, 0.5 * (m00 + m11 + m22 - 1.0)) / sine
    out[0], out[1], out[2] = scale * x, scale * y, scale * z


@njit(types.void(f1, types.boolean, f2, f1, f1, w2, w1, w2, w2), **compiled)
def step(n, rest, r, x, p, r_next, x_next, by_gyro, by_push):
    """Move (R, x) over node n, and write how: ∂θ'/∂(bias, matrix) (3, 12) and ∂v'/∂(θ, accel bias) (3, 6)."""
    by_gyro[:, :] = 0.0
    for i in range(SIZE):
        x_next[i] = x[i]
    for i in range(3):
        for j in range(3):
            lever = 0.0
            for m in range(3):
                lever += r[i, m] * n[LEVER + 3 * m + j]
            by_push[i, 3 + j] = -lever
            if not rest:
                by_gyro[i, j] = -lever
        if not rest:
            for c in range(9):
                by_gyro[i, 3 + c] = -(
                    r[i, 0] * n[GAIN + 3 * c] + r[i, 1] * n[GAIN + 3 * c + 1] + r[i, 2] * n[GAIN + 3 * c + 2]
                )
    if rest:
        for i in range(3):
            for j in range(3):
                r_next[i, j] = r[i, j]
    else:
        for i in range(3):
            for j in range(3):
                r_next[i, j] = r[i, 0] * n[TURN + j] + r[i, 1] * n[TURN + 3 + j] + r[i, 2] * n[TURN + 6 + j]
        a, b, c = 0.0, 0.0, 0.0
        for j in range(3):
            off = x[BIAS + j] - p[REFERENCE + j]
            a, b, c = a + by_gyro[0, j] * off, b + by_gyro[1, j] * off, c + by_gyro[2, j] * off
        for j in range(9):
            off = x[MATRIX + j]
            a += by_gyro[0, 3 + j] * off
            b += by_gyro[1, 3 + j] * off
            c += by_gyro[2, 3 + j] * off
        retract(r_next, a, b, c)
    px = r[0, 0] * n[PUSH] + r[0, 1] * n[PUSH + 1] + r[0, 2] * n[PUSH + 2]
    py = r[1, 0] * n[PUSH] + r[1, 1] * n[PUSH + 1] + r[1, 2] * n[PUSH + 2]
    pz = r[2, 0] * n[PUSH] + r[2, 1] * n[PUSH + 1] + r[2, 2] * n[PUSH + 2]
    for j in range(3):
        off = x[PULL + j]
        px, py, pz = px + by_push[0, 3 + j] * off, py + by_push[1, 3 + j] * off, pz + by_push[2, 3 + j] * off
    by_push[0, 0], by_push[0, 1], by_push[0, 2] = 0.0, pz, -py
    by_push[1, 0], by_push[1, 1], by_push[1, 2] = -pz, 0.0, px
    by_push[2, 0], by_push[2, 1], by_push[2, 2] = py, -px, 0.0
    x_next[VELOCITY] += px
    x_next[VELOCITY + 1] += py
    x_next[VELOCITY + 2] += pz - p[GRAVITY] * (n[TIME] - n[LOST])
    x_next[EAST] = math.exp(-n[TIME] / p[MEMORY]) * x[EAST]


@njit(types.UniTuple(f0, 4)(f1, types.boolean, f1), **compiled)
def step_noise(n, rest, p):
    """Variances that node n adds to rotation, bias, velocity (an axis each) and disturbance."""
    t = n[TIME]
    turn = p[RESTING] ** 2 * t if rest else p[GYRO] ** 2 * t + p[SCALE] ** 2 * n[ANGLE2]
    turn += (p[UNKNOWN_RATE] * n[LOST]) ** 2
    push = p[PUSHED] ** 2 * t + (p[UNKNOWN_PUSH] * n[LOST]) ** 2
    return turn, p[WALK] ** 2 * t, push, p[DISTURBED] ** 2 * (1.0 - math.exp(-2.0 * t / p[MEMORY]))


@njit(f0(f1, f2, f1, w1), **compiled)
def heading_row(n, r, x, row):
    """Innovation of the field's heading, and its row (θ 3, disturbance, delay).

    The reading is the angle of the horizontal field from north times its length: the component towards east
    while the angle is small, and still a way back where the heading is wrong by more than a right angle.
    """
    a = n[FIELD] - x[DELAY] * n[SWEEP]
    b = n[FIELD + 1] - x[DELAY] * n[SWEEP + 1]
    c = n[FIELD + 2] - x[DELAY] * n[SWEEP + 2]
    east = r[0, 0] * a + r[0, 1] * b + r[0, 2] * c
    north = r[1, 0] * a + r[1, 1] * b + r[1, 2] * c
    up = r[2, 0] * a + r[2, 1] * b + r[2, 2] * c
    length = math.sqrt(east * east + north * north) + 1e-9
    c, s = north / length, east / length
    row[0], row[1], row[2], row[3] = s * up, c * up, -length, -1.0
    row[4] = 0.0
    for i in range(3):
        row[4] -= (c * r[0, i] - s * r[1, i]) * n[SWEEP + i]
    return x[EAST] - length * math.atan2(east, north)
