"""A covariance as P = U D Uᵀ, and its update by a reading: nothing is subtracted, so nothing can cancel.

U is unit upper triangular, D diagonal and not negative (Bierman 1977, Factorization methods for discrete
sequential estimation, ch. V).  P may be singular, and so may the noise of a reading: zeros of D stay exact.
"""

from __future__ import annotations

import math

from numba import types

from sequential.kernels.arrays import f0, f1, f2, i0, w1, w2
from sequential.kernels.call import bare_as

__all__ = [
    "BIERMAN_VECTORS",
    "factor_ud",
    "reconstruct",
    "update_covariance_ud",
    "update_ud",
    "update_ud_by_scalar",
]

PAIR = types.Tuple([f0, f0])
BIERMAN_VECTORS = 6  # rows of scratch, each max(m, d) long, that an update by a vector needs
ROUNDING = 1e-15  # a pivot below this share of its diagonal is rounding: a direction without uncertainty
INDEFINITE = -1e-8  # and one that is this negative is not


@bare_as(i0(f2, i0, w2, w1))
def factor_ud(p, d, u, diagonal):
    """Factor a semi-definite P (d, d); returns how many pivots were NaN or negative beyond rounding.

    Such a pivot becomes zero (NaN stays NaN), so that U D Uᵀ is semi-definite whatever P was.
    """
    bad = 0
    for j in range(d - 1, -1, -1):
        pivot = p[j, j]
        for k in range(j + 1, d):
            pivot -= u[j, k] * u[j, k] * diagonal[k]
        if not pivot >= INDEFINITE * p[j, j] or p[j, j] < 0.0:
            bad += 1
        kept = pivot > ROUNDING * p[j, j]
        diagonal[j] = pivot if kept or math.isnan(pivot) else 0.0
        for i in range(d):
            u[i, j] = 1.0 if i == j else 0.0
        if kept:
            for i in range(j):
                s = p[i, j]
                for k in range(j + 1, d):
                    s -= u[i, k] * diagonal[k] * u[j, k]
                u[i, j] = s / pivot
    return bad


@bare_as(types.void(f2, f1, i0, w2))
def reconstruct(u, diagonal, d, p):
    """P (d, d) = U D Uᵀ, exactly symmetric, for any square factor U."""
    for i in range(d):
        for j in range(i + 1):
            s = 0.0
            for k in range(d):
                s += u[i, k] * diagonal[k] * u[j, k]
            p[i, j] = s
            p[j, i] = s


@bare_as(f0(w2, w1, f1, f0, i0, w1, w1))
def update_ud_by_scalar(u, diagonal, h, variance, d, gain, projected):
    """Update U and D by one number with row h (d,); returns its innovation variance α = h P hᵀ + r.

    `gain` becomes P hᵀ, to be divided by α (Bierman 1977, section V.3); `projected` (d,) is scratch.  With a
    variance of zero the direction that is read becomes an exact zero of D.
    """
    for j in range(d):
        s = h[j]
        for i in range(j):
            s += u[i, j] * h[i]
        projected[j] = s
    before = variance
    for j in range(d):
        f = projected[j]
        v = diagonal[j] * f
        after = before + f * v
        slope = -f / before if before > 0.0 else 0.0  # before = 0 means that gain is zero so far
        if after > 0.0:
            diagonal[j] *= before / after
        gain[j] = v
        for i in range(j):
            old = u[i, j]
            u[i, j] = old + slope * gain[i]
            gain[i] += v * old
        before = after
    return before


@bare_as(types.void(f2, f2, f0, f1, i0, i0, w2, w1, w1, w2))
def decorrelate(h, noise, weight, residual, m, d, rows, white, variance, lower):
    """Rows T H (m, d), residual T e and variances of readings whose noise T R/w Tᵀ is diagonal.

    T is the inverse of the unit triangular factor of R, so that it changes no determinant.
    """
    factor_ud(noise, m, lower, variance)
    for i in range(m - 1, -1, -1):
        variance[i] /= weight
        white[i] = residual[i]
        for j in range(d):
            rows[i, j] = h[i, j]
        for k in range(i + 1, m):
            s = lower[i, k]
            if s != 0.0:
                white[i] -= s * white[k]
                for j in range(d):
                    rows[i, j] -= s * rows[k, j]


@bare_as(PAIR(w2, w1, f2, f2, f0, f1, i0, i0, w1, w2, w2, w2))
def update_ud(u, diagonal, h, noise, weight, residual, m, d, delta, rows, lower, vectors):
    """Update U, D by a reading with Jacobian h (m, d) and noise R/weight (m, m), number after number.

    Adds the correction K·residual to `delta` (d,) and returns (NIS, log det S), from the innovation variances
    of the single numbers, hence exact where S is singular to rounding; NIS is -1 where one of them is not
    positive, and U, D and delta are then spoiled.  R may be correlated, singular or zero.

    Scratch: rows (m, d), lower (m, m), vectors (BIERMAN_VECTORS, max(m, d)).
    """
    white, variance, gain, projected = vectors[0], vectors[1], vectors[2], vectors[3]
    moved = vectors[4]
    decorrelate(h, noise, weight, residual, m, d, rows, white, variance, lower)
    for i in range(d):
        moved[i] = 0.0
    nis, log_det = 0.0, 0.0
    for i in range(m):
        innovation = white[i]
        for j in range(d):
            innovation -= rows[i, j] * moved[j]
        alpha = update_ud_by_scalar(u, diagonal, rows[i], variance[i], d, gain, projected)
        if not alpha > 0.0:
            return -1.0, 0.0
        scaled = innovation / alpha
        for j in range(d):
            moved[j] += gain[j] * scaled
        nis += innovation * scaled
        log_det += math.log(alpha)
    for i in range(d):
        delta[i] += moved[i]
    return nis, log_det


@bare_as(PAIR(w2, f2, f2, f0, f1, i0, i0, w1, w2, w2, w2, w2))
def update_covariance_ud(p, h, noise, weight, residual, m, d, delta, u, rows, lower, vectors):
    """The same update of a full P (d, d) in place, for one that is in doubt: factor, update, multiply out.

    Returns (NIS, log det S) and adds to `delta`; NIS is -1, with P and delta as they were, where P is not
    positive semi-definite or an innovation variance is not positive.  Scratch as above, and u (d, d).
    """
    diagonal = vectors[5]
    if factor_ud(p, d, u, diagonal) > 0:
        return -1.0, 0.0
    nis, log_det = update_ud(u, diagonal, h, noise, weight, residual, m, d, delta, rows, lower, vectors)
    if nis >= 0.0:
        reconstruct(u, diagonal, d, p)
    return nis, log_det
