"""Lines in the plane and planes in space, from points most of which may lie elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, ModelError, UnderConstrainedError
from vision3d.robust.found import relative_weights, result_of
from vision3d.robust.model import Addresses, CompiledModel
from vision3d.robust.result import RobustFit
from vision3d.robust.scaling import checked_points, spread
from vision3d.robust.search import search
from vision3d.robust.settings import RansacSettings

__all__ = ["LINE", "PLANE", "fit_line", "fit_plane"]

Array = NDArray[np.float64]


def _load_line() -> Addresses:
    from vision3d.kernels import robust_flats as kernels

    return Addresses(kernels.line_solve.address, kernels.flat_residuals.address, kernels.flat_fit.address)


def _load_plane() -> Addresses:
    from vision3d.kernels import robust_flats as kernels

    return Addresses(kernels.plane_solve.address, kernels.flat_residuals.address, kernels.flat_fit.address)


LINE = CompiledModel("line", 2, 2, 3, freedom=2, solve_cost=20, load=_load_line)
PLANE = CompiledModel("plane", 3, 3, 4, freedom=3, solve_cost=30, load=_load_plane)


def fit_line(
    points: Array,
    settings: RansacSettings,
    *,
    sigma: Array | float | None = None,
    rng: np.random.Generator | None = None,
) -> RobustFit:
    """Fit a line to points in the plane.

    Parameters
    ----------
    points : (N, 2) in any unit
    settings : the threshold is a distance from the line, in that unit
    sigma : of each point's distance (N,), or of all; without it the errors seen give it
    rng : where the seed comes from; the same without it every time

    Returns
    -------
    RobustFit
        model (3,): unit normal n and offset d >= 0 of n · x = d; cov (3, 3) of those numbers, of rank 2.

    Raises
    ------
    DataError
        for fewer than two points, or points that are not finite.
    UnderConstrainedError
        where all points are one.
    """
    return _fit_flat(LINE, points, settings, sigma, rng)


def fit_plane(
    points: Array,
    settings: RansacSettings,
    *,
    sigma: Array | float | None = None,
    rng: np.random.Generator | None = None,
) -> RobustFit:
    """Fit a plane to points in space.

    Parameters
    ----------
    points : (N, 3) in any unit
    settings : the threshold is a distance from the plane, in that unit
    sigma : of each point's distance (N,), or of all; without it the errors seen give it
    rng : where the seed comes from; the same without it every time

    Returns
    -------
    RobustFit
        model (4,): unit normal n and offset d >= 0 of n · x = d; cov (4, 4) of those numbers, of rank 3.

    Raises
    ------
    DataError
        for fewer than three points, or points that are not finite.
    UnderConstrainedError
        where all points are one, or lie on one line.
    """
    return _fit_flat(PLANE, points, settings, sigma, rng)


def _fit_flat(
    model: CompiledModel,
    points: Array,
    settings: RansacSettings,
    sigma: Array | float | None,
    rng: np.random.Generator | None,
) -> RobustFit:
    """Either of them: search among centred and scaled points, then undo that."""
    if settings.backend != "own":
        raise ModelError(f"the backend {settings.backend} has no {model.name}; take backend='own'")
    given = checked_points(points, model.columns, "points")
    if len(given) < model.sample_size:
        raise DataError(f"a {model.name} takes {model.sample_size} points or more; got {len(given)}")
    middle, scale = given.mean(axis=0), spread(given)
    if not scale > 0.0:
        raise UnderConstrainedError(f"all {len(given)} points are one and the same, {given[0]}")
    rows = np.ascontiguousarray((given - middle) / scale)
    inside = replace(settings, threshold=settings.threshold / scale)
    found = search(model, rows, inside, relative_weights(sigma, len(rows)), rng)
    sigma2 = found.variance(sigma, scale)
    normal, offset = found.model[:-1], scale * found.model[-1] + found.model[:-1] @ middle
    side = -1.0 if offset < 0.0 else 1.0
    cov = _covariance(given - middle, found.weights, normal, middle, scale**2 * sigma2)
    return result_of(found, side * np.array([*normal, offset]), cov, scale=scale)


def _covariance(off: Array, weights: Array, normal: Array, middle: Array, sigma2: float) -> Array:
    """Of (normal, offset): turns about the tangents and a shift, n and d both moving with a turn."""
    k = len(normal)
    tangents = np.linalg.svd(normal[None])[2][1:]  # (k - 1, k)
    slope = np.column_stack([off @ tangents.T, -np.ones(len(off))])
    information = slope.T @ (slope * weights[:, None])
    if np.linalg.matrix_rank(information, hermitian=True) < k:
        return np.full((k + 1, k + 1), np.nan)
    outward = np.zeros((k + 1, k))
    outward[:k, : k - 1] = tangents.T
    outward[k, : k - 1] = tangents @ middle
    outward[k, k - 1] = 1.0
    return np.asarray(sigma2 * outward @ np.linalg.inv(information) @ outward.T)
