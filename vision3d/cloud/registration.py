"""Bringing two clouds together: iterative closest point, to planes or to points.

    found = icp(source, target, start=target_T_source)
    found.target_T_source, found.cov, found.stopped

Each round pairs every point with the nearest of the target, weighs pairs down that are farther apart than
most (Tukey's biweight; what is to count as far shrinks as the clouds come together), and takes a Gauss-Newton
step of the pose.  Besl, McKay 1992, "A method for registration of 3-D shapes"; Chen, Medioni 1992, "Object
modelling by registration of multiple range images" (planes); Zhang 1994, "Iterative point matching for
registration of free-form curves and surfaces" (the shrinking limit).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import DataError, ModelError
from sequential.manifold import SE3
from sequential.manifold.quaternion import quaternion_from_matrix, rotation_matrix
from vision3d.cloud.arrays import Array, Backend, beside, checked_backend, checked_points, positive
from vision3d.cloud.normals import estimate_normals
from vision3d.cloud.with_open3d import open3d
from vision3d.rigid import transform

__all__ = ["IcpResult", "Method", "icp"]

Method = Literal["point-to-plane", "point-to-point"]
IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
BIWEIGHT = 4.685  # Tukey's constant: 95 % efficient where nothing is wrong
FREE = 1e-5  # of the best determined direction's information, below which a direction counts as free
SETTLED = 1e-7  # of the cloud's size, a step that ends the search
FEWEST = 6


@dataclass(frozen=True, slots=True)
class IcpResult:
    """How one cloud lies on another.

    Parameters
    ----------
    target_T_source : (7,) qw qx qy qz px py pz
    cov : (6, 6), chart (rotation, translation) in the source frame, from the scatter of the residuals taken
        as independent; None where a direction is free
    rmse_m : root mean square distance of the pairs in use: to planes, or to points
    overlap : share of the source's points that are in use
    iterations : rounds
    converged : whether the last step was negligible
    stopped : why the search ended, in words
    free : (k, 6) directions of the pose that the pairs do not determine (a plane slides on a plane)
    """

    target_T_source: Array
    cov: Array | None
    rmse_m: float
    overlap: float
    iterations: int
    converged: bool
    stopped: str
    free: Array


def icp(
    source: ArrayLike,
    target: ArrayLike,
    *,
    start: ArrayLike = IDENTITY,
    method: Method = "point-to-plane",
    normals: ArrayLike | None = None,
    max_distance_m: float | None = None,
    max_iterations: int = 100,
    backend: Backend = "own",
) -> IcpResult:
    """Find the pose that lays a cloud on another.

    Parameters
    ----------
    source, target : (N, 3) and (M, 3)
    start : (7,) target_T_source to begin at; the search finds the minimum nearest to it
    method : "point-to-plane" converges quicker on surfaces
    normals : (M, 3) of the target, estimated from its points when missing
    max_distance_m : pairs farther apart are never used; without it the scatter of the pairs decides
    max_iterations : rounds
    backend : "own", or "open3d" (which needs `max_distance_m` and gives no covariance)

    Raises
    ------
    DataError
        where fewer than six points have a partner.
    """
    moving, fixed = (
        checked_points(source, at_least=FEWEST, what="source"),
        checked_points(target, at_least=FEWEST, what="target"),
    )
    if method not in {"point-to-plane", "point-to-point"}:
        raise ModelError(f"no method {method!r}; there are 'point-to-plane' and 'point-to-point'")
    planes = None
    if method == "point-to-plane":
        if normals is None:
            local = estimate_normals(fixed)
            planes = local.normals
            # the nearest point, moved into the plane of its neighbours: their noise averages out
            height = np.einsum("ij,ij->i", planes, local.centres - fixed)
            fixed = fixed + height[:, None] * planes
        else:
            planes = beside(normals, fixed.shape, "normals").astype(np.float64)
    limit = np.inf if max_distance_m is None else positive(max_distance_m, "max_distance_m")
    pose = np.asarray(start, dtype=np.float64)
    if checked_backend(backend):
        return _by_open3d(moving, fixed, planes, pose, limit, max_iterations)
    return _search(moving, fixed, planes, pose, limit, max_iterations)


def _search(
    moving: Array, fixed: Array, planes: Array | None, pose: Array, limit: float, rounds: int
) -> IcpResult:
    from scipy.spatial import cKDTree

    tree, size = cKDTree(fixed), float(np.linalg.norm(moving.std(axis=0)))
    scale = np.array([size] * 3 + [1.0] * 3) if size > 0.0 else np.ones(6)
    reach, turn = limit, 0
    converged = False
    while True:
        distance, nearest = tree.query(transform(pose, moving), distance_upper_bound=limit, workers=-1)
        pairs = np.flatnonzero(np.isfinite(distance) & (distance <= reach))
        if len(pairs) < FEWEST:
            raise DataError(
                f"icp: {len(pairs)} of {len(moving)} points of the source have a partner nearer than "
                f"{min(reach, limit):.3g} m; start nearer or allow a larger max_distance_m"
            )
        plane = None if planes is None else planes[nearest[pairs]]
        residuals, slopes = _linearised(pose, moving[pairs], fixed[nearest[pairs]], plane)
        weights, sigma = _weights(residuals)
        if converged or turn == rounds:
            break
        step, _ = _step(residuals, slopes, weights, scale)
        pose, turn = SE3().retract(pose, step), turn + 1
        # a pair is far when it is three times as far as the middle one, but never nearer than the noise
        reach = min(limit, max(3.0 * 1.4826 * float(np.median(distance[pairs])), 3.0 * sigma))
        converged = float(np.abs(step * scale).max()) < SETTLED * max(size, 1e-300)
    _, free = _step(residuals, slopes, weights, scale)
    cov = None if len(free) else _covariance(residuals, slopes, weights)
    rmse = float(np.sqrt((weights * (residuals**2).sum(axis=1)).sum() / weights.sum()))
    words = "the steps became negligible" if converged else f"{rounds} iterations were not enough"
    if len(free):
        words += f"; the pairs leave {len(free)} of 6 directions free"
    overlap = float((weights > 0.0).sum() / len(moving))
    return IcpResult(pose, cov, rmse, overlap, turn, converged, words, free)


def _linearised(pose: Array, moving: Array, fixed: Array, planes: Array | None) -> tuple[Array, Array]:
    """Residuals (N, r) and how they change with the pose (N, r, 6), right chart."""
    rotation = rotation_matrix(pose[:4])
    gap = transform(pose, moving) - fixed
    # rows of n' R, of which n . R (w x p + v) = (p x R'n) . w + R'n . v
    rows = (
        np.broadcast_to(rotation[None], (len(moving), 3, 3))
        if planes is None
        else (planes @ rotation)[:, None]
    )
    residuals = gap if planes is None else np.einsum("ni,ni->n", planes, gap)[:, None]
    return residuals, np.concatenate([np.cross(moving[:, None, :], rows), rows], axis=2)


def _weights(residuals: Array) -> tuple[Array, float]:
    """Tukey's weights (N,), and the scatter (one axis) of what is not an outlier."""
    size = np.linalg.norm(residuals, axis=1)
    middle = {1: 0.6745, 3: 1.5382}[residuals.shape[1]]  # median length of a standard normal vector
    sigma = float(np.median(size)) / middle
    if not sigma > 0.0:
        return np.ones(len(size)), 0.0
    ratio = np.minimum(size / (BIWEIGHT * sigma), 1.0)
    return (1.0 - ratio**2) ** 2, sigma


def _covariance(residuals: Array, slopes: Array, weights: Array) -> Array:
    """Of an M-estimate: Huber 1981, "Robust statistics", section 7.6, (7.6.5)."""
    count, axes = residuals.shape
    far = 1.0 - np.sqrt(weights)  # (size / biweight sigma)^2, of those inside
    bend = weights - np.where(weights > 0.0, 4.0 * far * np.sqrt(weights), 0.0) / axes
    pull = float((weights[:, None] ** 2 * residuals**2).sum()) / max(count * axes - 6.0, 1.0)
    information = np.einsum("nri,nrj->ij", slopes, slopes)
    return np.asarray(pull / float(bend.mean()) ** 2 * np.linalg.inv(information))


def _step(residuals: Array, slopes: Array, weights: Array, scale: Array) -> tuple[Array, Array]:
    """The Gauss-Newton step (6,), zero along directions that are free, and those directions (k, 6)."""
    scaled = slopes / scale
    information = np.einsum("n,nri,nrj->ij", weights, scaled, scaled)
    values, vectors = np.linalg.eigh(information)
    held = values > FREE * max(values[-1], 1e-300)
    along = -vectors.T @ np.einsum("n,nri,nr->i", weights, scaled, residuals)
    step = vectors[:, held] @ (along[held] / values[held])
    free = vectors[:, ~held].T / scale
    return step / scale, free / np.linalg.norm(free, axis=1, keepdims=True)


def _by_open3d(
    moving: Array, fixed: Array, planes: Array | None, pose: Array, limit: float, rounds: int
) -> IcpResult:
    if not np.isfinite(limit):
        raise ModelError("max_distance_m: open3d needs one; give the largest distance that a pair may have")
    o3d = open3d()
    clouds = [o3d.geometry.PointCloud(o3d.utility.Vector3dVector(place)) for place in (moving, fixed)]
    registration = o3d.pipelines.registration
    way = registration.TransformationEstimationPointToPoint()
    if planes is not None:
        clouds[1].normals = o3d.utility.Vector3dVector(planes)
        way = registration.TransformationEstimationPointToPlane()
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation_matrix(pose[:4]), pose[4:]
    criteria = registration.ICPConvergenceCriteria(1e-9, 1e-9, rounds)
    found = registration.registration_icp(*clouds, limit, matrix, way, criteria)
    attitude = quaternion_from_matrix(found.transformation[:3, :3])
    answer = np.concatenate([attitude, found.transformation[:3, 3]])
    overlap, rmse = float(found.fitness), float(found.inlier_rmse)
    return IcpResult(answer, None, rmse, overlap, rounds, overlap > 0.0, "open3d's", np.empty((0, 6)))
