"""Compiled: from smoothed nodes to an attitude and its covariance at every sample."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from sequential.attitude.smoother_forward_kernel import b1, f3, w3
from sequential.attitude.smoother_nodes_kernel import compiled, f0, f1, f2, i1, turned, w1, w2
from sequential.attitude.smoother_steps_kernel import BIAS, MATRIX, difference, retract

__all__ = ["densify"]


@njit(types.void(f2, w1), **compiled)
def quaternion(r, q):
    """Unit quaternion (w, x, y, z), w >= 0, of a rotation matrix."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    if trace > 0.0:
        s = 2.0 * math.sqrt(1.0 + trace)
        q[0] = 0.25 * s
        q[1], q[2], q[3] = (r[2, 1] - r[1, 2]) / s, (r[0, 2] - r[2, 0]) / s, (r[1, 0] - r[0, 1]) / s
    else:
        i = 0
        if r[1, 1] > r[0, 0]:
            i = 1
        if r[2, 2] > r[i, i]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        s = 2.0 * math.sqrt(max(1e-12, 1.0 + r[i, i] - r[j, j] - r[k, k]))
        q[0] = (r[k, j] - r[j, k]) / s
        q[1 + i], q[1 + j], q[1 + k] = 0.25 * s, (r[i, j] + r[j, i]) / s, (r[i, k] + r[k, i]) / s
        if q[0] < 0.0:
            for m in range(4):
                q[m] = -q[m]
    length = math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    for m in range(4):
        q[m] /= length


@njit(types.void(f1, f2, i1, b1, f3, f2, f3, f0, f0, f1, w2, w3, w2, w3), **compiled)
def densify(
    dt, gyro, first, rest, rotation, state, smoothed, latency, latency_sigma, extra, q, cov, bias, bias_cov
):  # fmt: skip
    """Fill q (N, 4), cov (N, 3, 3), bias (N, 3), bias_cov (N, 3, 3) between nodes.

    Inside a node the gyro leads from one smoothed rotation to the next; what is left at the end is spread
    over it.  The result is `latency` seconds ahead of the gyro, by its last rate; `extra` (3,) are variances
    about the axes of the world that the chain does not know of.
    """
    r, a, turn = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    blend, longest = np.empty((3, 3)), 0
    for k in range(len(first) - 1):
        longest = max(longest, first[k + 1] - first[k])
    rates = np.empty((longest, 3))
    for k in range(len(first) - 1):
        begin, end = first[k], first[k + 1]
        x = state[k]
        r[:, :] = rotation[k]
        for s in range(begin, end):
            w = rates[s - begin]
            for i in range(3):
                w[i] = gyro[s, i] - x[BIAS + i]
            if rest[k]:
                w[:] = 0.0
            else:
                for i in range(3):
                    m = MATRIX + 3 * i
                    w[i] -= x[m] * gyro[s, 0] + x[m + 1] * gyro[s, 1] + x[m + 2] * gyro[s, 2]
            turned(r, dt[s] * w[0], dt[s] * w[1], dt[s] * w[2])
        difference(rotation[k + 1], r, turn)
        r[:, :] = rotation[k]
        for s in range(begin, end):
            w = rates[s - begin]
            share = (s - begin + 1.0) / (end - begin)
            turned(r, dt[s] * w[0], dt[s] * w[1], dt[s] * w[2])
            a[:, :] = r
            retract(a, share * turn[0], share * turn[1], share * turn[2])
            turned(a, latency * w[0], latency * w[1], latency * w[2])
            quaternion(a, q[s])
            for i in range(3):
                bias[s, i] = x[BIAS + i]
                for j in range(3):
                    blend[i, j] = (1.0 - share) * smoothed[k, i, j] + share * smoothed[k + 1, i, j]
                    bias_cov[s, i, j] = smoothed[k, 3 + i, 3 + j]
                blend[i, i] += extra[i]
            for i in range(3):
                b0 = blend[0, 0] * a[0, i] + blend[0, 1] * a[1, i] + blend[0, 2] * a[2, i]
                b1_ = blend[1, 0] * a[0, i] + blend[1, 1] * a[1, i] + blend[1, 2] * a[2, i]
                b2 = blend[2, 0] * a[0, i] + blend[2, 1] * a[1, i] + blend[2, 2] * a[2, i]
                for j in range(3):
                    cov[s, i, j] = (
                        a[0, j] * b0
                        + a[1, j] * b1_
                        + a[2, j] * b2
                        + latency_sigma * latency_sigma * w[i] * w[j]
                    )
