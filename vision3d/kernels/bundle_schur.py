"""Points eliminated from a bundle adjustment one by one, and put back.

The normal matrix has a block (n, n) of the views (poses and free parameters of cameras), small blocks (3, 3)
of the points, and couplings only where an image sees a point.  Triggs, McLauchlan, Hartley, Fitzgibbon 2000,
"Bundle adjustment - a modern synthesis", section 6.1.

Arguments that recur: `by_view` (K, 2, m) and `by_point` (K, 2, 3) as `vision3d.kernels.bundle.linearize`
fills them, `weights` (K,) in 1/px², `columns` (V, m) the place of every local unknown of an image among the
n, −1 where it is held, `starts` (N + 1,): observations `starts[j]` to `starts[j + 1]` are those of point j.
"""

from __future__ import annotations

import math

import numpy as np

from vision3d.kernels import inlined, kernel
from vision3d.kernels.arrays import f0, f1, f2, f3, i0, i1, i2, w1, w2, w3

__all__ = ["back_substitute", "eliminate", "point_covariances"]

SINGULAR = 1e-13
"""Smallest pivot of a point's block at unit diagonal that is not taken for zero: a parallax of 1e-6 rad."""


@inlined
def inverted(T, out):
    """Fill the inverse of a symmetric (3, 3) matrix; False, and zeros, where it is singular."""
    out[:, :] = 0.0
    if not (T[0, 0] > 0.0 and T[1, 1] > 0.0 and T[2, 2] > 0.0):
        return False
    s0, s1, s2 = 1.0 / math.sqrt(T[0, 0]), 1.0 / math.sqrt(T[1, 1]), 1.0 / math.sqrt(T[2, 2])
    a, b, c = T[1, 0] * s1 * s0, T[2, 0] * s2 * s0, T[2, 1] * s2 * s1
    d1 = 1.0 - a * a
    if d1 < SINGULAR:
        return False
    l = (c - a * b) / d1
    d2 = 1.0 - b * b - l * l * d1
    if d2 < SINGULAR:
        return False
    # inverse of the unit triangle, then its columns weighed by the pivots
    g = a * l - b
    i1_, i2_ = 1.0 / d1, 1.0 / d2
    out[0, 0] = (1.0 + a * a * i1_ + g * g * i2_) * s0 * s0
    out[1, 0] = (-a * i1_ - g * l * i2_) * s1 * s0
    out[2, 0] = g * i2_ * s2 * s0
    out[1, 1] = (i1_ + l * l * i2_) * s1 * s1
    out[2, 1] = -l * i2_ * s2 * s1
    out[2, 2] = i2_ * s2 * s2
    out[0, 1], out[0, 2], out[1, 2] = out[1, 0], out[2, 0], out[2, 1]
    return True


@kernel(i0(i1, i1, i2, f1, f2, f3, f3, f0, w2, w1, w1, w3, w2))
def eliminate(images, starts, columns, weights, residuals, by_view, by_point, damping, S, g, U, T_inverse, b):
    """Fill the reduced normal equations; returns how many points the observations leave free.

    Parameters
    ----------
    damping : added to the diagonal of the points' blocks, as a share of it; the caller adds that of the views
    S, g : (n, n) and (n,) filled: reduced normal matrix and right-hand side
    U : (n,) filled: diagonal of the views' own block
    T_inverse : (N, 3, 3) filled: inverses of the points' blocks, zero where one is singular
    b : (N, 3) filled: right-hand sides of the points
    """
    m = by_view.shape[2]
    longest = 0
    for j in range(starts.shape[0] - 1):
        longest = max(longest, starts[j + 1] - starts[j])
    E = np.empty((longest, m, 3))
    Y = np.empty((m, 3))
    T = np.empty((3, 3))
    S[:, :] = 0.0
    g[:] = 0.0
    U[:] = 0.0
    free = 0
    for j in range(starts.shape[0] - 1):
        low, high = starts[j], starts[j + 1]
        T[:, :] = 0.0
        b[j] = 0.0
        for k in range(low, high):
            w, place = weights[k], columns[images[k]]
            A, B, r = by_view[k], by_point[k], residuals[k]
            for x in range(3):
                b[j, x] += w * (B[0, x] * r[0] + B[1, x] * r[1])
                for y in range(x + 1):
                    T[x, y] += w * (B[0, x] * B[0, y] + B[1, x] * B[1, y])
            for s in range(m):
                for x in range(3):
                    E[k - low, s, x] = w * (A[0, s] * B[0, x] + A[1, s] * B[1, x])
                row = place[s]
                if row < 0:
                    continue
                g[row] += w * (A[0, s] * r[0] + A[1, s] * r[1])
                for t in range(m):
                    if place[t] >= 0:
                        S[row, place[t]] += w * (A[0, s] * A[0, t] + A[1, s] * A[1, t])
                U[row] += w * (A[0, s] * A[0, s] + A[1, s] * A[1, s])
        for x in range(3):
            T[x, x] *= 1.0 + damping
        if not inverted(T, T_inverse[j]):
            free += 1
            continue
        I = T_inverse[j]
        for k in range(low, high):
            place, F = columns[images[k]], E[k - low]
            for s in range(m):
                for x in range(3):
                    Y[s, x] = F[s, 0] * I[0, x] + F[s, 1] * I[1, x] + F[s, 2] * I[2, x]
                if place[s] >= 0:
                    g[place[s]] -= Y[s, 0] * b[j, 0] + Y[s, 1] * b[j, 1] + Y[s, 2] * b[j, 2]
            for other in range(low, k + 1):
                there, G = columns[images[other]], E[other - low]
                for s in range(m):
                    row = place[s]
                    if row < 0:
                        continue
                    for t in range(m):
                        column = there[t]
                        if column < 0:
                            continue
                        block = Y[s, 0] * G[t, 0] + Y[s, 1] * G[t, 1] + Y[s, 2] * G[t, 2]
                        S[row, column] -= block
                        if other < k:
                            S[column, row] -= block
    return free


@kernel(i0(i1, i1, i2, f1, f3, f3, f3, f2, f1, w2))
def back_substitute(images, starts, columns, weights, by_view, by_point, T_inverse, b, step, moved):
    """Fill the steps (N, 3) of the points that go with a step (n,) of the views; returns their number."""
    m = by_view.shape[2]
    for j in range(starts.shape[0] - 1):
        e0, e1, e2 = b[j, 0], b[j, 1], b[j, 2]
        for k in range(starts[j], starts[j + 1]):
            place, A, B = columns[images[k]], by_view[k], by_point[k]
            u, v = 0.0, 0.0
            for s in range(m):
                if place[s] >= 0:
                    u += A[0, s] * step[place[s]]
                    v += A[1, s] * step[place[s]]
            u, v = u * weights[k], v * weights[k]
            e0 -= B[0, 0] * u + B[1, 0] * v
            e1 -= B[0, 1] * u + B[1, 1] * v
            e2 -= B[0, 2] * u + B[1, 2] * v
        for x in range(3):
            moved[j, x] = T_inverse[j, x, 0] * e0 + T_inverse[j, x, 1] * e1 + T_inverse[j, x, 2] * e2
    return starts.shape[0] - 1


@kernel(i0(i1, i1, i2, f1, f3, f3, f3, f2, w3))
def point_covariances(images, starts, columns, weights, by_view, by_point, T_inverse, C, covs):
    """Fill covariances (N, 3, 3) of the points, given C (n, n) of the views; returns their number."""
    m = by_view.shape[2]
    longest = 0
    for j in range(starts.shape[0] - 1):
        longest = max(longest, starts[j + 1] - starts[j])
    E = np.empty((longest, m, 3))
    M = np.empty((3, 3))
    H = np.empty((m, 3))
    for j in range(starts.shape[0] - 1):
        low, high = starts[j], starts[j + 1]
        I = T_inverse[j]
        M[:, :] = 0.0
        for k in range(low, high):
            A, B = by_view[k], by_point[k]
            for s in range(m):
                for x in range(3):
                    E[k - low, s, x] = weights[k] * (A[0, s] * B[0, x] + A[1, s] * B[1, x])
        for k in range(low, high):
            place = columns[images[k]]
            H[:, :] = 0.0
            for other in range(low, high):
                there = columns[images[other]]
                for s in range(m):
                    if place[s] < 0:
                        continue
                    for t in range(m):
                        if there[t] < 0:
                            continue
                        c = C[place[s], there[t]]
                        for x in range(3):
                            H[s, x] += c * E[other - low, t, x]
            for s in range(m):
                for x in range(3):
                    for y in range(3):
                        M[x, y] += E[k - low, s, x] * H[s, y]
        for x in range(3):
            for y in range(3):
                total = I[x, y]
                for s in range(3):
                    for t in range(3):
                        total += I[x, s] * M[s, t] * I[t, y]
                covs[j, x, y] = total
    return starts.shape[0] - 1
