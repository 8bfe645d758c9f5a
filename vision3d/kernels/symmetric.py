"""Eigenvectors of small symmetric matrices, for kernels that fit planes and rotations."""

from __future__ import annotations

import math

from vision3d.kernels import inlined

__all__ = ["diagonalise", "extreme_column"]

SWEEPS, NOTHING = 30, 1e-30


@inlined
def diagonalise(A, V):
    """Turn A (n, n) into a diagonal by Jacobi's rotations, which V (n, n) gathers in its columns."""
    n = A.shape[0]
    for i in range(n):
        for j in range(n):
            V[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        aside, along = 0.0, 0.0
        for i in range(n):
            along += A[i, i] * A[i, i]
            for j in range(i):
                aside += A[i, j] * A[i, j]
        if not aside > NOTHING * along:
            break
        for p in range(n - 1):
            for q in range(p + 1, n):
                if A[p, q] == 0.0:
                    continue
                ratio = 0.5 * (A[q, q] - A[p, p]) / A[p, q]
                t = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(ratio * ratio + 1.0))
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                for k in range(n):
                    a, b = A[k, p], A[k, q]
                    A[k, p], A[k, q] = c * a - s * b, s * a + c * b
                for k in range(n):
                    a, b = A[p, k], A[q, k]
                    A[p, k], A[q, k] = c * a - s * b, s * a + c * b
                    a, b = V[k, p], V[k, q]
                    V[k, p], V[k, q] = c * a - s * b, s * a + c * b


@inlined
def extreme_column(A, sign):
    """The column of the largest diagonal element (sign 1) or the smallest (sign -1)."""
    best = 0
    for i in range(1, A.shape[0]):
        if sign * A[i, i] > sign * A[best, best]:
            best = i
    return best
