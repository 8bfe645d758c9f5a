"""One update of a belief by a linear reading: Joseph's form, redone in UD form where that is in doubt."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.filterpy.bierman import ud_factor, ud_update

__all__ = ["Update", "correlated_update", "joseph", "linear_update", "log_density", "pseudo_inverse", "tidy"]

Array = NDArray[Any]
Inverse = Callable[[Any], Any]

# A pivot of S below this share of its diagonal: Joseph's form loses digits in proportion to the inverse, and
# a covariance that is a little indefinite grows worse from step to step.
DOUBT = 1e-4
LOG_2PI = math.log(2.0 * math.pi)


class Update(NamedTuple):
    """What a reading does to a covariance."""

    K: Array  # (n, m) gain
    S: Array  # (m, m) covariance of the innovation
    SI: Array  # (m, m) its inverse, on the range of S where S is singular
    P: Array  # (n, n) covariance afterwards


def linear_update(P: Array, H: Array, R: Array, inv: Inverse = np.linalg.inv) -> Update:
    """Update by a reading z = H x + v, v ~ N(0, R), with P and R semi-definite.

    `inv` is the script's choice of an inverse; another one than NumPy's is taken at its word.

    Raises
    ------
    NotFiniteError, NotPositiveDefiniteError
    """
    PHT = P @ H.T
    S = H @ PHT + R
    if inv is np.linalg.inv and in_doubt(S, R):
        U, d = ud_factor(P)
        seen = H @ U
        S = (seen * d) @ seen.T + R
        K, U, d = ud_update(P, H, R)
        return Update(K, S, pseudo_inverse(S), (U * d) @ U.T)
    SI = 1.0 / S if len(S) == 1 and inv is np.linalg.inv else inv(S)
    K = PHT @ SI
    return Update(K, S, SI, joseph(P, H, R, K))


def joseph(P: Array, H: Array, R: Array, K: Array) -> Array:
    """(I - K H) P (I - K H)ᵀ + K R Kᵀ, symmetric to the last bit."""
    left = -(K @ H)
    left.flat[:: len(P) + 1] += 1.0
    return tidy(left @ P @ left.T + K @ R @ K.T)


def tidy(P: Array) -> Array:
    """A covariance made symmetric.

    A variance below zero is what rounding left of larger ones: it becomes zero, and so do its covariances.
    """
    P = 0.5 * (P + P.T)
    variances = np.diagonal(P)
    if variances.min() < 0.0:
        gone = variances < 0.0
        P[gone], P[:, gone] = 0.0, 0.0
    return P


def correlated_update(P: Array, H: Array, R: Array, M: Array, inv: Inverse = np.linalg.inv) -> Update:
    """Update where the error of the state and the noise of the reading have the cross-covariance M (n, m).

    State and noise side by side are one state that is read without noise (Simon 2006, Optimal State
    Estimation, 7.1): what holds for the update above holds here.
    """
    n, m = M.shape
    joint = np.block([[P, M], [M.T, R]])
    wide = np.hstack([H, np.eye(m)])
    cross = joint @ wide.T
    S = wide @ cross
    if inv is np.linalg.inv and in_doubt(S, R):
        K, U, d = ud_update(joint, wide, np.zeros((m, m)))
        return Update(K[:n], S, pseudo_inverse(S), ((U * d) @ U.T)[:n, :n])
    SI = inv(S)
    K = cross[:n] @ SI
    left = np.hstack([np.eye(n) - K @ H, -K])
    return Update(K, S, SI, tidy(left @ joint @ left.T))


def in_doubt(S: Array, R: Array) -> bool:
    """True where S is singular to rounding or close to it, is not finite, or a component is free of noise."""
    if len(S) == 1:
        return not (S[0, 0] > 0.0 and R[0, 0] > 0.0 and S[0, 0] < np.inf)
    if not np.diagonal(R).min() > 0.0:
        return True
    try:
        pivots = np.diagonal(np.linalg.cholesky(S))
    except np.linalg.LinAlgError:
        return True
    return not bool((pivots * pivots > DOUBT * np.diagonal(S)).all())


def pseudo_inverse(S: Array) -> Array:
    """Inverse on the range of a semi-definite S, each component measured in its own standard deviation."""
    sigma = np.sqrt(np.maximum(np.diagonal(S), 0.0))
    scale = np.divide(1.0, sigma, out=np.zeros_like(sigma), where=sigma > 0.0)
    inverse: Array = np.linalg.pinv(S * np.outer(scale, scale), hermitian=True)
    return inverse * np.outer(scale, scale)


def log_density(y: Array, S: Array) -> float:
    """Logarithm of N(y; 0, S), on the range of S where S is singular."""
    r = np.ravel(y)
    if len(r) == 1 and np.size(S) == 1:
        s = float(np.ravel(S)[0])
        return -0.5 * (LOG_2PI + math.log(s) + float(r[0]) ** 2 / s) if s > 0.0 else 0.0
    try:
        lower = np.linalg.cholesky(S)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(S)
        kept = values > len(S) * np.finfo(np.float64).eps * max(float(values.max()), 0.0)
        white, log_det = (vectors.T @ r)[kept] / np.sqrt(values[kept]), np.log(values[kept]).sum()
        return float(-0.5 * (kept.sum() * LOG_2PI + log_det + white @ white))
    white = np.linalg.solve(lower, r)
    return float(-0.5 * (len(r) * LOG_2PI + white @ white) - np.log(np.diagonal(lower)).sum())
