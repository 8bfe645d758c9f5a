"""Compiled: the heading of the gyro's frame, from the magnetic field, without any effect on the inclination.

Errors: heading δ, reference field (north, up), residual hard iron (body), delay of the magnetometer.
"""

from __future__ import annotations

import math

from numba import njit, types

from sequential.attitude import error_state_layout as at
from sequential.attitude.error_state_tilt_kernel import absorb
from sequential.attitude.turning_kernel import compiled, f0, f1, w1

__all__ = ["correct_heading", "drift_heading", "start_heading"]

M, D, Y, G, H = at.HEADING_ERRORS, at.D, at.Y, at.GAIN, at.ROW
LONGEST = 0.5  # s: disturbances farther apart than this count as independent
i0 = types.int64


@njit(types.void(w1, f1, f0, f0, f0, f0), **compiled)
def start_heading(s, p, mx, my, mz, tilt):
    """Take the heading, and once the reference too, from a field in the frame of the gyro; `tilt`: rad²."""
    across = mx * mx + my * my
    if s[at.NORTH_KNOWN] == 0.0:
        s[at.SCALE] = math.sqrt(across + mz * mz)
        s[at.DELAY] = p[at.DELAY_MEAN]
        for i in range(M * M):
            s[D + i] = 0.0
        for i in range(3):
            s[at.IRON + i] = 0.0
            s[D + (M + 1) * (3 + i)] = p[at.IRON_PRIOR]
        s[D + (M + 1) * 6] = p[at.DELAY_PRIOR]
        s[at.NORTH_KNOWN] = 1.0
    if s[D + M + 1] == 0.0 or tilt > p[at.TILT_KNOWN]:
        s[at.NORTH], s[at.UP] = math.sqrt(across) / s[at.SCALE], mz / s[at.SCALE]
        s[D + M + 1] = p[at.REFERENCE_PRIOR]
        s[D + 2 * (M + 1)] = p[at.REFERENCE_PRIOR]
    for i in range(M):
        s[D + i] = 0.0
        s[D + M * i] = 0.0
    s[D] = p[at.HEADING_PRIOR] + tilt * min(mz * mz / max(across, 1e-12), 100.0)
    s[at.DELTA] = math.atan2(mx, my)
    s[at.UNSEEN] = 0.0


@njit(types.void(w1, f1, f0, f0), **compiled)
def drift_heading(s, p, dt, variance):
    """Random walk of the heading by `variance`, of the reference and of the iron by their settings."""
    s[D] += variance
    for i in range(1, 3):
        s[D + (M + 1) * i] += p[at.REFERENCE_WALK] * dt
    for i in range(3, 6):
        s[D + (M + 1) * i] += p[at.IRON_WALK] * dt
    s[at.UNSEEN] += dt


@njit(f0(w1, i0, f0, f0, f0, f0), **compiled)
def look(s, axis, m, slide, c, d):
    """One component of the field, heading turned out: innovation; H in ROW, P Hᵀ in GAIN.

    m = (0, north, up) + δ (north, 0, 0) + R iron + delay (ω × m)
    """
    r, inverse = at.TURNED, 1.0 / s[at.SAMPLES]
    s[H] = s[at.NORTH] if axis == 0 else 0.0
    s[H + 1] = 1.0 if axis == 1 else 0.0
    s[H + 2] = 1.0 if axis == 2 else 0.0
    innovation = m - s[at.NORTH] * s[H + 1] - s[at.UP] * s[H + 2]
    for j in range(3):
        a, b = s[r + j], s[r + 3 + j]
        turned = c * a - d * b if axis == 0 else (d * a + c * b if axis == 1 else s[r + 6 + j])
        s[H + 3 + j] = turned * inverse
        innovation -= s[H + 3 + j] * s[at.IRON + j]
    s[H + 6] = slide
    innovation -= slide * s[at.DELAY]
    for k in range(M):
        total = s[D + M * k + axis] * s[H + axis]
        for j in range(3, M):
            total += s[D + M * k + j] * s[H + j]
        s[G + k] = total
        innovation -= s[H + k] * s[Y + k]
    return innovation


@njit(f0(w1, i0), **compiled)
def expected(s, axis):
    """Variance of the innovation that `look` has prepared, without the noise: H P Hᵀ."""
    total = s[H + axis] * s[G + axis]
    for k in range(3, M):
        total += s[H + k] * s[G + k]
    return total


@njit(types.void(w1, f1, f0, f0, f0, f0, f0, f0, f0), **compiled)
def correct_heading(s, p, mx, my, mz, wx, wy, wz, tilt):
    """Correct by the mean field of a block, in the frame of the gyro, that turned at w; `tilt`: rad²."""
    c, d = math.cos(s[at.DELTA]), math.sin(s[at.DELTA])
    unit = 1.0 / s[at.SCALE]
    x, y, z = (c * mx - d * my) * unit, (d * mx + c * my) * unit, mz * unit
    u, v = c * wx - d * wy, d * wx + c * wy
    sx, sy, sz = v * z - wz * y, wz * x - u * z, u * y - v * x
    # judged by strength and dip alone: a wrong heading must not make the field look disturbed
    r, iron, inverse = at.TURNED, at.IRON, 1.0 / s[at.SAMPLES]
    e0 = mx * unit - (s[r] * s[iron] + s[r + 1] * s[iron + 1] + s[r + 2] * s[iron + 2]) * inverse
    e1 = my * unit - (s[r + 3] * s[iron] + s[r + 4] * s[iron + 1] + s[r + 5] * s[iron + 2]) * inverse
    e2 = z - (s[r + 6] * s[iron] + s[r + 7] * s[iron + 1] + s[r + 8] * s[iron + 2]) * inverse
    e0 -= s[at.DELAY] * (c * sx + d * sy)
    e1 -= s[at.DELAY] * (c * sy - d * sx)
    across, up = math.sqrt(e0 * e0 + e1 * e1) - s[at.NORTH], e2 - s[at.DELAY] * sz - s[at.UP]
    known = s[D + M + 1] + s[D + 2 * (M + 1)]
    beyond = across * across + up * up - known - tilt - p[at.FIELD_GATE]
    s[at.DISTURBED] = 1.0 if beyond > 0.0 else 0.0
    noise = p[at.FIELD_NOISE] / min(max(s[at.UNSEEN], p[at.BLOCK]), LONGEST) + 0.5 * tilt
    noise += p[at.FIELD_DOUBT] * max(0.0, beyond)
    for i in range(3, 6):
        s[D + (M + 1) * i] += p[at.IRON_DOUBT] * max(0.0, beyond) * min(s[at.UNSEEN], LONGEST)
    for axis in range(3):
        m, slide = (x, sx) if axis == 0 else ((y, sy) if axis == 1 else (z, sz))
        innovation = look(s, axis, m, slide, c, d)
        absorb(s, D, M, Y, innovation, expected(s, axis) + noise)
    for i in range(M):
        s[at.DELTA + i] += s[Y + i]
        s[Y + i] = 0.0
    s[at.UNSEEN] = 0.0
