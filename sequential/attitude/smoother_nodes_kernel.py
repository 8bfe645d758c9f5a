"""Compiled: a stretch of samples becomes one node, preintegrated in the frame of its beginning."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

import sequential.kernels  # noqa: F401 - compiled code is kept where a digest of all of it says

__all__ = ["summarise"]

f1 = types.Array(types.float64, 1, "C", readonly=True)
f2 = types.Array(types.float64, 2, "C", readonly=True)
i1 = types.Array(types.int64, 1, "C", readonly=True)
w1, w2 = types.float64[::1], types.float64[:, ::1]
f0 = types.float64
compiled = {"cache": True, "error_model": "numpy", "nogil": True}

# columns of a node
TURN, PUSH, LEVER, GAIN, FIELD, SWEEP, RATE = 0, 9, 12, 21, 48, 51, 54
TIME, LOST, ANGLE2, FIELD_TIME, GYRO_VAR, ACCEL, ACCEL_VAR, WIDTH = 57, 58, 59, 60, 61, 62, 65, 66


@njit(types.void(w2, f0, f0, f0), **compiled)
def turned(r, x, y, z):
    """R ← R exp((x, y, z)×), by the exact formula of Rodrigues."""
    square = x * x + y * y + z * z
    if square > 1e-8:
        angle = math.sqrt(square)
        s, c = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    else:
        s, c = 1.0 - square / 6.0, 0.5 - square / 24.0
    for i in range(3):
        a, b, d = r[i, 0], r[i, 1], r[i, 2]
        # (row) K and (row) K K of the skew matrix K
        k0, k1, k2 = b * z - d * y, d * x - a * z, a * y - b * x
        r[i, 0] = a + s * k0 + c * (k1 * z - k2 * y)
        r[i, 1] = b + s * k1 + c * (k2 * x - k0 * z)
        r[i, 2] = d + s * k2 + c * (k0 * y - k1 * x)


@njit(types.void(f1, f1, f2, f2, f2, i1, f1, f0, w2), **compiled)
def summarise(dt, lost, gyro, accel, mag, first, bias, field_limit, nodes):
    """Fill `nodes` (K, WIDTH); node k holds the samples first[k] to first[k+1] - 1.

    `dt` (N,) is the time that each sample is integrated over, `lost` (N,) what a gap before it leaves
    unknown, `bias` (3,) what is taken off the gyro, `field_limit` the longest time one field stands for.
    """
    r = np.empty((3, 3))
    since = field_limit
    for k in range(len(nodes)):
        n = nodes[k]
        n[:] = 0.0
        for i in range(3):
            for j in range(3):
                r[i, j] = 1.0 if i == j else 0.0
        fields = 0
        for s in range(first[k], first[k + 1]):
            h = dt[s]
            x, y, z = gyro[s, 0] - bias[0], gyro[s, 1] - bias[1], gyro[s, 2] - bias[2]
            turned(r, h * x, h * y, h * z)
            n[TIME] += h + lost[s]
            n[LOST] += lost[s]
            n[ANGLE2] += (x * x + y * y + z * z) * h
            since += h + lost[s]
            known = mag[s, 0] == mag[s, 0]
            fields += known
            mx, my, mz = mag[s, 0], mag[s, 1], mag[s, 2]
            sx, sy, sz = y * mz - z * my, z * mx - x * mz, x * my - y * mx
            for i in range(3):
                a, b, c = r[i, 0], r[i, 1], r[i, 2]
                n[PUSH + i] += (a * accel[s, 0] + b * accel[s, 1] + c * accel[s, 2]) * h
                n[LEVER + 3 * i] += a * h
                n[LEVER + 3 * i + 1] += b * h
                n[LEVER + 3 * i + 2] += c * h
                for j in range(3):
                    g, f = GAIN + 9 * j + i, r[i, j] * h
                    n[g] += f * x
                    n[g + 3] += f * y
                    n[g + 6] += f * z
                if known:
                    n[FIELD + i] += a * mx + b * my + c * mz
                    n[SWEEP + i] += a * sx + b * sy + c * sz
                n[RATE + i] += gyro[s, i]
                n[ACCEL + i] += accel[s, i]
            n[GYRO_VAR] += gyro[s, 0] ** 2 + gyro[s, 1] ** 2 + gyro[s, 2] ** 2
            n[ACCEL_VAR] += accel[s, 0] ** 2 + accel[s, 1] ** 2 + accel[s, 2] ** 2
        count = first[k + 1] - first[k]
        for i in range(3):
            for j in range(3):
                n[TURN + 3 * i + j] = r[i, j]
            n[RATE + i] /= count
            n[ACCEL + i] /= count
            if fields:
                n[FIELD + i] /= fields
                n[SWEEP + i] /= fields
        n[GYRO_VAR] = n[GYRO_VAR] / count - n[RATE] ** 2 - n[RATE + 1] ** 2 - n[RATE + 2] ** 2
        n[ACCEL_VAR] = n[ACCEL_VAR] / count - n[ACCEL] ** 2 - n[ACCEL + 1] ** 2 - n[ACCEL + 2] ** 2
        if fields:
            n[FIELD_TIME] = min(since, field_limit)
            since = 0.0
