"""Where an object is, from one picture of points known on it: pose, covariance, and the rival of a plane.

    estimate = estimate_pose(camera, board.points, pixels, sigma_px=0.1)
    estimate.camera_T_object, estimate.cov, estimate.rms_px

Points of a plane have up to two poses that explain their picture nearly as well, tilted towards and away
from the camera: `estimate_poses` gives both, best first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sequential.errors import DataError, NotFiniteError, ShapeError, UnderConstrainedError
from sequential.manifold.quaternion import rotate
from vision3d.camera import Array, Camera
from vision3d.pose_start import frontal_pose, starting_poses

__all__ = ["PoseEstimate", "estimate_pose", "estimate_poses", "project_object", "transform_points"]

HUBER_SIGMAS = 2.0
SAME_RAD, SAME_SHARE = 1e-3, 1e-3
"""Two minima nearer than this in rotation, and in distance relative to it, are one."""
CONDITION_MAX = 1e14


@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """A pose from one picture.

    Parameters
    ----------
    camera_T_object : (7,) qw qx qy qz px py pz, m
    cov : (6, 6) rotation then translation in the frame of the object, right exponential; rad and m
    rms_px : root of the mean squared distance between pixels and projections, px
    chi2 : weighted sum of squared residuals
    dof : its degrees of freedom, 2 N - 6
    residuals : (N, 2) pixel minus projection, px
    iterations : of the solver
    """

    camera_T_object: Array
    cov: Array
    rms_px: float
    chi2: float
    dof: int
    residuals: Array
    iterations: int


def transform_points(a_T_b: Array, points: Array) -> Array:
    """Points (..., 3) of frame b in frame a, for a pose (7,)."""
    return rotate(a_T_b[:4], np.asarray(points, dtype=np.float64)) + a_T_b[4:]


def project_object(camera: Camera, camera_T_object: Array, points: Array) -> Array:
    """Pixels (N, 2) of points (N, 3) of an object."""
    return camera.project(transform_points(np.asarray(camera_T_object, dtype=np.float64), points))


def estimate_pose(
    camera: Camera, points: Array, pixels: Array, sigma_px: Any = None, *, robust: bool = False
) -> PoseEstimate:
    """Pose that brings the points nearest to their pixels: the first of `estimate_poses`."""
    return estimate_poses(camera, points, pixels, sigma_px, robust=robust)[0]


def estimate_poses(
    camera: Camera,
    points: Array,
    pixels: Array,
    sigma_px: Any = None,
    *,
    robust: bool = False,
    start: Array | None = None,
) -> tuple[PoseEstimate, ...]:
    """Every pose that explains a picture as well as any near it, best first: one, or two for a plane.

    Parameters
    ----------
    camera : that took it
    points : (N, 3) on the object, m; N >= 4
    pixels : (N, 2), px
    sigma_px : standard deviation of a coordinate of a pixel, one number or (N,); None: from the residuals
    robust : weigh residuals beyond two sigmas down (Huber); needs `sigma_px`
    start : (7,) a pose to begin with, instead of looking for one

    Raises
    ------
    ShapeError, NotFiniteError
        where points and pixels are not as many, or not numbers.
    UnderConstrainedError
        with fewer than four points, or where they lie on a line.
    DataError
        where no pose has the points in front of the camera.
    """
    points, pixels, sigma = _checked(points, pixels, sigma_px)
    starts = (
        [np.array(start, dtype=np.float64)] if start is not None else starting_poses(camera, points, pixels)
    )
    found: list[PoseEstimate] = []
    for one in starts:
        estimate = _refined(camera, points, pixels, sigma, one, robust=robust)
        if estimate is not None and not any(_same(estimate, other) for other in found):
            found.append(estimate)
    if not found:
        estimate = _refined(
            camera, points, pixels, sigma, frontal_pose(camera, points, pixels), robust=robust
        )
        found += [estimate] if estimate is not None else []
    if not found:
        raise DataError(
            "no pose brings the points in front of the camera and near their pixels; are points and pixels "
            "in the same order, and is the camera that of the picture?"
        )
    # without sigmas chi2 is dof by construction
    return tuple(sorted(found, key=lambda one: one.rms_px if sigma is None else one.chi2))


def _checked(points: Array, pixels: Array, sigma_px: Any) -> tuple[Array, Array, Array | None]:
    points, pixels = (np.ascontiguousarray(rows, dtype=np.float64) for rows in (points, pixels))
    if points.ndim != 2 or points.shape[1] != 3 or pixels.shape != (len(points), 2):
        raise ShapeError(
            f"a pose takes points (N, 3) and pixels (N, 2), got shapes {points.shape} and {pixels.shape}"
        )
    if len(points) < 4:
        raise UnderConstrainedError(f"a pose takes four points or more, got {len(points)}")
    if not (np.isfinite(points).all() and np.isfinite(pixels).all()):
        raise NotFiniteError(
            "points and pixels of a pose must be finite; leave out those that were not found"
        )
    if sigma_px is None:
        return points, pixels, None
    sigma = np.broadcast_to(np.asarray(sigma_px, dtype=np.float64), (len(points),))
    if not (np.isfinite(sigma) & (sigma > 0.0)).all():
        raise NotFiniteError("the standard deviation of a pixel, sigma_px, is a positive number")
    return points, pixels, sigma


def _refined(
    camera: Camera, points: Array, pixels: Array, sigma: Array | None, start: Array, *, robust: bool
) -> PoseEstimate | None:
    from vision3d.kernels.pose_refinement import refine_pose

    pose, information = np.array(start, dtype=np.float64), np.empty((6, 6))
    weights = np.ones(len(points)) if sigma is None else 1.0 / sigma
    huber = HUBER_SIGMAS if robust and sigma is not None else np.inf
    cost, iterations = refine_pose(
        camera.code, camera.parameters, points, pixels, weights, huber, pose, information
    )
    if not np.isfinite(cost):
        return None
    residuals = pixels - project_object(camera, pose, points)
    if not np.isfinite(residuals).all():
        return None  # beyond the fold of the lens
    dof = 2 * len(points) - 6
    scale = 1.0 if sigma is not None else max(cost, 1e-12) / dof
    pose[:4] *= np.where(pose[0] < 0.0, -1.0, 1.0)
    rms = float(np.sqrt(np.mean(np.sum(residuals**2, axis=1))))
    return PoseEstimate(
        _frozen(pose), _frozen(_inverted(information) * scale), rms, cost / scale, dof, _frozen(residuals),
        iterations,
    )  # fmt: skip


def _inverted(information: Array) -> Array:
    """Covariance of an information (6, 6), scaled first: radians and metres may differ by orders."""
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(information), 1e-300))
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    if not values[0] > values[-1] / CONDITION_MAX:
        raise UnderConstrainedError(
            "the points do not determine the pose: they lie on a line, or look the same from several sides"
        )
    inverse = (vectors / values) @ vectors.T
    cov: Array = inverse * np.outer(scale, scale)
    return 0.5 * (cov + cov.T)


def _same(a: PoseEstimate, b: PoseEstimate) -> bool:
    turn = 2.0 * np.sqrt(max(0.0, 1.0 - float(a.camera_T_object[:4] @ b.camera_T_object[:4]) ** 2))
    shift = float(np.linalg.norm(a.camera_T_object[4:] - b.camera_T_object[4:]))
    return turn < SAME_RAD and shift < SAME_SHARE * float(np.linalg.norm(b.camera_T_object[4:]))


def _frozen(values: Array) -> Array:
    values.flags.writeable = False
    return values
