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


@njit(types.void(f2, w2, w1, f0, w2), **compiled)
def in_body(c, r, w, latency_variance, out):
    """out ← Rᵀ C R + σ² w wᵀ: a covariance about the axes of the world, seen in the body."""
    for i in range(3):
        x = c[0, 0] * r[0, i] + c[0, 1] * r[1, i] + c[0, 2] * r[2, i]
        y = c[1, 0] * r[0, i] + c[1, 1] * r[1, i] + c[1, 2] * r[2, i]
        z = c[2, 0] * r[0, i] + c[2, 1] * r[1, i] + c[2, 2] * r[2, i]
        for j in range(i + 1):
            value = r[0, j] * x + r[1, j] * y + r[2, j] * z + latency_variance * w[i] * w[j]
            out[i, j] = out[j, i] = value


@njit(types.void(f1, f2, i1, b1, f3, f2, f3, f0, f0, f1, w2, w3), **compiled)
def densify(dt, gyro, first, rest, rotation, state, smoothed, latency, latency_sigma, extra, q, cov):
    """Fill q (N, 4) and cov (N, 3, 3) between nodes.

    Inside a node the gyro leads from one smoothed rotation to the next; what is left at the end is spread
    over it.  The result is `latency` seconds ahead of the gyro, by its last rate; `extra` (3,) are variances
    about the axes of the world that the chain does not know of.
    """
    turn, blend, longest = np.empty(3), np.empty((3, 3)), 0
    for k in range(len(first) - 1):
        longest = max(longest, first[k + 1] - first[k])
    rates, path = np.empty((longest, 3)), np.empty((longest + 1, 3, 3))
    variance = latency_sigma * latency_sigma
    for k in range(len(first) - 1):
        begin, count, x = first[k], first[k + 1] - first[k], state[k]
        path[0] = rotation[k]
        for s in range(count):
            w, g, r = rates[s], gyro[begin + s], path[s + 1]
            for i in range(3):
                m = MATRIX + 3 * i
                w[i] = g[i] - x[BIAS + i] - x[m] * g[0] - x[m + 1] * g[1] - x[m + 2] * g[2]
                if rest[k]:
                    w[i] = 0.0
                for j in range(3):
                    r[i, j] = path[s, i, j]
            h = dt[begin + s]
            turned(r, h * w[0], h * w[1], h * w[2])
        difference(rotation[k + 1], path[count], turn)
        for s in range(count):
            w, r, share = rates[s], path[s + 1], (s + 1.0) / count
            retract(r, share * turn[0], share * turn[1], share * turn[2])
            turned(r, latency * w[0], latency * w[1], latency * w[2])
            quaternion(r, q[begin + s])
            for i in range(3):
                for j in range(3):
                    blend[i, j] = (1.0 - share) * smoothed[k, i, j] + share * smoothed[k + 1, i, j]
                blend[i, i] += extra[i]
            in_body(blend, r, w, variance, cov[begin + s])
