"""Least squares of an accelerometer on |reading at rest| = g, with priors, scatter of its own and covariance.

Nine parameters (Tedaldi et al., ICRA 2014, section III): gains s, shears α and offsets o,

    calibrated = (I + L) diag(s) (raw - o),      L strictly lower triangular: α_yx, α_zx, α_zy.

The norm cannot see how the frame is turned; the lower triangle puts its x axis along the accelerometer's, and
its y axis into the plane of the accelerometer's x and y, as Kalibr does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotConvergedError

__all__ = [
    "NAMES",
    "GravityFit",
    "Prior",
    "fit_norm",
    "foreseen",
    "matrix_of",
    "norm_jacobian",
    "norms",
    "robust_inliers",
]

Array = NDArray[np.float64]
NAMES = ("gain x", "gain y", "gain z", "shear yx", "shear zx", "shear zy", "offset x", "offset y", "offset z")
SHEARS = ((1, 0), (2, 0), (2, 1))
ITERATIONS = 100


@dataclass(frozen=True, slots=True)
class Prior:
    """What is known of any accelerometer before it is looked at: one standard deviation each.

    Parameters
    ----------
    gain : relative to the other axes
    shear : rad; chips are specified to 1 or 2 %
    offset : over g
    scatter, scatter_weight : of a dwell's |mean| over g beyond its noise (non-linearity, temperature,
        mounting), and how many dwells that guess is worth
    """

    gain: float = 0.1
    shear: float = 0.02
    offset: float = 0.5
    scatter: float = 1e-4
    scatter_weight: float = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class GravityFit:
    """Parameters (9,) in the order of `NAMES`, their covariance, and what the prior is left to say.

    `scatter` is the standard deviation of |mean| beyond the dwell's own noise, in units of g times g;
    `kept` (9,) is the posterior standard deviation over the prior one: 1 where the data say nothing.
    """

    parameters: Array
    cov: Array
    residual: Array  # (K,) |calibrated| - g, in the unit of g
    scatter: float
    freedom: float  # dwells less what they determine
    kept: Array


def matrix_of(parameters: Array) -> Array:
    """Matrix (3, 3) of the calibration from its parameters (9,)."""
    shear = np.eye(3)
    for value, place in zip(parameters[3:6], SHEARS, strict=True):
        shear[place] = value
    return shear * parameters[:3]


def norms(parameters: Array, means: Array) -> Array:
    """|calibrated| (K,) of mean readings (K, 3)."""
    return np.asarray(np.linalg.norm((means - parameters[6:]) @ matrix_of(parameters).T, axis=1))


def norm_jacobian(parameters: Array, means: Array) -> Array:
    """Derivative (K, 9) of |calibrated|."""
    matrix = matrix_of(parameters)
    centred = means - parameters[6:]
    calibrated = centred @ matrix.T
    unit = calibrated / np.linalg.norm(calibrated, axis=1)[:, None]
    gained = centred * parameters[:3]
    shear = matrix / parameters[:3]
    shears = np.stack([unit[:, a] * gained[:, b] for a, b in SHEARS], axis=1)
    return np.hstack([(unit @ shear) * centred, shears, -(unit @ matrix)])


def fit_norm(
    means: Array, covs: Array, gravity: float, start: Array, prior: Prior, *, shears: bool = True
) -> GravityFit:
    """Most probable parameters for mean readings (K, 3) with covariances (K, 3, 3).

    The scatter of the dwells beyond their noise is the maximum of its marginal likelihood (all parameters
    integrated out), so that few dwells do not pass for exact ones.

    Parameters
    ----------
    start : (9,) centre of the prior and first guess
    shears : False leaves the shears at zero: gain and offset per axis
    """
    sigmas = _sigmas(start, gravity, prior, shears=shears)
    scatter, parameters = 1e-2 * gravity, start.copy()
    for _ in range(20):
        variance = _variance(parameters, means, covs) + scatter**2
        parameters = _maximise(parameters, means, gravity, variance, start, sigmas)
        own = _variance(parameters, means, covs)
        expected = gravity - norms(parameters, means)
        J = norm_jacobian(parameters, means) * sigmas
        innovation = expected - J @ ((start - parameters) / sigmas)
        again = _scatter(innovation, J, own, gravity, prior)
        if abs(again - scatter) <= 1e-3 * again:
            scatter = again
            break
        scatter = again
    variance = _variance(parameters, means, covs) + scatter**2
    parameters = _maximise(parameters, means, gravity, variance, start, sigmas)
    J = norm_jacobian(parameters, means) * sigmas
    cov = np.linalg.inv(J.T @ (J / variance[:, None]) + np.eye(9))
    freedom = len(means) - float(np.trace(cov @ (J.T @ (J / variance[:, None]))))
    return GravityFit(
        parameters,
        cov * np.outer(sigmas, sigmas),
        norms(parameters, means) - gravity,
        scatter,
        freedom,
        np.sqrt(np.diag(cov)),
    )


def robust_inliers(
    means: Array, covs: Array, gravity: float, start: Array, prior: Prior, *, shears: bool = True
) -> NDArray[np.bool_]:
    """Dwells (K,) that are not far off a fit which bad ones cannot pull: Cauchy's loss, reweighted."""
    sigmas = _sigmas(start, gravity, prior, shears=shears)
    parameters, variance = start.copy(), np.full(len(means), (0.05 * gravity) ** 2)
    scale = np.sqrt(variance)
    for _ in range(30):
        parameters = _maximise(parameters, means, gravity, variance, start, sigmas)
        off = np.abs(norms(parameters, means) - gravity)
        floor = _variance(parameters, means, covs) + (5 * prior.scatter * gravity) ** 2
        scale = np.sqrt((1.4826 * np.median(off)) ** 2 + floor)
        variance = scale**2 * (1 + (off / (2.385 * scale)) ** 2)
    return np.asarray(np.abs(norms(parameters, means) - gravity) <= 8 * scale)


def foreseen(means: Array, gravity: float, start: Array, prior: Prior, *, shears: bool = True) -> Array:
    """Covariance (9, 9) of the parameters over the prior's, from the directions alone, before any fit."""
    sigmas = _sigmas(start, gravity, prior, shears=shears)
    J = norm_jacobian(start, means) * sigmas / (1e-3 * gravity)
    return np.asarray(np.linalg.inv(J.T @ J + np.eye(9)))


def _sigmas(start: Array, gravity: float, prior: Prior, *, shears: bool) -> Array:
    """Standard deviations (9,) of the prior in the units of the parameters."""
    gain = float(np.mean(start[:3]))
    return np.repeat([prior.gain * gain, prior.shear if shears else 1e-12, prior.offset * gravity / gain], 3)


def _variance(parameters: Array, means: Array, covs: Array) -> Array:
    """Variance of |calibrated| (K,) from the noise of the means."""
    slope = norm_jacobian(parameters, means)[:, 6:]
    return np.asarray(np.einsum("ki,kij,kj->k", slope, covs, slope))


def _maximise(
    parameters: Array, means: Array, gravity: float, variance: Array, centre: Array, sigmas: Array
) -> Array:
    """Levenberg-Marquardt on the whitened residuals and the prior."""
    weight = 1 / np.sqrt(variance)

    def residuals(x: Array) -> Array:
        return np.concatenate([(norms(centre + sigmas * x, means) - gravity) * weight, x])

    x, damping = (parameters - centre) / sigmas, 1e-6
    r = residuals(x)
    for _ in range(ITERATIONS):
        J = np.vstack([norm_jacobian(centre + sigmas * x, means) * sigmas * weight[:, None], np.eye(9)])
        gradient, H = J.T @ r, J.T @ J
        step = -np.linalg.solve(H + damping * np.diag(np.diag(H)), gradient)
        tried = residuals(x + step)
        if tried @ tried <= r @ r:
            gained = r @ r - tried @ tried
            x, r, damping = x + step, tried, max(damping / 10, 1e-12)
            # a step too small for a digit, or a valley along which nothing is to be gained
            if np.abs(step).max() <= 1e-10 * (1 + np.abs(x).max()) or gained <= 1e-14 * (1 + r @ r):
                return np.asarray(centre + sigmas * x)
        else:
            damping *= 10
            if damping > 1e8:  # nothing below: rounding is all that is left
                return np.asarray(centre + sigmas * x)
    raise NotConvergedError(
        f"the accelerometer's fit did not settle in {ITERATIONS} steps: are all dwells still and in one unit?"
    )


def _scatter(innovation: Array, J: Array, own: Array, gravity: float, prior: Prior) -> float:
    """Standard deviation beyond the noise that makes the innovations most probable."""
    push = J @ J.T

    def cost(log: float) -> float:
        V = push + np.diag(own + np.exp(2 * log))
        lower = np.linalg.cholesky(V + 1e-15 * np.trace(V) / len(V) * np.eye(len(V)))
        white = np.linalg.solve(lower, innovation)
        guess = prior.scatter_weight * (log + 0.5 * (prior.scatter * gravity) ** 2 * np.exp(-2 * log))
        return float(0.5 * white @ white + np.log(np.diag(lower)).sum() + guess)

    grid = np.log(prior.scatter * gravity) + np.linspace(-3.0, 7.0, 26)
    best = int(np.argmin([cost(log) for log in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    return float(np.exp(_golden(cost, low, high)))


def _golden(cost: Callable[[float], float], low: float, high: float) -> float:
    """Minimum of a function of one variable between two bounds, to a hundredth."""
    ratio = (5**0.5 - 1) / 2
    while high - low > 0.01:
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        if cost(a) < cost(b):
            high = b
        else:
            low = a
    return (low + high) / 2
