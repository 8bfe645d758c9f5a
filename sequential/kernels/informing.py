"""An information matrix Y = U D Uᵀ: its inverse, the inverse of a transition, and what a reading adds."""

from __future__ import annotations

import math

from numba import types

from sequential.kernels.arrays import b0, f0, f1, f2, i0, w1, w2
from sequential.kernels.bierman import decorrelate
from sequential.kernels.call import bare_as
from sequential.kernels.matrices import copy_matrix, fill_diagonal
from sequential.kernels.orthogonal import orthogonalise

__all__ = ["covariance", "inform", "invert"]

PAIR = types.Tuple([f0, f0])
SINGULAR = 1e-14  # a pivot of a transition below this share of its column's largest entry


@bare_as(b0(f2, i0, w2, w2))
def invert(a, d, work, out):
    """out = a⁻¹ by elimination with row exchanges; returns False where a (d, d) is singular."""
    copy_matrix(a, work)
    fill_diagonal(out, 1.0)
    for j in range(d):
        best, largest = j, 0.0
        for i in range(d):
            largest = max(largest, abs(a[i, j]))
            if i > j and abs(work[i, j]) > abs(work[best, j]):
                best = i
        pivot = work[best, j]
        if not abs(pivot) > SINGULAR * largest:
            return False
        for k in range(d):
            work[best, k], work[j, k] = work[j, k], work[best, k] / pivot
            out[best, k], out[j, k] = out[j, k], out[best, k] / pivot
        for i in range(d):
            s = work[i, j]
            if i != j and s != 0.0:
                for k in range(d):
                    work[i, k] -= s * work[j, k]
                    out[i, k] -= s * out[j, k]
    return True


@bare_as(b0(f2, f1, i0, w2, w2))
def covariance(u, diagonal, d, inverse, p):
    """P = U⁻ᵀ D⁻¹ U⁻¹, with U⁻¹ left in `inverse`; returns False where the information is singular."""
    for j in range(d):
        if not diagonal[j] > 0.0:
            return False
        for i in range(d):
            inverse[i, j] = 1.0 if i == j else 0.0
        for i in range(j - 1, -1, -1):
            s = 0.0
            for k in range(i + 1, j + 1):
                s -= u[i, k] * inverse[k, j]
            inverse[i, j] = s
    for i in range(d):
        for j in range(i + 1):
            s = 0.0
            for k in range(j + 1):
                s += inverse[k, i] * inverse[k, j] / diagonal[k]
            p[i, j] = s
            p[j, i] = s
    return True


@bare_as(PAIR(f2, f1, f2, f2, f0, f1, i0, i0, w1, w2, w1, w2, w2, w2, w2, w1))
def inform(
    u,
    diagonal,
    h,
    noise,
    weight,
    residual,
    m,
    d,
    delta,
    new,
    new_diagonal,
    rows,
    lower,
    vectors,
    array,
    weights,
):
    """Add Hᵀ (R/w)⁻¹ H to U D Uᵀ; the new factors stand in rows and columns 1: of `new` (d+1, d+1).

    The whitened residual goes through the same orthogonalisation as a row of its own, before the others: what
    is left of it is the NIS, and its coefficients give delta = Y⁻¹ Hᵀ (R/w)⁻¹ residual without Y⁻¹.  Returns
    (NIS, log det S), with NIS -1 where R or the information is singular.
    """
    white, variance = vectors[0], vectors[1]
    decorrelate(h, noise, weight, residual, m, d, rows, white, variance, lower)
    log_det = 0.0
    for i in range(d):
        weights[i] = diagonal[i]
        log_det -= math.log(diagonal[i])
        array[0, i] = 0.0
        for j in range(d):
            array[1 + i, j] = u[i, j]
    for k in range(m):
        if not variance[k] > 0.0:
            return -1.0, 0.0
        weights[d + k] = 1.0 / variance[k]
        log_det += math.log(variance[k])
        array[0, d + k] = white[k]
        for i in range(d):
            array[1 + i, d + k] = rows[k, i]
    orthogonalise(array, weights, d + 1, d + m, new, new_diagonal)
    for i in range(d):
        if not new_diagonal[1 + i] > 0.0:
            return -1.0, 0.0
        log_det += math.log(new_diagonal[1 + i])
        delta[i] = new[0, 1 + i]
        for k in range(i):
            delta[i] -= new[1 + k, 1 + i] * delta[k]
    return new_diagonal[0], log_det
