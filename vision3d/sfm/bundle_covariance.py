"""Covariances of a bundle adjustment, in a stated gauge, without an inverse of the whole.

Only the views' block, (n, n) after the points are eliminated, is inverted; every point takes what it needs of
it. Where a robust loss was used, the information is that of all observations and the noise that of the loss's
scores (Huber 1981, "Robust statistics", section 7.6), so that a down-weighted outlier neither helps nor is
taken for noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import rotation_matrix
from sequential.manifold.so3 import skew
from vision3d.rigid import inverse
from vision3d.sfm.adjustment import Reduced, reduce
from vision3d.sfm.bundle_problem import BundleProblem, BundleState, Linearized
from vision3d.sfm.gauge import Directions, constraints, directions
from vision3d.sfm.losses import loss_of
from vision3d.sfm.rank import check_points, held_factor

__all__ = ["BundleCovariances", "bundle_covariances", "noise_px"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BundleCovariances:
    """Covariances in one gauge.

    Attributes
    ----------
    poses : Array
        (V, 6, 6) of `camera_T_world`, in its right chart (rotation, translation along the world's axes).
    centres : Array
        (V, 6, 6) of the inverse, `world_T_camera`: attitude and centre in the camera's axes.
    points : Array
        (N, 3, 3) in the world.
    intrinsics : tuple
        For every camera the matrix of its free parameters.
    views : Array
        (n, n) of all poses (as `centres`) and intrinsics together, in the order of `BundleProblem.columns`.
    sigma_px : float
        The noise that scales them.
    """

    poses: Array
    centres: Array
    points: Array
    intrinsics: tuple[Array, ...]
    views: Array
    sigma_px: float


def noise_px(problem: BundleProblem, residuals: Array, loss: str, scale_px: float, free: int) -> float:
    """Standard deviation of a pixel coordinate, from residuals (K, 2) and the number of gauge freedoms.

    NaN where there are no more equations than unknowns.
    """
    seen = np.isfinite(residuals).all(axis=1)
    squares = np.sum(residuals[seen] ** 2, axis=1)
    _, weights = loss_of(loss, squares, scale_px)
    # derivative of the score by the residual, averaged over directions: w + s w'(s)
    ahead = 1e-6 * np.maximum(squares, 1e-12)
    slope = weights + squares * (loss_of(loss, squares + ahead, scale_px)[1] - weights) / ahead
    spare = 2 * len(squares) - (problem.size + 3 * (len(problem.starts) - 1) - free)
    if spare <= 0:
        return float("nan")
    return float(np.sqrt(np.sum(weights**2 * squares) / spare) / max(float(slope.mean()), 1e-12))


def bundle_covariances(
    problem: BundleProblem,
    state: BundleState,
    *,
    gauge: str = "first pose and scale",
    loss: str = "none",
    loss_px: float = 1.0,
    sigma_px: float | None = None,
) -> BundleCovariances:
    """Covariances at a minimum.

    Parameters
    ----------
    problem, state : what was solved, and where
    gauge : name in `vision3d.sfm.gauge.GAUGES`
    loss, loss_px : with which it was solved
    sigma_px : of a pixel coordinate; None to take it from the residuals

    Raises
    ------
    UnderConstrainedError
        where the observations leave something free beyond the gauge; it is named.
    """
    from vision3d.kernels.bundle_schur import point_covariances

    linear = problem.linearize(state)
    weights = np.asarray(np.isfinite(linear.residuals).all(axis=1), dtype=np.float64)
    reduced = reduce(problem, linear, weights)
    check_points(problem, reduced)
    G = directions(problem, state)
    C = _inverse(*held_factor(problem, reduced, constraints(problem, state, "first pose and scale", G)))
    covs = np.empty((len(state.points), 3, 3))
    point_covariances(
        problem.images, problem.starts, problem.columns, weights, linear.by_view, linear.by_point,
        reduced.T_inverse, C, covs,
    )  # fmt: skip
    D = constraints(problem, state, gauge, G)
    if G.count:
        C, covs = _into_gauge(problem, linear, weights, reduced, C, covs, G, D)
    if sigma_px is None:
        sigma_px = noise_px(problem, linear.residuals, loss, loss_px, G.count)
    return _scaled(problem, state, C, covs, sigma_px)


def _inverse(factor: Array, scale: Array) -> Array:
    """The inverse whose Cholesky factor, at unit diagonal, is given."""
    from scipy.linalg import cho_solve

    if not len(factor):
        return factor
    C: Array = cho_solve((factor, True), np.diag(scale), check_finite=False) * scale[:, None]
    return 0.5 * (C + C.T)


def _into_gauge(
    problem: BundleProblem,
    linear: Linearized,
    weights: Array,
    reduced: Reduced,
    C: Array,
    covs: Array,
    G: Directions,
    D: Directions,
) -> tuple[Array, Array]:
    """Baarda's S-transformation of the views' covariance (n, n) and of every point's (N, 3, 3)."""
    N, m = len(problem.starts) - 1, linear.by_view.shape[2]
    E = np.einsum("k,krm,krx->kmx", weights, linear.by_view, linear.by_point)
    places = problem.columns[problem.images]
    seen = places >= 0
    # Q = C D, by way of the reduced system
    pulled = np.einsum("kmx,kxy,kyg->kmg", E, reduced.T_inverse[problem.tracks], D.points[problem.tracks])
    right = D.views.copy()
    np.add.at(right, places[seen], -pulled[seen])
    Q_views = C @ right
    there = np.where(seen[..., None], Q_views[np.where(seen, places, 0)], 0.0).reshape(-1, m, D.count)
    across = np.zeros((N, 3, D.count))
    np.add.at(across, problem.tracks, np.einsum("kmx,kmg->kxg", E, there))
    Q_points = reduced.T_inverse @ (D.points - across)
    M = np.linalg.inv(D.dot(G))
    W = D.dot(Directions(Q_views, Q_points))
    moved, moved_points = G.views @ M, G.points @ M
    C = C - moved @ Q_views.T - Q_views @ moved.T + moved @ W @ moved.T
    share = np.einsum("nxg,nyg->nxy", moved_points, Q_points)
    covs = (
        covs - share - share.transpose(0, 2, 1) + np.einsum("nxg,gh,nyh->nxy", moved_points, W, moved_points)
    )
    return 0.5 * (C + C.T), 0.5 * (covs + covs.transpose(0, 2, 1))


def _scaled(
    problem: BundleProblem, state: BundleState, C: Array, covs: Array, sigma_px: float
) -> BundleCovariances:
    """The covariances by name, in pixels' noise."""
    C, covs = sigma_px**2 * C, sigma_px**2 * covs
    V = len(problem.camera_of)
    centres = np.zeros((V, 6, 6))
    places = problem.columns[:, :6]
    for i in np.flatnonzero(places[:, 0] >= 0):
        centres[i] = C[np.ix_(places[i], places[i])]
    world_T_camera = inverse(state.poses)
    R = rotation_matrix(world_T_camera[:, :4])
    adjoint = np.zeros((V, 6, 6))
    adjoint[:, :3, :3] = adjoint[:, 3:, 3:] = R
    adjoint[:, 3:, :3] = skew(world_T_camera[:, 4:]) @ R
    poses = adjoint @ centres @ adjoint.transpose(0, 2, 1)
    return BundleCovariances(
        poses, centres, covs, tuple(C[place, place] for place in problem.camera_columns), C, float(sigma_px)
    )
