"""Small dense matrices, by hand: for these sizes a BLAS call costs ten times the work it does."""

from __future__ import annotations

import math

from numba import types

from sequential.kernels.arrays import b0, f0, f1, f2, i0, w1, w2
from sequential.kernels.call import inlined_as

__all__ = [
    "add_product_nt",
    "cholesky",
    "copy_matrix",
    "copy_vector",
    "fill_diagonal",
    "multiply",
    "multiply_nt",
    "push_covariance",
    "solve_lower",
    "solve_lower_transposed",
    "symmetrise",
]

SMALL = 6
TINY = 1e-13  # a pivot below this share of its diagonal has been lost to rounding


@inlined_as(types.void(f1, w1))
def copy_vector(a, out):
    """out = a, without the temporary that a slice assignment may take."""
    for i in range(len(a)):
        out[i] = a[i]


@inlined_as(types.void(f2, w2))
def copy_matrix(a, out):
    """out = a for matrices of a's shape."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            out[i, j] = a[i, j]


@inlined_as(types.void(w2, f0))
def fill_diagonal(out, value):
    """out = value times the identity."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = value if i == j else 0.0


@inlined_as(types.void(f2, f2, w2, i0, i0, i0))
def multiply(a, b, out, n, m, p):
    """out (n, p) = a (n, m) b (m, p); zeros of a are skipped, which pays for a sparse Jacobian."""
    for i in range(n):
        for j in range(p):
            out[i, j] = 0.0
        for k in range(m):
            s = a[i, k]
            if s != 0.0:
                for j in range(p):
                    out[i, j] += s * b[k, j]


@inlined_as(types.void(f2, f2, w2, i0, i0, i0))
def multiply_nt(a, b, out, n, m, p):
    """out (n, p) = a (n, m) bᵀ, with b (p, m)."""
    for i in range(n):
        for j in range(p):
            s = 0.0
            for k in range(m):
                s += a[i, k] * b[j, k]
            out[i, j] = s


@inlined_as(types.void(f2, f2, w2, i0, i0, i0))
def add_product_nt(a, b, out, n, m, p):
    """out (n, p) += a (n, m) bᵀ, with b (p, m)."""
    for i in range(n):
        for j in range(p):
            s = 0.0
            for k in range(m):
                s += a[i, k] * b[j, k]
            out[i, j] += s


@inlined_as(types.void(w2, i0))
def symmetrise(a, n):
    """a <- (a + aᵀ) / 2."""
    for i in range(n):
        for j in range(i):
            s = 0.5 * (a[i, j] + a[j, i])
            a[i, j] = s
            a[j, i] = s


@inlined_as(types.void(f2, w2, w2, w2, i0))
def push_covariance(f, p, work, flipped, d):
    """p <- F p Fᵀ for symmetric p; as F (F p)ᵀ unless it is small, so that both products skip zeros of F."""
    multiply(f, p, work, d, d, d)
    if d <= SMALL:
        for i in range(d):
            for j in range(i + 1):
                s = 0.0
                for k in range(d):
                    s += f[j, k] * work[i, k]
                p[i, j] = s
                p[j, i] = s
        return
    for i in range(d):
        for j in range(d):
            flipped[i, j] = work[j, i]
    multiply(f, flipped, p, d, d, d)
    symmetrise(p, d)


@inlined_as(i0(f2, w2, i0, b0))
def cholesky(a, lower, n, lenient):
    """Lower factor of a; returns the number of pivots lost to rounding.

    A lost pivot is an error to most callers.  With `lenient`, its column becomes zero, which makes the
    solves below act as a pseudo-inverse: a static state whose variance has vanished needs that.
    """
    lost = 0
    for j in range(n):
        s = a[j, j]
        for k in range(j):
            s -= lower[j, k] * lower[j, k]
        if not s > TINY * a[j, j]:
            lost += 1
            if not lenient:
                return lost
            for i in range(j, n):
                lower[i, j] = 0.0
            continue
        pivot = math.sqrt(s)
        lower[j, j] = pivot
        inverse = 1.0 / pivot
        for i in range(j + 1, n):
            s = a[i, j]
            for k in range(j):
                s -= lower[i, k] * lower[j, k]
            lower[i, j] = s * inverse
    for i in range(n):
        for j in range(i + 1, n):
            lower[i, j] = 0.0
    return lost


@inlined_as(types.void(f2, w2, i0, i0))
def solve_lower(lower, b, n, p):
    """b (n, p) <- L⁻¹ b; rows of lost pivots become zero."""
    for i in range(n):
        inverse = 1.0 / lower[i, i] if lower[i, i] > 0.0 else 0.0
        for k in range(i):
            s = lower[i, k]
            for j in range(p):
                b[i, j] -= s * b[k, j]
        for j in range(p):
            b[i, j] *= inverse


@inlined_as(types.void(f2, w2, i0, i0))
def solve_lower_transposed(lower, b, n, p):
    """b (n, p) <- L⁻ᵀ b; rows of lost pivots become zero."""
    for i in range(n - 1, -1, -1):
        inverse = 1.0 / lower[i, i] if lower[i, i] > 0.0 else 0.0
        for k in range(i + 1, n):
            s = lower[k, i]
            for j in range(p):
                b[i, j] -= s * b[k, j]
        for j in range(p):
            b[i, j] *= inverse
