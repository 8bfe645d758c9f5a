"""Compiled: what the error-state filter reports at a sample, and the loop over a recording."""

from __future__ import annotations

import math

from numba import njit, types

from sequential.attitude import error_state_layout as at
from sequential.attitude.error_state_step_kernel import step_error_state
from sequential.attitude.turning_kernel import compiled, f1, f2, i1, w1, w2

__all__ = ["report", "run_error_state", "spread"]

N, P = at.ERRORS, at.P
i0 = types.int64
flags = types.boolean[::1]
w3 = types.float64[:, :, ::1]


@njit(types.void(w1, f1, f1, i0, w2, w2), **compiled)
def report(s, w, p, row, out, free):
    """Both attitudes at the time of the sample: the gyro's reading is LATENCY old."""
    half = 0.5 * p[at.LATENCY]
    x, y, z = half * (w[0] - s[at.BIAS]), half * (w[1] - s[at.BIAS + 1]), half * (w[2] - s[at.BIAS + 2])
    if not abs(x) + abs(y) + abs(z) < math.inf:
        x, y, z = 0.0, 0.0, 0.0
    scale = 1.0 / math.sqrt(1.0 + x * x + y * y + z * z)
    q, i, j, k = s[0] * scale, s[1] * scale, s[2] * scale, s[3] * scale
    a = q - i * x - j * y - k * z
    b = i + q * x + j * z - k * y
    c = j + q * y + k * x - i * z
    d = k + q * z + i * y - j * x
    e, f = s[at.HALF], s[at.HALF + 1]
    # the one of both signs whose w is not negative
    up = math.copysign(1.0, a)
    free[row, 0], free[row, 1], free[row, 2], free[row, 3] = up * a, up * b, up * c, up * d
    up = math.copysign(1.0, e * a - f * d)
    out[row, 0], out[row, 1] = up * (e * a - f * d), up * (e * b - f * c)
    out[row, 2], out[row, 3] = up * (e * c + f * b), up * (e * d + f * a)


@njit(types.void(w1, f1, f1, i0, w3, w3), **compiled)
def spread(s, w, p, row, cov, free):
    """Both covariances in the body frame: those of the filters, and what no filter averages away."""
    q, i, j, k = s[0], s[1], s[2], s[3]
    r0, r1, r2 = 1.0 - 2.0 * (j * j + k * k), 2.0 * (i * j - q * k), 2.0 * (i * k + q * j)
    r3, r4, r5 = 2.0 * (i * j + q * k), 1.0 - 2.0 * (i * i + k * k), 2.0 * (j * k - q * i)
    r6, r7, r8 = 2.0 * (i * k - q * j), 2.0 * (j * k + q * i), 1.0 - 2.0 * (i * i + j * j)
    xx, xy, yy = s[P] + p[at.TILT_FLOOR], s[P + 1], s[P + N + 1] + p[at.TILT_FLOOR]
    xz, yz, zz = s[P + 2], s[P + N + 2], s[P + 2 * N + 2]
    known = s[at.NORTH_KNOWN] > 0.0
    north = zz
    if known:
        north = s[at.D] + min(1.0, p[at.HEADING_FLOOR] / max(1e-6, s[at.NORTH] * s[at.NORTH]))
    x, y, z = w[0] - s[at.BIAS], w[1] - s[at.BIAS + 1], w[2] - s[at.BIAS + 2]
    late = p[at.LATENCY_SPREAD] if abs(x) + abs(y) + abs(z) < math.inf else 0.0
    if late == 0.0:
        x, y, z = 0.0, 0.0, 0.0
    u = xx * r0 + xy * r3, xx * r1 + xy * r4, xx * r2 + xy * r5
    v = xy * r0 + yy * r3, xy * r1 + yy * r4, xy * r2 + yy * r5
    h = xz * r0 + yz * r3, xz * r1 + yz * r4, xz * r2 + yz * r5
    first, second, third, rate = (r0, r1, r2), (r3, r4, r5), (r6, r7, r8), (x, y, z)
    for a in range(3):
        for b in range(a + 1):
            tilt = first[a] * u[b] + second[a] * v[b] + late * rate[a] * rate[b]
            straight = third[a] * third[b]
            drifting = tilt + zz * straight + third[a] * h[b] + h[a] * third[b]
            value = tilt + north * straight if known else drifting
            free[row, a, b], free[row, b, a] = drifting, drifting
            cov[row, a, b], cov[row, b, a] = value, value


@njit(types.void(i1, f2, f2, f2, f1, w1, w2, w2, w3, w3, w2, w3, flags, flags), **compiled)
def run_error_state(t, gyro, accel, mag, p, s, out, free, cov, cov_free, bias, bias_cov, rest, disturbed):
    """Filter a recording; the arrays after s take what is known at each sample; empty ones are left."""
    step_mag = 0 if len(mag) == 1 else 1
    for k in range(len(t)):
        w = gyro[k]
        step_error_state(s, w, accel[k], mag[k * step_mag], 0.0 if k == 0 else 1e-9 * (t[k] - t[k - 1]), p)
        rest[k], disturbed[k] = s[at.RESTING] > 0.0, s[at.DISTURBED] > 0.0
        report(s, w, p, k, out, free)
        if len(cov) > 0:
            spread(s, w, p, k, cov, cov_free)
        if len(bias) > 0:
            for i in range(3):
                bias[k, i] = s[at.BIAS + i]
                for j in range(3):
                    bias_cov[k, i, j] = s[P + N * (3 + i) + 3 + j]
