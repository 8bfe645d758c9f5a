"""A fundamental matrix from matches, most of which may be wrong, and many of which may lie on one plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import UnderConstrainedError
from vision3d.robust.backends import search_outside
from vision3d.robust.covariance import pseudo_inverse, unit_norm
from vision3d.robust.found import Found, relative_weights, result_of
from vision3d.robust.homography import HOMOGRAPHY
from vision3d.robust.model import Addresses, CompiledModel
from vision3d.robust.result import RobustFit
from vision3d.robust.scaling import paired_points, scaled_pairs, similarity_about, spread
from vision3d.robust.search import assess, refined, search
from vision3d.robust.settings import RansacSettings

__all__ = ["FUNDAMENTAL", "eight_point", "epipolar_distances", "fit_fundamental"]

Array = NDArray[np.float64]
WITHIN_PX = RansacSettings(threshold=1.5, inner_samples=5)
ON_PLANE = 0.5  # share of the inliers on one plane from which on it is looked into
WIDER = 2.0  # a plane's transfer error against Sampson's, which is shared between the images
PAIRS = 1000
TOLD = 0.8  # share from which on the result says so


def _load() -> Addresses:
    from vision3d.kernels import robust_fundamental as kernels

    return Addresses(
        kernels.fundamental_solve.address,
        kernels.fundamental_residuals.address,
        kernels.fundamental_fit.address,
    )


FUNDAMENTAL = CompiledModel(
    "fundamental matrix",
    7,
    4,
    9,
    max_solutions=3,
    error_dof=1,
    freedom=7,
    inner_size=21,
    solve_cost=600,
    load=_load,
)


def fit_fundamental(
    a: Array,
    b: Array,
    settings: RansacSettings = WITHIN_PX,
    *,
    sigma: Array | float | None = None,
    rng: np.random.Generator | None = None,
) -> RobustFit:
    """Fit F with (b, 1) F (a, 1)ᵀ = 0 for every match.

    Parameters
    ----------
    a, b : (N, 2) px, matched row by row; best first for PROSAC's order
    settings : the threshold is Sampson's distance, in px; 1.5 by default
    sigma : px, of a coordinate of each match (N,) or of all; without it the errors seen give it
    rng : where the seed comes from; the same without it every time

    Returns
    -------
    RobustFit
        model (3, 3) of unit Frobenius norm and rank 2; cov (9, 9) of its elements row by row within those two
        constraints (rank 7).  `note` says so where most matches lie on one plane, as F is then little more
        than that plane's homography.

    Raises
    ------
    DataError
        for points that do not pair, are not finite, or are fewer than seven.
    UnderConstrainedError
        where the points of an image are all equal or on one line.

    Notes
    -----
    Seven-point samples (Hartley, Zisserman 2004, section 11.1.2), Gauss-Newton on Sampson's distance; a
    dominant plane is met by plane and parallax (Chum, Werner, Matas 2005).
    """
    a, b = paired_points(a, b, 2, 7, "fundamental matrix")
    rows, to_a, to_b, scale = scaled_pairs(a, b)
    weights, inside = relative_weights(sigma, len(a)), replace(settings, threshold=settings.threshold / scale)
    if settings.backend == "own":
        found = search(FUNDAMENTAL, rows, inside, weights, rng)
        found, note = _off_a_plane(found, rows, inside, weights, rng)
    else:
        outside, note = search_outside("fundamental", a, b, settings, rng), ""
        F = np.linalg.inv(to_b).T @ outside.model @ np.linalg.inv(to_a)
        found = assess(FUNDAMENTAL, rows, inside, weights, F.ravel() / np.linalg.norm(F), outside)
    sigma2 = found.variance(sigma, scale)
    change = np.kron(to_b.T, to_a.T)
    F, cov = unit_norm(change @ found.model, change @ (sigma2 * _covariance(rows, found)) @ change.T)
    return result_of(found, F.reshape(3, 3), cov, scale=scale, note=note)


def _off_a_plane(
    found: Found, rows: Array, settings: RansacSettings, weights: Array, rng: np.random.Generator | None
) -> tuple[Found, str]:
    """Find out whether one plane holds most inliers, and if so, whether plane and parallax do better."""
    from vision3d.kernels.robust_parallax import plane_and_parallax

    inliers = np.flatnonzero(found.errors2 < found.threshold2)
    wider = replace(settings, threshold=WIDER * float(np.sqrt(found.threshold2)), method="ransac")
    if len(inliers) < HOMOGRAPHY.sample_size + 1:
        return found, ""
    try:
        plane = search(HOMOGRAPHY, rows[inliers], replace(wider, max_iterations=200), weights[inliers], rng)
    except UnderConstrainedError:
        return found, "the inliers lie on lines: they leave the fundamental matrix open"
    if np.count_nonzero(plane.errors2 < plane.threshold2) < ON_PLANE * len(inliers):
        return found, ""
    errors = _transfer_errors2(plane.model, rows)
    off = np.flatnonzero(~(errors * weights < plane.threshold2))
    if len(off) >= 2:
        limit = float(np.minimum(found.errors2, found.threshold2).sum())
        with FUNDAMENTAL.functions() as f:
            addresses, model = np.array([f.solve, f.residuals, f.fit], np.int64), np.zeros(9)
            seed = np.uint64(0 if rng is None else rng.integers(1 << 63))
            cost = plane_and_parallax(
                rows, weights, addresses, off, plane.model, found.threshold2, limit, PAIRS, seed, model
            )
        if cost < limit:
            found = refined(FUNDAMENTAL, rows, settings, weights, replace(found, model=model))
            inliers = np.flatnonzero(found.errors2 < found.threshold2)
    share = float(np.mean(errors[inliers] * weights[inliers] < plane.threshold2))
    if share < TOLD:
        return found, ""
    return found, (
        f"{share:.0%} of the inliers lie on one plane: where all do, only a homography is determined, and "
        f"the {len(inliers) - round(share * len(inliers))} others decide on the rest"
    )


def _transfer_errors2(H: Array, rows: Array) -> Array:
    moved = np.column_stack([rows[:, :2], np.ones(len(rows))]) @ H.reshape(3, 3).T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.sum((moved[:, :2] / moved[:, 2:] - rows[:, 2:]) ** 2, axis=1))


def _covariance(rows: Array, found: Found) -> Array:
    """The covariance (9, 9) of the elements for errors of unit sigma."""
    from vision3d.kernels.robust_fundamental import normal_equations

    F = found.model.reshape(3, 3)
    N, g = np.empty((9, 9)), np.empty(9)
    normal_equations(rows, found.weights, found.model, N, g)
    columns = [np.cross(F[(i + 1) % 3], F[(i + 2) % 3]) for i in range(3)]  # the determinant's derivative
    slope = np.concatenate(columns)
    return pseudo_inverse(N, np.array([found.model, slope / np.linalg.norm(slope)]))


def eight_point(a: Array, b: Array, weights: Array | None = None) -> Array:
    """F (3, 3) of unit norm by the normalised eight-point algorithm (Hartley 1997), of rank 2.

    Least squares of the algebraic error: for eight matches or more (N, 2), all of them right.

    Raises
    ------
    DataError
        for points that do not pair, are not finite, or are fewer than eight.
    """
    a, b = paired_points(a, b, 2, 8, "linear fundamental matrix")
    to_a, to_b = (similarity_about(p, spread(p) / np.sqrt(2.0)) for p in (a, b))
    x, u = (np.column_stack([p @ t[:2, :2] + t[:2, 2], np.ones(len(p))]) for p, t in ((a, to_a), (b, to_b)))
    system = (u[:, :, None] * x[:, None, :]).reshape(-1, 9)
    if weights is not None:
        system = system * np.sqrt(weights)[:, None]
    F = np.linalg.svd(system, full_matrices=True)[2][8].reshape(3, 3)
    left, values, right = np.linalg.svd(F)
    F = to_b.T @ (left[:, :2] * values[:2]) @ right[:2] @ to_a
    return np.asarray(F / np.linalg.norm(F))


def epipolar_distances(F: Array, a: Array, b: Array) -> tuple[Array, Array]:
    """Distances (N,) of points a from the lines of b in the first image, and of b from those of a, in px."""
    x, u = (np.column_stack([p, np.ones(len(p))]) for p in (a, b))
    lines_b, lines_a = x @ np.asarray(F).T, u @ np.asarray(F)
    off = np.abs(np.sum(u * lines_b, axis=1))
    return off / np.linalg.norm(lines_a[:, :2], axis=1), off / np.linalg.norm(lines_b[:, :2], axis=1)
