"""Moments of sigma points through a script's own means, residuals and sums, and the update by them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.filterpy.bierman import EPS, root, ud_factor
from sequential.filterpy.linear_update import DOUBT, Update, in_doubt, linear_update, tidy

__all__ = ["Moments", "moments", "residuals", "settled", "sigma_covariance", "sigma_update", "sturdy_points"]

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
    usual = getattr(points.sqrt, "__name__", "") == "cholesky" and "scipy" in points.sqrt.__module__
    own.sqrt = root if usual else partial(sturdy_root, points.sqrt)
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


def through(function: Callable[[Any], Any], points: Array) -> Array:
    """(k, m) what the script's function makes of each point, scalars and columns flattened."""
    return np.array([function(point) for point in points], dtype=np.float64).reshape(len(points), -1)


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


def sigma_covariance(P: Array, dx: Array, df: Array, weights: Array, noise: Array) -> Array:
    """Covariance of moved or observed points with residuals df (k, m), plus noise.

    Where a negative weight makes it indefinite, it is what a line through the points explains of it, from
    residuals dx (k, n) of covariance P, plus what is left in the directions where that is positive.
    """
    cov = df.T @ (weights[:, None] * df) + noise
    cov = tidy(cov)
    if weights.min() >= 0.0 or is_definite(cov):
        return cov
    _, explained, rest = regression(P, dx, df, weights)
    return tidy(explained + rest + noise)


def sigma_update(
    P: Array, dx: Array, seen: tuple[Array, Array], weights: Array, R: Array, inv: Any = np.linalg.inv
) -> Update:
    """Update by what sigma points say: residuals dx (k, n) of the state, `seen` = (dz (k, m), points (k, m)).

    The covariance is Σ w (dx - K dz)(dx - K dz)ᵀ + K R Kᵀ, Joseph's form for sigma points.  Where a negative
    weight spoils it, or S is close to singular, the same statistics are read as a linear sensor H = Pxzᵀ P⁻¹
    whose noise is R and whatever of the spread of dz no line explains, and the update is made by UD.
    """
    dz, points = seen
    weighted = weights[:, None] * dz
    S = dz.T @ weighted + R
    S = 0.5 * (S + S.T)
    Pxz = dx.T @ weighted
    doubtful = inv is np.linalg.inv and in_doubt(S, R)
    if doubtful:
        # below this, a variance is the rounding of the points themselves
        floor = (16 * EPS * np.abs(points).max(axis=0)) ** 2 * np.abs(weights).sum()
        inverse = inverse_above(S, floor)
    else:
        inverse = 1.0 / S if len(S) == 1 and inv is np.linalg.inv else inv(S)
    if inverse is not None:
        K = Pxz @ inverse
        left = dx - dz @ K.T
        after = left.T @ (weights[:, None] * left) + K @ R @ K.T
        after = settled(after, P, weights, trusted=not doubtful and weights.min() >= 0.0)
        if after is not None:
            return Update(K, S, inverse, after)
    H, _, rest = regression(P, dx, dz, weights)
    return linear_update(P, H, R + rest)


def regression(P: Array, dx: Array, df: Array, weights: Array) -> tuple[Array, Array, Array]:
    """The line H (m, n) through sigma points, the covariance it explains, and what is left, if positive."""
    U, d = ud_factor(P)
    half = U * np.sqrt(d)
    back = np.linalg.pinv(half)
    slope = back @ (dx.T @ (weights[:, None] * df))
    explained = slope.T @ slope
    rest = df.T @ (weights[:, None] * df) - explained
    values, vectors = np.linalg.eigh(0.5 * (rest + rest.T))
    rounding = 16 * len(dx) * EPS * np.abs(weights).max() * np.abs(np.diagonal(explained)).max()
    values = np.where(values > rounding, values, 0.0)
    return slope.T @ back, explained, (vectors * values) @ vectors.T


def inverse_above(S: Array, floor: Array) -> Array | None:
    """Inverse of S above a floor (m,) of variances, or None where what lies above is ill-conditioned."""
    sigma = np.sqrt(np.maximum(np.diagonal(S), 0.0))
    scale = np.divide(1.0, sigma, out=np.zeros_like(sigma), where=sigma * sigma > floor)
    values, vectors = np.linalg.eigh(S * np.outer(scale, scale))
    kept = values > max(len(S) * EPS, float((floor * scale * scale).max()))
    if (values[kept] < DOUBT).any():
        return None
    half = scale[:, None] * vectors[:, kept] / np.sqrt(values[kept])
    return np.asarray(half @ half.T)


def settled(cov: Array, before: Array, weights: Array, *, trusted: bool = False) -> Array | None:
    """A covariance made symmetric and without negative rounding; None where it is negative beyond that.

    Rounding is measured by the variances `before`.  A `trusted` covariance is a sum of squares already.
    """
    cov = tidy(cov)
    if trusted or is_definite(cov):
        return cov
    sigma = np.sqrt(np.maximum(np.diagonal(before), 0.0))
    scale = np.divide(1.0, sigma, out=np.zeros_like(sigma), where=sigma > 0.0)
    values, vectors = np.linalg.eigh(cov * np.outer(scale, scale))
    if values.min() < -16 * len(cov) * EPS * np.abs(weights).sum():
        return None
    half = sigma[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(half @ half.T)


def is_definite(P: Array) -> bool:
    """True where a covariance has a Cholesky factor."""
    try:
        np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        return False
    return True
