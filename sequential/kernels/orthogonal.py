"""Triangular factors of a sum of squares by orthogonal transformations, so that no square is ever formed.

Thornton's weighted Gram-Schmidt gives the next U and D of a covariance, Householder's reflections the next
square root.  Both are given the columns of [F U | G], one of which may be a noise that acts nowhere.
"""

from __future__ import annotations

import math

from numba import types

from sequential.kernels.arrays import b0, f0, f1, f2, i0, w1, w2
from sequential.kernels.bierman import factor_ud
from sequential.kernels.call import bare_as

__all__ = ["carry_columns", "orthogonalise", "push_root", "push_ud", "triangularise", "update_root"]

PAIR = types.Tuple([f0, f0])
LOST = 1e-30  # a row whose square falls below this share of what it was depends on the rows below it
VANISHED = 1e-150  # a standard deviation whose square is about to underflow is zero


@bare_as(types.void(w2, f1, i0, i0, w2, w1))
def orthogonalise(w, weight, d, columns, u, diagonal):
    """U D Uᵀ = W diag(weight) Wᵀ for W (d, columns), by modified weighted Gram-Schmidt; W is spoiled.

    Thornton 1976, Triangular covariance factorizations for Kalman filtering, ch. III; Bierman 1977, VI.4.
    """
    for j in range(d):
        s = 0.0
        for k in range(columns):
            s += w[j, k] * w[j, k] * weight[k]
        diagonal[j] = s
    for j in range(d - 1, -1, -1):
        s = 0.0
        for k in range(columns):
            s += w[j, k] * w[j, k] * weight[k]
        diagonal[j] = s if s > LOST * diagonal[j] or math.isnan(s) else 0.0
        for i in range(j + 1, d):
            u[i, j] = 0.0
        u[j, j] = 1.0
        for i in range(j):
            u[i, j] = 0.0
            if diagonal[j] > 0.0:
                shared = 0.0
                for k in range(columns):
                    shared += w[i, k] * weight[k] * w[j, k]
                share = shared / s
                u[i, j] = share
                for k in range(columns):
                    w[i, k] -= share * w[j, k]


@bare_as(types.void(w2, i0, i0))
def triangularise(a, rows, columns):
    """A (rows, columns) <- A Θ, lower triangular with a diagonal that is not negative, for an orthogonal Θ.

    One Householder reflection for each row, rows <= columns.  The largest entry of a row is brought to its
    diagonal first, so that columns of very different size keep their digits (Cox and Higham 1998, Stability
    of Householder QR factorization for weighted least squares problems).
    """
    for j in range(rows):
        s, best = 0.0, j
        for k in range(j, columns):
            s += a[j, k] * a[j, k]
            if abs(a[j, k]) > abs(a[j, best]):
                best = k
        norm = math.sqrt(s)
        if norm < VANISHED:
            for k in range(j, columns):
                a[j, k] = 0.0
            continue
        if best != j:
            for i in range(j, rows):
                a[i, j], a[i, best] = a[i, best], a[i, j]
        first = a[j, j]
        sign = -1.0 if first > 0.0 else 1.0
        a[j, j] = first - sign * norm
        scale = 1.0 / (norm * (norm + abs(first)))
        for i in range(j + 1, rows):
            s = 0.0
            for k in range(j, columns):
                s += a[i, k] * a[j, k]
            s *= scale
            for k in range(j, columns):
                a[i, k] -= s * a[j, k]
            a[i, j] *= sign
        a[j, j] = norm
        for k in range(j + 1, columns):
            a[j, k] = 0.0


@bare_as(i0(f2, f2, f1, f2, f1, b0, i0, w2, w1))
def carry_columns(f, u, diagonal, source, variance, rooted, d, array, weight):
    """Columns [F U | G] and their weights, for G the columns of `source` with a variance; returns how many.

    With `rooted` the weight of a column of G goes into the column.
    """
    for i in range(d):
        for j in range(d):
            array[i, j] = 0.0
        for k in range(d):
            s = f[i, k]
            if s != 0.0:
                for j in range(d):
                    array[i, j] += s * u[k, j]
    columns = d
    for j in range(d):
        weight[j] = diagonal[j]
    for k in range(d):
        if variance[k] > 0.0 or math.isnan(variance[k]):
            scale = math.sqrt(variance[k]) if rooted else 1.0
            weight[columns] = 1.0 if rooted else variance[k]
            for i in range(d):
                array[i, columns] = scale * source[i, k]
            columns += 1
    return columns


@bare_as(types.void(f2, w2, w1, f2, f1, i0, w2, w1))
def push_ud(f, u, diagonal, source, variance, d, array, weight):
    """U D Uᵀ <- F U D Uᵀ Fᵀ + G diag(variance) Gᵀ; scratch: array (d, 2d), weight (2d,)."""
    columns = carry_columns(f, u, diagonal, source, variance, False, d, array, weight)
    orthogonalise(array, weight, d, columns, u, diagonal)


@bare_as(types.void(f2, w2, f1, f2, f1, i0, w2, w1))
def push_root(f, root, ones, source, variance, d, array, weight):
    """L Lᵀ <- F L Lᵀ Fᵀ + G diag(variance) Gᵀ for any root L; scratch as above."""
    columns = carry_columns(f, root, ones, source, variance, True, d, array, weight)
    triangularise(array, d, columns)
    for i in range(d):
        for j in range(d):
            root[i, j] = array[i, j]


@bare_as(PAIR(w2, f2, f2, f0, f1, i0, i0, w1, w2, w2, w1))
def update_root(root, h, noise, weight, residual, m, d, delta, array, lower, white):
    """Update L by a reading: [R½ H L; 0 L] Θ = [S½ 0; K S½ L+] (Kailath, Sayed, Hassibi 2000, section 12.3).

    Adds K·residual to `delta` and returns (NIS, log det S); NIS is -1, with L and delta as they were, where S
    is singular.  Scratch: array (m + d, m + d or more), lower (m, m), white (m or more,).
    """
    factor_ud(noise, m, lower, white)
    for i in range(m + d):
        for j in range(m + d):
            array[i, j] = 0.0
    for i in range(m):
        for j in range(m):
            array[i, j] = lower[i, j] * math.sqrt(white[j] / weight)
        for k in range(d):
            s = h[i, k]
            if s != 0.0:
                for j in range(d):
                    array[i, m + j] += s * root[k, j]
    for i in range(d):
        for j in range(d):
            array[m + i, m + j] = root[i, j]
    triangularise(array, m + d, m + d)
    nis, log_det = 0.0, 0.0
    for i in range(m):
        if not array[i, i] > 0.0:
            return -1.0, 0.0
        s = residual[i]
        for k in range(i):
            s -= array[i, k] * white[k]
        white[i] = s / array[i, i]
        nis += white[i] * white[i]
        log_det += 2.0 * math.log(array[i, i])
    for i in range(d):
        for k in range(m):
            delta[i] += array[m + i, k] * white[k]
        for j in range(d):
            root[i, j] = array[m + i, m + j]
    return nis, log_det
