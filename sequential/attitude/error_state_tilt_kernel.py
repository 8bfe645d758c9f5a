"""Compiled: inclination, gyro bias and bounded motion, corrected once a block.

Errors x: rotation θ in the frame of the gyro (R = exp(θ) R̂), bias, horizontal velocity and position.
"""

from __future__ import annotations

import math

from numba import njit, types

from sequential.attitude import error_state_layout as at
from sequential.attitude.turning_kernel import compiled, f0, f1, w1

__all__ = [
    "absorb",
    "correct_tilt",
    "inject_tilt",
    "propagate_tilt",
    "rest_bias",
    "widen_tilt",
]

N, P, X, G = at.ERRORS, at.P, at.X, at.GAIN
i0 = types.int64


@njit(types.void(w1, i0, i0, i0, f0, f0), **compiled)
def absorb(s, p, n, x, innovation, variance):
    """One scalar reading, P Hᵀ in GAIN: x += K e, P -= K (P Hᵀ)ᵀ, for the n errors whose P is at `p`."""
    inverse = 1.0 / variance
    for i in range(n):
        gain = s[G + i] * inverse
        s[x + i] += gain * innovation
        for j in range(i + 1):
            value = s[p + n * i + j] - gain * s[G + j]
            s[p + n * i + j] = value
            s[p + n * j + i] = value


@njit(types.void(w1, f0, f0), **compiled)
def absorb_tilt(s, innovation, variance):
    """`absorb` for inclination and bias; the drift of the heading is considered, not corrected (Schmidt)."""
    heading = s[P + 2 * (N + 1)]
    absorb(s, P, N, X, innovation, variance)
    s[P + 2 * (N + 1)] = heading
    s[X + 2] = 0.0


@njit(types.void(w1, f0, f0, f0), **compiled)
def propagate_tilt(s, dt, fz, inverse):
    """P ← F P Fᵀ over a block: θ' = -R b, v' = fz (θy, -θx), p' = v; `inverse` is 1 / samples."""
    push = fz * dt
    for transposed in range(2):  # rows, then columns
        a, b = (N, 1) if transposed == 0 else (1, N)
        for k in range(N):
            c = P + b * k
            tx, ty, tz = s[c], s[c + a], s[c + 2 * a]
            bx, by, bz = s[c + 3 * a], s[c + 4 * a], s[c + 5 * a]
            vx, vy = s[c + 6 * a], s[c + 7 * a]
            s[c + 8 * a] += dt * (vx + 0.5 * push * ty)
            s[c + 9 * a] += dt * (vy - 0.5 * push * tx)
            s[c + 6 * a] = vx + push * ty
            s[c + 7 * a] = vy - push * tx
            r, m = at.TURNED, dt * inverse
            s[c] = tx - m * (s[r] * bx + s[r + 1] * by + s[r + 2] * bz)
            s[c + a] = ty - m * (s[r + 3] * bx + s[r + 4] * by + s[r + 5] * bz)
            s[c + 2 * a] = tz - m * (s[r + 6] * bx + s[r + 7] * by + s[r + 8] * bz)


@njit(types.void(w1, f1, f0, f0, f0), **compiled)
def correct_tilt(s, p, dt, fx, fy):
    """Move velocity and position by the mean specific force, and hold f + 2 α v + α² p = white noise.

    The noise's density follows the innovations over `LEVEL_TIME`, `SPREAD` times their mean.
    """
    alpha = p[at.BANDWIDTH]
    square = alpha * alpha
    fz = p[at.GRAVITY]
    share = 0.5 * min(1.0, dt / p[at.LEVEL_TIME])
    for i in range(2):
        force = fx if i == 0 else fy
        tilt, sign = (1, fz) if i == 0 else (0, -fz)
        s[at.POSITION + i] += dt * (s[at.VELOCITY + i] + 0.5 * dt * force)
        s[at.VELOCITY + i] += dt * force
        innovation = -(
            force
            + 2.0 * alpha * s[at.VELOCITY + i]
            + square * s[at.POSITION + i]
            + sign * s[X + tilt]
            + 2.0 * alpha * s[X + 6 + i]
            + square * s[X + 8 + i]
        )
        for k in range(N):
            row = P + N * k
            s[G + k] = sign * s[row + tilt] + 2.0 * alpha * s[row + 6 + i] + square * s[row + 8 + i]
        known = sign * s[G + tilt] + 2.0 * alpha * s[G + 6 + i] + square * s[G + 8 + i]
        noise = p[at.SPREAD] * s[at.LEVEL] / dt
        squared = innovation * innovation
        absorb_tilt(s, innovation, known + noise)
        s[at.LEVEL] += share * (squared * dt - s[at.LEVEL])
        s[at.LEVEL] = max(s[at.LEVEL], p[at.LEVEL_FLOOR])


@njit(types.void(w1, f1, f0, f0), **compiled)
def rest_bias(s, p, dt, inverse):
    """At rest the gyro reads its bias."""
    for i in range(3):
        k = 3 + i
        for j in range(N):
            s[G + j] = s[P + N * j + k]
        innovation = s[at.RATE + i] * inverse - s[at.BIAS + i] - s[X + k]
        absorb_tilt(s, innovation, s[G + k] + p[at.REST_NOISE] / dt)


@njit(types.void(w1), **compiled)
def inject_tilt(s):
    """Put the errors found into the nominal values."""
    x, y = 0.5 * s[X], 0.5 * s[X + 1]
    a, b, c, d = s[0], s[1], s[2], s[3]
    w = a - x * b - y * c
    i = b + x * a + y * d
    j = c - x * d + y * a
    k = d + x * c - y * b
    scale = 1.0 / math.sqrt(w * w + i * i + j * j + k * k)
    s[0], s[1], s[2], s[3] = w * scale, i * scale, j * scale, k * scale
    s[at.DELTA] -= 0.0 * s[X + 2]
    for n in range(3):
        s[at.BIAS + n] += s[X + 3 + n]
    for n in range(4):
        s[at.VELOCITY + n] += s[X + 6 + n]
    for n in range(N):
        s[X + n] = 0.0


@njit(types.void(w1, f1, f0, f0), **compiled)
def widen_tilt(s, p, tilt, heading):
    """Add variance to the rotation, and forget velocity and position: after a start or a gap."""
    for i in range(6, N):
        for j in range(N):
            s[P + N * i + j] = 0.0
            s[P + N * j + i] = 0.0
        s[P + (N + 1) * i] = p[at.VELOCITY_PRIOR] if i < 8 else p[at.POSITION_PRIOR]
        s[at.VELOCITY + i - 6] = 0.0
    s[P] += tilt
    s[P + N + 1] += tilt
    s[P + 2 * (N + 1)] += heading
