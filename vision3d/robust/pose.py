"""A camera's pose from points of space and where they are seen, wrong matches among them (PnP)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import (
    DataError,
    ModelError,
    NotFiniteError,
    ShapeError,
    SolverError,
    UnderConstrainedError,
)
from vision3d.camera import Camera
from vision3d.robust.backends import NOT_SAID, Outside, opencv_method, poselib_options, seed_of, the_poselib
from vision3d.robust.model import Addresses, CompiledModel
from vision3d.robust.result import RobustFit
from vision3d.robust.search import Found, assess, relative_weights, result_of, search
from vision3d.robust.settings import DEFAULT, RansacSettings

__all__ = ["POSE", "fit_pose", "point_rows"]

Array = NDArray[np.float64]


def _load() -> Addresses:
    from vision3d.kernels import robust_pose as kernels

    return Addresses(kernels.pose_solve.address, kernels.pose_error.address, kernels.pose_fit.address)


POSE = CompiledModel(
    "pose", 3, 12, 7, max_solutions=4, error_dof=2, freedom=6, inner_size=10, solve_cost=200, load=_load
)


def point_rows(camera: Camera, points: Array, pixels: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Rows (N, 12) of points (N, 3) and their pixels (N, 2), and which pixels have a ray, (N,) bool."""
    rays = camera.unproject(pixels)
    seen = np.isfinite(rays[:, 0])
    rows = np.full((len(rays), 12), np.nan)
    rows[:, :3], rows[:, 3:6] = points, rays
    rows[seen, 6:] = camera.project_jacobians(rays[seen])[1].reshape(-1, 6)
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(rows).all(axis=1))
    return rows, finite


def fit_pose(
    camera: Camera,
    points: Array,
    pixels: Array,
    settings: RansacSettings = DEFAULT,
    *,
    sigma: Array | float | None = None,
    rng: np.random.Generator | None = None,
) -> RobustFit:
    """Fit camera_T_object, the pose from which most points are seen at their pixels.

    Parameters
    ----------
    camera : that took the picture, lens distortion included
    points : (N, 3) in the frame of the object or the world
    pixels : (N, 2) px, matched row by row; best first for PROSAC's order
    settings : the threshold is a reprojection error, in px
    sigma : px, of each match (N,) or of all; without it the covariance is scaled by the errors seen
    rng : where the seed comes from; the same without it every time

    Returns
    -------
    RobustFit
        model (7,) qw qx qy qz px py pz; cov (6, 6), rotation then translation in the frame of the object,
        right exponential, as `vision3d.pose.estimate_pose` gives it

    Raises
    ------
    DataError
        for points that do not pair, are not finite, or are fewer than four.
    UnderConstrainedError
        where all points lie on a line, or no three of them make a pose.
    """
    points, pixels = _checked(points, pixels)
    rows, seen = point_rows(camera, points, pixels)
    if seen.sum() < 4:
        raise DataError(
            f"a pose takes four matches or more; {int(seen.sum())} of {len(points)} pixels have a ray in "
            "this camera: it is that of another picture, or its lens folds inside the image"
        )
    weights = relative_weights(sigma, len(points))[seen]
    used = np.ascontiguousarray(rows[seen])
    if settings.backend == "own":
        found = search(POSE, used, settings, weights, rng)
    else:
        outside = _outside(used, settings, camera.intrinsics[:2].mean(), rng)
        found = assess(POSE, used, settings, weights, outside.model, outside)
    level = None if sigma is None else float(np.median(sigma))
    pose, cov = _finished(camera, points[seen], pixels[seen], found, level)
    return _over_all(result_of(found, pose, cov), seen)


def _finished(
    camera: Camera, points: Array, pixels: Array, found: Found, level: float | None
) -> tuple[Array, Array]:
    """The pose of least weighted reprojection error through the true lens, and its covariance."""
    from vision3d.kernels.pose_refinement import refine_pose
    from vision3d.robust.covariance import pseudo_inverse

    agree = found.weights > 0.0
    pose, information = found.model.copy(), np.empty((6, 6))
    weights = np.sqrt(found.weights[agree])
    cost, _ = refine_pose(
        camera.code, camera.parameters, points[agree], pixels[agree], weights, np.inf, pose, information
    )
    sigma2 = found.variance(level)
    if not np.isfinite(cost):
        return found.model, np.full((6, 6), np.nan)
    pose[:4] *= np.where(pose[0] < 0.0, -1.0, 1.0)
    return pose, sigma2 * pseudo_inverse(information, np.empty((0, 6)))


def _over_all(fitted: RobustFit, seen: NDArray[np.bool_]) -> RobustFit:
    """The result over all matches: those without a ray do not agree."""
    if seen.all():
        return fitted
    inliers, errors = np.zeros(len(seen), dtype=bool), np.full(len(seen), np.inf)
    inliers[seen], errors[seen] = fitted.inliers, fitted.errors
    return replace(fitted, inliers=inliers, errors=errors)


def _outside(rows: Array, settings: RansacSettings, focal: float, rng: np.random.Generator | None) -> Outside:
    """What OpenCV or PoseLib finds, on an ideal camera of the same focal length."""
    ahead = rows[:, 5] > 1e-3
    flat = focal * rows[ahead, 3:5] / rows[ahead, 5:6]
    work: dict[str, Any] = {"opencv": _opencv, "poselib": _poselib}
    found: Outside = work[settings.backend](rows[ahead, :3], flat, focal, settings, seed_of(rng))
    if not np.isfinite(found.model).all():
        raise SolverError(f"{found.backend} found no pose among {len(rows)} matches; try backend='own'")
    return found


def _opencv(points: Array, flat: Array, focal: float, settings: RansacSettings, seed: int) -> Outside:
    import cv2

    from sequential.manifold.quaternion import quaternion_exp, quaternion_normalize

    method, name = opencv_method(settings)
    if name in {"LMEDS", "RHO"}:
        raise ModelError(f"OpenCV has no {name} for poses; take opencv_method='RANSAC' or one of USAC")
    cv2.setRNGSeed(seed)
    K = np.diag([focal, focal, 1.0])
    options: dict[str, Any] = {"reprojectionError": settings.threshold, "confidence": settings.confidence}
    # USAC takes no method here, but parameters
    if name == "RANSAC":
        options |= {"iterationsCount": settings.max_iterations, "flags": cv2.SOLVEPNP_AP3P}
    else:
        options |= {"iterationsCount": settings.max_iterations, "flags": method}
    good, turn, shift, _ = cv2.solvePnPRansac(points, flat, K, None, **options)
    if not good:
        return Outside(np.full(7, np.nan), -1, NOT_SAID, f"opencv {name}")
    pose = np.concatenate([quaternion_normalize(quaternion_exp(np.ravel(turn))), np.ravel(shift)])
    return Outside(pose, -1, NOT_SAID, f"opencv {name}")


def _poselib(points: Array, flat: Array, focal: float, settings: RansacSettings, seed: int) -> Outside:
    camera = {"model": "PINHOLE", "width": 1, "height": 1, "params": [focal, focal, 0.0, 0.0]}
    options = poselib_options(settings, seed, "max_reproj_error")
    image, told = the_poselib().estimate_absolute_pose(flat, points, camera, options)
    pose = image.pose if hasattr(image, "pose") else image
    quaternion = np.asarray(pose.q) * np.copysign(1.0, pose.q[0])
    model = np.concatenate([quaternion, np.asarray(pose.t)])
    return Outside(model, int(told["iterations"]), NOT_SAID, "poselib")


def _checked(points: Array, pixels: Array) -> tuple[Array, Array]:
    points, pixels = (np.ascontiguousarray(rows, dtype=np.float64) for rows in (points, pixels))
    if points.ndim != 2 or points.shape[1] != 3 or pixels.shape != (len(points), 2):
        raise ShapeError(
            f"a pose takes points (N, 3) and pixels (N, 2); got shapes {points.shape} and {pixels.shape}"
        )
    if not (np.isfinite(points).all() and np.isfinite(pixels).all()):
        raise NotFiniteError("points and pixels of a pose are finite; leave out those that were not found")
    if len(points) < 4:
        raise DataError(f"a pose takes four matches or more; got {len(points)}")
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if not extents[1] > 1e-9 * extents[0]:
        raise UnderConstrainedError("all points lie on a line, about which the camera may turn")
    return points, pixels
