"""A homography from matches, most of which may be wrong."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from vision3d.robust.backends import search_outside
from vision3d.robust.covariance import pseudo_inverse, unit_norm
from vision3d.robust.found import Found, relative_weights, result_of
from vision3d.robust.model import Addresses, CompiledModel
from vision3d.robust.result import RobustFit
from vision3d.robust.scaling import paired_points, scaled_pairs
from vision3d.robust.search import assess, search
from vision3d.robust.settings import DEFAULT, RansacSettings

__all__ = ["HOMOGRAPHY", "SAMPSON_HOMOGRAPHY", "fit_homography", "transfer", "transfer_cov"]

Array = NDArray[np.float64]


def _load() -> Addresses:
    from vision3d.kernels import robust_homography as kernels

    return Addresses(
        kernels.homography_solve.address, kernels.homography_residuals.address, kernels.homography_fit.address
    )


HOMOGRAPHY = CompiledModel(
    "homography", 4, 4, 9, error_dof=2, freedom=8, inner_size=16, solve_cost=60, redraws=20, load=_load
)


def _load_sampson() -> Addresses:
    from vision3d.kernels import robust_homography, robust_homography_sampson

    return Addresses(
        robust_homography.homography_solve.address,
        robust_homography_sampson.sampson_residuals.address,
        robust_homography_sampson.sampson_fit.address,
    )


SAMPSON_HOMOGRAPHY = replace(HOMOGRAPHY, load=_load_sampson)
MODELS = {"transfer": HOMOGRAPHY, "sampson": SAMPSON_HOMOGRAPHY}


def fit_homography(
    a: Array,
    b: Array,
    settings: RansacSettings = DEFAULT,
    *,
    error: Literal["transfer", "sampson"] = "transfer",
    sigma: Array | float | None = None,
    rng: np.random.Generator | None = None,
) -> RobustFit:
    """Fit b_H_a, the homography that carries points of one image to the other.

    Parameters
    ----------
    a, b : (N, 2) px, matched row by row; best first for PROSAC's order
    settings : the threshold is of that error, in px
    error : "transfer" is the distance in b of the point carried over: the noise is that of b, as where a is a
        drawing; "sampson" the distance in both images from the nearest exact match: both are as noisy.  They
        differ where the scale does, as in a plane seen at a slant
    sigma : px, of a coordinate of each match (N,) or of all; without it the errors seen give it
    rng : where the seed comes from; the same without it every time

    Returns
    -------
    RobustFit
        model (3, 3) of unit Frobenius norm, its third coordinate positive on the inliers; cov (9, 9) of its
        elements row by row, in that normalisation (rank 8: nothing along the model itself).  `transfer_cov`
        turns it into the uncertainty of points carried over.

    Raises
    ------
    DataError
        for points that do not pair, are not finite, or are fewer than four.
    UnderConstrainedError
        where the points of an image are all equal or on one line, or no four of them make a homography.

    Notes
    -----
    Four-point samples, Gauss-Newton on the error (Hartley, Zisserman 2004, sections 4.2.2 and 4.2.6).
    """
    a, b = paired_points(a, b, 2, 4, "homography")
    rows, to_a, to_b, scale = scaled_pairs(a, b)
    weights, inside = relative_weights(sigma, len(a)), replace(settings, threshold=settings.threshold / scale)
    from_b = np.linalg.inv(to_b)
    if error not in MODELS:
        raise ModelError(f"error is one of {', '.join(MODELS)}; got {error!r}")
    model = MODELS[error]
    if settings.backend == "own":
        found = search(model, rows, inside, weights, rng)
    else:
        outside = search_outside("homography", a, b, settings, rng)
        start = _facing(to_b @ outside.model @ np.linalg.inv(to_a), rows)
        found = assess(model, rows, inside, weights, start.ravel(), outside)
    sigma2 = found.variance(sigma, scale)
    cov = sigma2 * _inverse_information(rows, found, error)
    change = np.kron(from_b, to_a.T)
    H, cov = unit_norm(change @ found.model, change @ cov @ change.T)
    return result_of(found, H.reshape(3, 3), cov, scale=scale)


def _facing(H: Array, rows: Array) -> Array:
    """H of unit norm, signed so that most points lie before the second camera."""
    third = np.column_stack([rows[:, :2], np.ones(len(rows))]) @ H[2]
    return np.asarray(H * (np.copysign(1.0, np.median(third)) / np.linalg.norm(H)))


def _inverse_information(rows: Array, found: Found, error: str) -> Array:
    """The covariance (9, 9) of the elements for errors of unit sigma."""
    if error == "transfer":
        from vision3d.kernels.robust_homography import normal_equations as equations
    else:
        from vision3d.kernels.robust_homography_sampson import sampson_normal_equations as equations

    N, g = np.empty((9, 9)), np.empty(9)
    equations(rows, found.weights, found.model, N, g)
    return pseudo_inverse(N, found.model[None])


def transfer(H: Array, points: Array) -> Array:
    """Points (N, 2) carried over by H (3, 3); infinite or NaN on its horizon."""
    moved = np.column_stack([points, np.ones(len(points))]) @ np.asarray(H).T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(moved[:, :2] / moved[:, 2:])


def transfer_cov(H: Array, cov: Array, points: Array) -> Array:
    """Covariances (N, 2, 2) of points (N, 2) carried over by H with cov (9, 9); the points are exact."""
    homogeneous = np.column_stack([points, np.ones(len(points))])
    third = homogeneous @ np.asarray(H)[2]
    seen = transfer(H, points)
    slope = np.zeros((len(homogeneous), 2, 9))
    slope[:, 0, :3] = slope[:, 1, 3:6] = homogeneous / third[:, None]
    slope[:, :, 6:] = -seen[:, :, None] * (homogeneous / third[:, None])[:, None, :]
    return np.asarray(slope @ cov @ slope.transpose(0, 2, 1))
