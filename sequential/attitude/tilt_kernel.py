"""Compiled: one step of the tilt Kalman filter (angle and bias), and the loop over a recording.

Three channels, roll, pitch and yaw, each a Kalman filter of two states: angle θ, driven by the rate u, and
the bias b of that rate: θ' = u - b.  The matrices of such a small filter are written out.

Settings p: 0 density² of the gyro (rad²/s), 1 of the bias walk (rad²/s³), 2 R of roll and pitch, 3 of yaw
(rad²), 4 gate on the NIS, 5 variance of an unknown angle (rad²), 6 of an unknown bias (rad²/s²).

State s: 0-2 angles, 3-5 biases, 6-8 variance of the angle, 9-11 covariance of both, 12-14 variance of the
bias, 15 whether the heading is known, 16-18 the rates u that drove the last step.
"""

from __future__ import annotations

import math

from numba import njit, types

from sequential.attitude.turning_kernel import compiled, f0, f1, f2, i1, usable, w1, w2, w3

__all__ = ["STATE", "in_body", "run_tilt", "start_tilt", "step_tilt"]

STATE = 19
PAUSE = 1.0  # s: nothing is integrated over a longer one
STEEP = 0.05  # cosine of the pitch that angular rates are at least divided by
i0 = types.int64


@njit(f0(f0), **compiled)
def wrapped(angle):
    """The same angle in [-π, π]."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@njit(types.void(w1, f1, f1), **compiled)
def start_tilt(s, a, p):
    """The angles of the first specific force, with its variance; yaw 0 and no bias."""
    s[:] = 0.0
    good = usable(a[0], a[1], a[2])
    if good:
        s[0], s[1] = math.atan2(a[1], a[2]), math.atan2(-a[0], math.sqrt(a[1] * a[1] + a[2] * a[2]))
    for i in range(3):
        s[6 + i] = p[2] if good and i < 2 else p[5]
        s[12 + i] = p[6]


@njit(types.void(w1, i0, f0, f0, f1), **compiled)
def predict(s, i, rate, dt, p):
    """One channel over dt: F = [[1, -dt], [0, 1]], Q that of white noise on rate and bias walk."""
    s[i] += (rate - s[3 + i]) * dt
    angle, both, bias = s[6 + i], s[9 + i], s[12 + i]
    s[6 + i] = angle - 2.0 * dt * both + dt * dt * bias + p[0] * dt + p[1] * dt * dt * dt / 3.0
    s[9 + i] = both - dt * bias - 0.5 * p[1] * dt * dt
    s[12 + i] = bias + p[1] * dt


@njit(types.void(w1, i0, f0, f0, f0), **compiled)
def correct(s, i, measured, variance, gate):
    """One channel by a measured angle: the innovation is taken the short way round."""
    innovation = wrapped(measured - s[i])
    angle, both = s[6 + i], s[9 + i]
    total = angle + variance
    if innovation * innovation > gate * total:
        return
    s[i] += angle / total * innovation
    s[3 + i] += both / total * innovation
    s[6 + i] = angle * variance / total
    s[9 + i] = both * variance / total
    s[12 + i] -= both * both / total


@njit(types.void(w1), **compiled)
def fold(s):
    """Angles in their ranges: over the top, pitch comes back down and roll and yaw turn by half a turn."""
    s[1] = wrapped(s[1])
    if abs(s[1]) > 0.5 * math.pi:
        s[1], s[4] = wrapped(math.pi - s[1]), -s[4]
        s[0] += math.pi
        s[2] += math.pi
    s[0], s[2] = wrapped(s[0]), wrapped(s[2])


@njit(types.void(w1, f1, f1, f1, f0, f1), **compiled)
def step_tilt(s, w, a, m, dt, p):
    """Advance the state by one sample that comes dt after the one before."""
    if not abs(w[0]) + abs(w[1]) + abs(w[2]) < math.inf:
        return
    if not 0.0 <= dt <= PAUSE:
        dt = 0.0
        for i in range(3):
            s[6 + i], s[9 + i] = p[5], 0.0
    sine, cosine = math.sin(s[0]), math.cos(s[0])
    steep = max(math.cos(s[1]), STEEP)
    around = sine * w[1] + cosine * w[2]
    s[16], s[17], s[18] = w[0] + math.sin(s[1]) / steep * around, cosine * w[1] - sine * w[2], around / steep
    for i in range(3):
        predict(s, i, s[16 + i], dt, p)
    fold(s)
    if usable(a[0], a[1], a[2]) and dt > 0.0:
        correct(s, 0, math.atan2(a[1], a[2]), p[2], p[4])
        correct(s, 1, math.atan2(-a[0], math.sqrt(a[1] * a[1] + a[2] * a[2])), p[2], p[4])
        fold(s)
    if usable(m[0], m[1], m[2]):
        sr, cr, sp, cp = math.sin(s[0]), math.cos(s[0]), math.sin(s[1]), math.cos(s[1])
        yaw = math.atan2(m[0] * cp + (m[1] * sr + m[2] * cr) * sp, m[1] * cr - m[2] * sr)
        if s[15] == 0.0:
            s[2], s[8], s[11], s[15] = yaw, p[3], 0.0, 1.0
        else:
            correct(s, 2, yaw, p[3], p[4])
            s[2] = wrapped(s[2])


@njit(types.void(i1, f2, f2, f2, f1, w1, w2), **compiled)
def run_tilt(t, gyro, accel, mag, p, s, path):
    """Fill path (N, 19) with the states; `mag` may have one row, of NaN."""
    start_tilt(s, accel[0], p)
    last = len(mag) - 1
    for k in range(len(t)):
        dt = (t[k] - t[k - 1]) * 1e-9 if k > 0 else 0.0
        step_tilt(s, gyro[k], accel[k], mag[min(k, last)], dt, p)
        for i in range(STATE):
            path[k, i] = s[i]


@njit(types.void(f1, f1, w2), **compiled)
def turned(variances, e, out):
    """E diag(variances) Eᵀ for E = [[1, 0, e0], [0, e1, e2], [0, -e3, e4]], rates of angles to body rates."""
    u, v, w = variances[0], variances[1], variances[2]
    out[0, 0] = u + e[0] * e[0] * w
    out[1, 1] = e[1] * e[1] * v + e[2] * e[2] * w
    out[2, 2] = e[3] * e[3] * v + e[4] * e[4] * w
    out[0, 1] = out[1, 0] = e[0] * e[2] * w
    out[0, 2] = out[2, 0] = e[0] * e[4] * w
    out[1, 2] = out[2, 1] = e[2] * e[4] * w - e[1] * e[3] * v


@njit(types.void(f2, w1, w2, w3, w2, w3), **compiled)
def in_body(path, e, q, cov, bias, bias_cov):
    """Quaternions, and covariances and biases about the body's axes, of states (N, 19); e is scratch (5,)."""
    for k in range(len(path)):
        s = path[k]
        cr, sr = math.cos(0.5 * s[0]), math.sin(0.5 * s[0])
        cp, sp = math.cos(0.5 * s[1]), math.sin(0.5 * s[1])
        cy, sy = math.cos(0.5 * s[2]), math.sin(0.5 * s[2])
        q[k, 0], q[k, 1] = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
        q[k, 2], q[k, 3] = cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy
        if q[k, 0] < 0.0:
            for i in range(4):
                q[k, i] = -q[k, i]
        sine, cosine = 2.0 * sr * cr, cr * cr - sr * sr
        steep, level = 2.0 * sp * cp, cp * cp - sp * sp
        e[0], e[1], e[2], e[3], e[4] = -steep, cosine, sine * level, sine, cosine * level
        turned(s[6:9], e, cov[k])
        turned(s[12:15], e, bias_cov[k])
        bias[k, 0] = s[3] + e[0] * s[5]
        bias[k, 1] = e[1] * s[4] + e[2] * s[5]
        bias[k, 2] = e[4] * s[5] - e[3] * s[4]
