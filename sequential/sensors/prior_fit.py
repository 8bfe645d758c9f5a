"""Nonlinear least squares with a Gaussian prior, and a scatter of the readings that is found on the way.

What calibrations share: few readings, many unknowns, and errors beyond the noise (non-linearity, temperature,
a hand that trembles) whose size nobody knows before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotConvergedError

__all__ = ["Fitted", "Scatter", "Unknowns", "fit_with_scatter", "maximise", "robust_inliers"]

Array = NDArray[np.float64]
Model = Callable[
    [Array], tuple[Array, Array]
]  # parameters (p,) to residuals (m,) and their derivative (m, p)
ITERATIONS = 1000


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """Centre (p,) of the prior, which is the first guess too, and its standard deviations (p,)."""

    centre: Array
    sigmas: Array


@dataclass(frozen=True, slots=True)
class Scatter:
    """Standard deviation expected beyond the noise, and how many readings that guess is worth."""

    guess: float
    weight: float = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """Most probable parameters (p,), covariance (p, p), and what came of the residuals (m,).

    `kept` (p,) is the posterior standard deviation over the prior one: 1 where the data say nothing.
    `freedom` is the number of readings less what they determine.
    """

    parameters: Array
    cov: Array
    residual: Array
    jacobian: Array
    variance: Array
    scatter: float
    freedom: float
    kept: Array


def fit_with_scatter(
    model: Model, noise: Callable[[Array], Array], unknowns: Unknowns, scatter: Scatter
) -> Fitted:
    """Fit, with the scatter at the maximum of its marginal likelihood (parameters integrated out).

    Parameters
    ----------
    model : residuals and Jacobian at given parameters
    noise : variance (m,) of the residuals without the scatter, at given parameters
    """
    parameters, level = unknowns.centre.copy(), 100 * scatter.guess
    for _ in range(20):
        parameters = maximise(model, noise(parameters) + level**2, unknowns, parameters)
        before, own = level, noise(parameters)
        level = _likely_scatter(model(parameters), own, parameters, unknowns, scatter)
        if abs(level - before) <= 1e-2 * level:
            break
    variance = noise(parameters) + level**2
    parameters = maximise(model, variance, unknowns, parameters)
    residual, J = model(parameters)
    scaled = J * unknowns.sigmas
    information = scaled.T @ (scaled / variance[:, None])
    cov = np.linalg.inv(information + np.eye(len(parameters)))
    return Fitted(
        parameters,
        cov * np.outer(unknowns.sigmas, unknowns.sigmas),
        residual,
        J,
        variance,
        level,
        len(residual) - float(np.trace(cov @ information)),
        np.sqrt(np.diag(cov)),
    )


def maximise(model: Model, variance: Array, unknowns: Unknowns, start: Array) -> Array:
    """Most probable parameters (p,) for known variances (m,): Levenberg-Marquardt.

    Raises
    ------
    NotConvergedError
    """
    weight, sigmas = 1 / np.sqrt(variance), unknowns.sigmas

    def whitened(x: Array) -> tuple[Array, Array]:
        r, J = model(unknowns.centre + sigmas * x)
        return np.concatenate([r * weight, x]), np.vstack([J * sigmas * weight[:, None], np.eye(len(x))])

    x, damping = (start - unknowns.centre) / sigmas, 1e-6
    r, J = whitened(x)
    for _ in range(ITERATIONS):
        H = J.T @ J
        step = -np.linalg.solve(H + damping * np.diag(np.diag(H)), J.T @ r)
        again, J_again = whitened(x + step)
        gained = float(r @ r - again @ again)
        if gained >= 0:
            x, r, J, damping = x + step, again, J_again, max(damping / 10, 1e-12)
            # a step too small for a digit, or a valley along which nothing is to be gained
            if np.abs(step).max() <= 1e-9 * (1 + np.abs(x).max()) or gained <= 1e-13 * (1 + r @ r):
                return np.asarray(unknowns.centre + sigmas * x)
        else:
            damping *= 10
            if damping > 1e8:  # nothing below: rounding is all that is left
                return np.asarray(unknowns.centre + sigmas * x)
    raise NotConvergedError(
        f"the calibration did not settle in {ITERATIONS} steps: are all dwells still, and in one unit?"
    )


def robust_inliers(
    model: Model, noise: Array, unknowns: Unknowns, *, width: int = 1, rounds: int = 30
) -> NDArray[np.bool_]:
    """Groups of `width` residuals (m / width,) that are not far off a fit which bad ones cannot pull.

    Cauchy's loss, reweighted from equal weights on; `noise` (m,) is a variance that no scale goes below.
    """
    parameters, off = unknowns.centre, np.zeros(len(noise) // width)
    floor = noise.reshape(-1, width).mean(axis=1)
    variance = np.full(len(off), float(np.sum(model(parameters)[0] ** 2)) / len(noise) + floor.max())
    scale = np.sqrt(variance)
    for _ in range(rounds):
        parameters = maximise(model, np.repeat(variance, width), unknowns, parameters)
        before, off = off, np.linalg.norm(model(parameters)[0].reshape(-1, width), axis=1)
        scale = np.sqrt((1.4826 * np.median(off)) ** 2 + floor)
        variance = scale**2 * (1 + (off / (2.385 * scale)) ** 2)
        if np.abs(off - before).max() <= 0.01 * scale.min():
            break
    return np.asarray(off <= 8 * scale)


def _likely_scatter(
    at: tuple[Array, Array], own: Array, parameters: Array, unknowns: Unknowns, scatter: Scatter
) -> float:
    """Scatter that makes the readings, as seen from the prior, most probable."""
    residual, J = at
    innovation = residual + J @ (unknowns.centre - parameters)
    scaled = J * unknowns.sigmas
    push = scaled @ scaled.T

    def cost(log: float) -> float:
        extra = np.exp(2 * log)
        lower = np.linalg.cholesky(push + np.diag(own + extra))
        white = np.linalg.solve(lower, innovation)
        fitness = float(0.5 * white @ white + np.log(np.diag(lower)).sum())
        return fitness + scatter.weight * float(log + 0.5 * scatter.guess**2 / extra)

    grid = np.log(scatter.guess) + np.linspace(-3.0, 7.0, 26)
    best = int(np.argmin([cost(log) for log in grid]))
    return float(np.exp(_golden(cost, grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])))


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
