"""Moments of sigma points through a script's own means, residuals and sums, and the update by them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.filterpy.bierman import root, ud_factor
from sequential.filterpy.linear_update import Update, in_doubt, linear_update

__all__ = ["Moments", "moments", "residuals", "sigma_update", "sturdy_points"]

Array = NDArray[Any]
Difference = Callable[[Any, Any], Any]


class Moments(NamedTuple):
    """Mean (n,) of sigma points, and their residuals (k, n) about it."""

    mean: Array
    residuals: Array


def sturdy_points(points: Any) -> Any:
    """The script's own sigma points, which also draw from a singular covariance."""
    if getattr(points, "sqrt", None) is None:
        return points
    own = copy.copy(points)
    own.sqrt = partial(sturdy_root, points.sqrt)
    return own


def sturdy_root(given: Callable[[Any], Any], P: Array) -> Array:
    """What the script's root gives, or one from UD where that fails: A with Aᵀ A = P."""
    try:
        factor = np.asarray(given(P))
        if np.isfinite(factor).all():
            return factor
    except (np.linalg.LinAlgError, ValueError):
        pass
    return root(P)


def residuals(sigmas: Array, mean: Any, difference: Difference) -> Array:
    """(k, n) each point minus the mean, as the script subtracts."""
    if difference is np.subtract:
        return np.asarray(sigmas - mean)
    return np.array([np.ravel(difference(point, mean)) for point in sigmas], dtype=np.float64)


def moments(
    sigmas: Array,
    weights: Array,
    mean_fn: Callable[..., Any] | None,
    difference: Difference,
    add: Any = np.add,
) -> Moments:
    """Mean and residuals of sigma points (k, n).

    Without a `mean_fn` of the script the mean is taken about the first point, by the script's own residual:
    where numbers wrap, a plain mean, and a mean of sines and cosines under a negative weight, lie on the
    wrong side of the circle.
    """
    if mean_fn is not None:
        mean = np.ravel(np.asarray(mean_fn(sigmas, weights), dtype=np.float64))
    elif difference is np.subtract:
        mean = weights @ sigmas
    else:
        about = residuals(sigmas, sigmas[0], difference)
        mean = np.ravel(np.asarray(add(sigmas[0], weights @ about), dtype=np.float64))
    return Moments(mean, residuals(sigmas, mean, difference))


def sigma_update(
    P: Array, dx: Array, dz: Array, weights: Array, R: Array, inv: Any = np.linalg.inv
) -> Update:
    """Update by what sigma points say: residuals dx (k, n) of the state and dz (k, m) of the reading.

    The covariance is Σ w (dx - K dz)(dx - K dz)ᵀ + K R Kᵀ, Joseph's form for sigma points.  A negative weight
    can still spoil it, or S be singular; then the same statistics are read as a linear sensor H = Pxzᵀ P⁻¹
    whose noise is R and whatever of the spread of dz no line explains, and the update is made by UD.
    """
    weighted = weights[:, None] * dz
    S = dz.T @ weighted + R
    Pxz = dx.T @ weighted
    plain = inv is np.linalg.inv
    if not (plain and in_doubt(S, R)):
        SI = inv(S)
        K = Pxz @ SI
        left = dx - dz @ K.T
        after = left.T @ (weights[:, None] * left) + K @ R @ K.T
        after = 0.5 * (after + after.T)
        if (weights >= 0.0).all() or is_definite(after):
            return Update(K, S, SI, after)
    U, d = ud_factor(P)
    half = U * np.sqrt(d)
    H = (np.linalg.pinv(half) @ Pxz).T @ np.linalg.pinv(half)
    spread = S - R - H @ P @ H.T
    values, vectors = np.linalg.eigh(0.5 * (spread + spread.T))
    rounding = len(P) * np.finfo(np.float64).eps * np.abs(weights).max() * np.abs(np.diagonal(S)).max()
    values = np.where(values > rounding, values, 0.0)
    return linear_update((half @ half.T), H, R + (vectors * values) @ vectors.T)


def is_definite(P: Array) -> bool:
    """True where a covariance has a Cholesky factor."""
    try:
        np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        return False
    return True
