"""Bierman's UD update in plain NumPy: what a doubtful update is redone with.

P = U D Uᵀ with U unit upper triangular and D ≥ 0 cannot turn indefinite, and a reading is taken in one number
at a time, so that nothing is inverted (Bierman 1977, Factorization Methods for Discrete Sequential
Estimation, V.3).  Noise of zero is a number like any other: a reading that tells nothing new has no gain.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotFiniteError

__all__ = ["root", "ud_factor", "ud_update"]

Array = NDArray[Any]

EPS = float(np.finfo(np.float64).eps)


def ud_factor(P: Array, what: str = "P") -> tuple[Array, Array]:
    """U (n, n) and D (n,) with U D Uᵀ = P for a semi-definite P; pivots lost to rounding become zero.

    So do negative ones: what is not a covariance was refused when the script assigned it, and where all is
    known exactly, what is left of P is the rounding of larger numbers.  Raises `NotFiniteError`.
    """
    if not np.isfinite(P).all():
        msg = f"{what} holds NaN or infinity; find the reading, or the model matrix, that brought it in"
        raise NotFiniteError(msg)
    n = len(P)
    left = 0.5 * (P + P.T)
    scale = np.abs(np.diagonal(left)).copy()
    U, d = np.eye(n), np.zeros(n)
    for j in range(n - 1, -1, -1):
        pivot = left[j, j]
        if pivot <= n * EPS * scale[j]:
            continue
        d[j] = pivot
        U[:j, j] = left[:j, j] / pivot
        left[:j, :j] -= pivot * np.outer(U[:j, j], U[:j, j])
    return U, d


def root(P: Array, what: str = "P") -> Array:
    """A matrix A (n, n) with Aᵀ A = P: the upper Cholesky factor, or where P is singular one from UD."""
    try:
        upper: Array = np.linalg.cholesky(P).T
    except np.linalg.LinAlgError:
        U, d = ud_factor(P, what)
        return (U * np.sqrt(d)).T
    return upper


def ud_update(P: Array, H: Array, R: Array) -> tuple[Array, Array, Array]:
    """Gain (n, m), and U and D after a reading H x + v, v ~ N(0, R); P and R may be singular."""
    n, m = len(P), len(R)
    U, d = ud_factor(P)
    mixing, noise = ud_factor(R, "R")
    # R = L N Lᵀ with L triangular: L⁻¹ z has independent components
    seen = np.linalg.solve(mixing, H)
    gain = np.zeros((n, m))
    for i in range(m):
        k = _scalar_update(U, d, seen[i], noise[i])
        gain -= np.outer(k, seen[i] @ gain)
        gain[:, i] += k
    return np.linalg.solve(mixing.T, gain.T).T, U, d


def _scalar_update(U: Array, d: Array, h: Array, r: float) -> Array:
    """Take in one number hᵀx of variance r, in place; returns its gain (n,)."""
    f = U.T @ h
    if r == 0.0:
        # what is left of a sum after cancellation down to rounding is nothing that was learnt
        f[np.abs(f) <= 4 * len(d) * EPS * (np.abs(U).T @ np.abs(h))] = 0.0
    v = d * f
    ahead, gain = r, np.zeros(len(d))
    for j in range(len(d)):
        before, ahead = ahead, ahead + f[j] * v[j]
        if not ahead > 0.0:
            continue
        d[j] *= before / ahead
        column = U[:, j].copy()
        if before > 0.0:
            change = gain * (f[j] / before)
            kept = column - change
            if r == 0.0:
                kept[np.abs(kept) <= 4 * EPS * (np.abs(column) + np.abs(change))] = 0.0
            U[:, j] = kept
        gain += v[j] * column
    return gain / ahead if ahead > 0.0 else gain
