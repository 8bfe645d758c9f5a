"""Least squares of an accelerometer on |reading at rest| = g, with priors, scatter of its own and covariance.

Nine parameters (Tedaldi et al., ICRA 2014, section III): gains s, shears α and offsets o,

    calibrated = (I + L) diag(s) (raw - o),      L strictly lower triangular: α_yx, α_zx, α_zy.

The norm cannot see how the frame is turned; the lower triangle puts its x axis along the accelerometer's, and
its y axis into the plane of the accelerometer's x and y, as Kalibr does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.sensors.prior_fit import Fitted, Scatter, Unknowns, fit_with_scatter, robust_inliers

__all__ = [
    "NAMES",
    "Prior",
    "fit_norm",
    "foreseen",
    "matrix_of",
    "norm_jacobian",
    "norms",
    "steady_dwells",
]

Array = NDArray[np.float64]
NAMES = (
    "gain x",
    "gain y",
    "gain z",
    "misalignment yx",
    "misalignment zx",
    "misalignment zy",
    "offset x",
    "offset y",
    "offset z",
)
SHEARS = ((1, 0), (2, 0), (2, 1))


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
    scatter_weight: float = 1.0


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
) -> Fitted:
    """Most probable parameters for mean readings (K, 3) with covariances (K, 3, 3).

    The scatter of the dwells beyond their noise is found from them, so that few dwells do not pass for exact
    ones.

    Parameters
    ----------
    start : (9,) centre of the prior and first guess
    shears : False leaves the shears at zero: gain and offset per axis
    """
    unknowns = Unknowns(start, _sigmas(start, gravity, prior, shears=shears))
    scatter = Scatter(prior.scatter * gravity, prior.scatter_weight)
    return fit_with_scatter(
        lambda p: _model(p, means, gravity), lambda p: _variance(p, means, covs), unknowns, scatter
    )


def _model(parameters: Array, means: Array, gravity: float) -> tuple[Array, Array]:
    return norms(parameters, means) - gravity, norm_jacobian(parameters, means)


def steady_dwells(
    means: Array, covs: Array, gravity: float, start: Array, prior: Prior, *, shears: bool = True
) -> NDArray[np.bool_]:
    """Dwells (K,) that are not far off a fit which bad ones cannot pull."""
    unknowns = Unknowns(start, _sigmas(start, gravity, prior, shears=shears))
    floor = _variance(start, means, covs) + (5 * prior.scatter * gravity) ** 2
    return robust_inliers(lambda p: _model(p, means, gravity), floor, unknowns)


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
