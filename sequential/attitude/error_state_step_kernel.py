"""Compiled: the error-state attitude filter, a sample at a time.

Strapdown at the rate of the samples; inclination, bias and heading are corrected once a block.
"""

from __future__ import annotations

import math

from numba import njit, types

from sequential.attitude import error_state_layout as at
from sequential.attitude.error_state_heading_kernel import correct_heading, drift_heading, start_heading
from sequential.attitude.error_state_tilt_kernel import (
    correct_tilt,
    inject_tilt,
    propagate_tilt,
    rest_bias,
    widen_tilt,
)
from sequential.attitude.turning_kernel import compiled, f0, f1, level, turn, usable, w1

__all__ = ["start_error_state", "step_error_state"]

N, P = at.ERRORS, at.P
SUMS = at.ELAPSED - at.FORCE
THIRD = 1.0 / 12.0
SETTLED = 1.0  # s over which the mean force shows roughly where up is


@njit(types.void(w1), **compiled)
def open_block(s):
    """Begin the sums again."""
    for i in range(SUMS + 1):
        s[at.FORCE + i] = 0.0
    for i in range(4):
        s[at.START + i] = s[at.Q + i]


@njit(types.void(w1, f1, f1), **compiled)
def start_error_state(s, a, p):
    """Level by the first specific force; variances as set."""
    for i in range(at.STATE):
        s[i] = 0.0
    level(s, a[0], a[1], a[2])
    s[at.HALF] = 1.0
    s[at.STARTED] = 1.0 if usable(a[0], a[1], a[2]) else 0.0
    s[at.LEVEL] = p[at.LEVEL_PRIOR]
    for i in range(3):
        s[P + (N + 1) * (3 + i)] = p[at.BIAS_PRIOR]
    widen_tilt(s, p, p[at.TILT_PRIOR], 0.0)
    open_block(s)


@njit(types.void(w1, f1), **compiled)
def watch_rest(s, p):
    """At rest: mean rate and force of blocks stay near their low-passed values for `REST_TIME`."""
    share = min(1.0, s[at.ELAPSED] / p[at.REST_FILTER])
    rate, force, mean = 0.0, 0.0, 0.0
    for i in range(3):
        w, f = s[at.RATE + i] / s[at.SAMPLES], s[at.SPECIFIC + i] / max(1.0, s[at.FORCES])
        if s[at.SEEN] == 0.0:
            s[at.SLOW_GYRO + i], s[at.SLOW_ACCEL + i] = w, f
        rate += (w - s[at.SLOW_GYRO + i]) ** 2
        force += (f - s[at.SLOW_ACCEL + i]) ** 2
        s[at.SLOW_GYRO + i] += share * (w - s[at.SLOW_GYRO + i])
        s[at.SLOW_ACCEL + i] += share * (f - s[at.SLOW_ACCEL + i])
        mean = max(mean, abs(s[at.SLOW_GYRO + i]))
    s[at.SEEN] = 1.0
    moved = rate > p[at.REST_GYRO] or force > p[at.REST_ACCEL] or mean > p[at.REST_RATE]
    s[at.STILL] = 0.0 if moved else s[at.STILL] + s[at.ELAPSED]
    s[at.RESTING] = 1.0 if s[at.STILL] >= p[at.REST_TIME] else 0.0


@njit(types.void(w1, f1, f0), **compiled)
def use_field(s, p, dt):
    """Correct the heading by the mean field of a block, or begin with it where the heading is unknown."""
    count = 1.0 / s[at.FIELDS]
    x, y, z = s[at.FIELD] * count, s[at.FIELD + 1] * count, s[at.FIELD + 2] * count
    if not usable(x, y, z):
        return
    tilt = s[P] + s[P + N + 1]
    if s[at.NORTH_KNOWN] == 0.0 or s[at.D] > 1.0 or tilt > p[at.TILT_KNOWN]:
        start_heading(s, p, x, y, z, tilt)
        s[at.HALF], s[at.HALF + 1] = math.cos(0.5 * s[at.DELTA]), math.sin(0.5 * s[at.DELTA])
        return
    a, b, c, d = s[at.START], -s[at.START + 1], -s[at.START + 2], -s[at.START + 3]
    w, i, j, k = s[0], s[1], s[2], s[3]
    sign = 2.0 / dt if w * a - i * b - j * c - k * d >= 0.0 else -2.0 / dt
    wx = sign * (w * b + i * a + j * d - k * c)
    wy = sign * (w * c - i * d + j * a + k * b)
    wz = sign * (w * d + i * c - j * b + k * a)
    correct_heading(s, p, x, y, z, wx, wy, wz, tilt)


@njit(types.void(w1, f0, f0, f0), **compiled)
def lean_upright(s, x, y, z):
    """Turn by the shortest way such that a force in the frame of the gyro points up."""
    c = math.sqrt(x * x + y * y + z * z) + z
    scale = math.sqrt(c * c + x * x + y * y)
    if scale < 1e-9:
        x, y, c, scale = 0.0, 1.0, 0.0, 1.0
    c, x, y = c / scale, y / scale, -x / scale
    w, i, j, k = s[0], s[1], s[2], s[3]
    s[0], s[1], s[2], s[3] = (
        c * w - x * i - y * j,
        c * i + x * w + y * k,
        c * j + y * w - x * k,
        c * k + x * j - y * i,
    )


@njit(types.boolean(w1, f1, f0, f0), **compiled)
def overturned(s, p, dt, forces):
    """Whether the force of the last while points far from up: then level by it, and begin again."""
    if dt <= 0.0:  # two pauses in a row leave a block without duration
        return False
    s[at.AGE] += dt
    share = dt / min(s[at.AGE], SETTLED)
    total = 0.0
    for i in range(3):
        s[at.MEAN_FORCE + i] += share * (s[at.FORCE + i] / forces - s[at.MEAN_FORCE + i])
        total += s[at.MEAN_FORCE + i] ** 2
    x, y, z = s[at.MEAN_FORCE], s[at.MEAN_FORCE + 1], s[at.MEAN_FORCE + 2]
    length = math.sqrt(total)
    if s[at.AGE] < 0.5 * SETTLED or length < 0.5 * p[at.GRAVITY] or z > 0.5 * length:
        return False
    lean_upright(s, x, y, z)
    s[at.MEAN_FORCE], s[at.MEAN_FORCE + 1], s[at.MEAN_FORCE + 2] = 0.0, 0.0, length
    widen_tilt(s, p, p[at.TILT_PRIOR], 0.0)
    return True


@njit(types.void(w1, f1), **compiled)
def close_block(s, p):
    """Predict and correct with the sums of a block, and begin the next."""
    dt, inverse = s[at.ELAPSED], 1.0 / s[at.SAMPLES]
    squared = s[at.RATE_SQUARED] * inverse
    watch_rest(s, p)
    r = at.TURNED + 6
    bias_rate = 0.0
    for i in range(3):
        for j in range(3):
            bias_rate += s[r + i] * s[P + N * (3 + i) + 3 + j] * s[r + j] * inverse * inverse
    forces = max(1.0, s[at.FORCES])
    propagate_tilt(s, dt, s[at.FORCE + 2] / forces, inverse)
    across = dt * (p[at.GYRO_NOISE] + p[at.TILT_SCALE] * squared)
    about = dt * (p[at.GYRO_NOISE] + p[at.HEADING_SCALE] * squared)
    s[P] += across
    s[P + N + 1] += across
    s[P + 2 * (N + 1)] += about
    for i in range(3, 6):
        s[P + (N + 1) * i] += p[at.BIAS_WALK] * dt
    if s[at.FORCES] > 0.0 and not overturned(s, p, dt, forces):
        correct_tilt(s, p, dt, s[at.FORCE] / forces, s[at.FORCE + 1] / forces)
    elif s[at.FORCES] == 0.0:
        widen_tilt(s, p, 0.0, 0.0)
    if s[at.RESTING] > 0.0:
        rest_bias(s, p, dt, inverse)
    inject_tilt(s)
    if s[at.NORTH_KNOWN] > 0.0:
        drift_heading(s, p, dt, about + dt * p[at.BIAS_MEMORY] * bias_rate)
    if s[at.FIELDS] > 0.0:
        use_field(s, p, dt)
    s[at.HALF], s[at.HALF + 1] = math.cos(0.5 * s[at.DELTA]), math.sin(0.5 * s[at.DELTA])
    open_block(s)


@njit(types.void(w1, f1, f1, f1, f0), **compiled)
def gather(s, w, a, m, dt):
    """Turn by one sample and add its force and field, in the frame of the gyro, to the sums."""
    x, y, z = w[0] - s[at.BIAS], w[1] - s[at.BIAS + 1], w[2] - s[at.BIAS + 2]
    # half way between two readings: the rate of sampling does not shift the attitude in time
    h, b = 0.5 * dt, at.LAST_RATE
    u, v, t = s[b] - s[at.BIAS], s[b + 1] - s[at.BIAS + 1], s[b + 2] - s[at.BIAS + 2]
    turn(s, h * (x + u), h * (y + v), h * (z + t), THIRD)
    s[b], s[b + 1], s[b + 2] = w[0], w[1], w[2]
    s[at.RATE_SQUARED] += x * x + y * y + z * z
    q, i, j, k = s[0], s[1], s[2], s[3]
    r0, r1, r2 = 1.0 - 2.0 * (j * j + k * k), 2.0 * (i * j - q * k), 2.0 * (i * k + q * j)
    r3, r4, r5 = 2.0 * (i * j + q * k), 1.0 - 2.0 * (i * i + k * k), 2.0 * (j * k - q * i)
    r6, r7, r8 = 2.0 * (i * k - q * j), 2.0 * (j * k + q * i), 1.0 - 2.0 * (i * i + j * j)
    s[at.TURNED] += r0
    s[at.TURNED + 1] += r1
    s[at.TURNED + 2] += r2
    s[at.TURNED + 3] += r3
    s[at.TURNED + 4] += r4
    s[at.TURNED + 5] += r5
    s[at.TURNED + 6] += r6
    s[at.TURNED + 7] += r7
    s[at.TURNED + 8] += r8
    s[at.SAMPLES] += 1.0
    s[at.ELAPSED] += dt
    s[at.RATE] += w[0]
    s[at.RATE + 1] += w[1]
    s[at.RATE + 2] += w[2]
    ax, ay, az = a[0], a[1], a[2]
    if usable(ax, ay, az):
        s[at.FORCE] += r0 * ax + r1 * ay + r2 * az
        s[at.FORCE + 1] += r3 * ax + r4 * ay + r5 * az
        s[at.FORCE + 2] += r6 * ax + r7 * ay + r8 * az
        s[at.SPECIFIC] += ax
        s[at.SPECIFIC + 1] += ay
        s[at.SPECIFIC + 2] += az
        s[at.FORCES] += 1.0
    mx, my, mz = m[0], m[1], m[2]
    # a reading that is bit for bit the one before is a held one, and no news
    held = mx == s[at.LAST_FIELD] and my == s[at.LAST_FIELD + 1] and mz == s[at.LAST_FIELD + 2]
    if usable(mx, my, mz) and not held:
        s[at.LAST_FIELD], s[at.LAST_FIELD + 1], s[at.LAST_FIELD + 2] = mx, my, mz
        s[at.FIELD] += r0 * mx + r1 * my + r2 * mz
        s[at.FIELD + 1] += r3 * mx + r4 * my + r5 * mz
        s[at.FIELD + 2] += r6 * mx + r7 * my + r8 * mz
        s[at.FIELDS] += 1.0


@njit(types.void(w1, f1, f1, f0), **compiled)
def jump(s, p, a, dt):
    """Nothing was read for a while: it may have turned by half a radian a second, any way."""
    if s[at.SAMPLES] > 0.0:
        close_block(s, p)
    turned = min(0.25 * dt * dt, 10.0)
    s[at.D] += turned
    s[at.AGE] = 0.0
    widen_tilt(s, p, min(turned, p[at.TILT_PRIOR]), turned)
    if turned > p[at.TILT_PRIOR] and usable(a[0], a[1], a[2]):
        w, i, j, k = s[0], s[1], s[2], s[3]
        r = 2.0 * (a[0] * i + a[1] * j + a[2] * k), w * w - i * i - j * j - k * k, 2.0 * w
        x = r[0] * i + r[1] * a[0] + r[2] * (j * a[2] - k * a[1])
        y = r[0] * j + r[1] * a[1] + r[2] * (k * a[0] - i * a[2])
        z = r[0] * k + r[1] * a[2] + r[2] * (i * a[1] - j * a[0])
        lean_upright(s, x, y, z)
    s[at.LEVEL], s[at.STILL] = p[at.LEVEL_PRIOR], 0.0
    s[at.RESTING] = 0.0
    open_block(s)


@njit(types.void(w1, f1, f1, f1, f0, f1), **compiled)
def step_error_state(s, w, a, m, dt, p):
    """Advance the state by one sample that comes dt after the one before."""
    if not abs(w[0]) + abs(w[1]) + abs(w[2]) < math.inf:
        s[at.PENDING] += dt
        return
    if s[at.STARTED] == 0.0:
        start_error_state(s, a, p)
        dt = 0.0
    dt = max(0.0, dt) + s[at.PENDING]
    s[at.PENDING] = 0.0
    if dt > p[at.GAP]:
        jump(s, p, a, dt)
        dt = 0.0
    gather(s, w, a, m, dt)
    if s[at.NORTH_KNOWN] == 0.0 and s[at.FIELDS] > 0.0:
        use_field(s, p, dt)
    if s[at.ELAPSED] >= p[at.BLOCK] * (1.0 - 1e-6):
        close_block(s, p)
