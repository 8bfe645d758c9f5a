"""Where points are, from their pixels in two or more images of known cameras, and how sure that is.

    found = triangulate(camera, cameras_T_world, pixels, sigma_px=0.3)
    found.points[found.ok], found.covs[found.ok]

Each point is the one with the least reprojection error through the real lenses, whitened by what is known of
each pixel.  It is sought as a homogeneous point, so that one too far away to be told from infinity is said to
be so (`at_infinity`) and still has its direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ModelError, NotPositiveDefiniteError, ShapeError
from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Array, Camera
from vision3d.rigid import inverse, transform

__all__ = ["SURE", "Triangulation", "pose_share", "triangulate"]

SURE = 3.0
"""How many of its own standard deviations an inverse distance is from zero where a distance can be told."""


@dataclass(frozen=True, eq=False)
class Triangulation:
    """Points of space and how well the images determine them; arrays are read-only.

    Parameters
    ----------
    points : (N, 3) in the world, m; NaN where fewer than two images show a point, or it lies beyond infinity
    covs : (N, 3, 3) of the points, m²: of the pixels' noise, and of the poses' where that was given
    angles_rad : (N,) the widest angle between two rays to a point
    rms_px : (N,) root of the mean squared distance between its pixels and projections
    in_front : (N,) it lies ahead of every camera that sees it
    chi2 : (N,) whitened sum of squares, of 2 views - 3 degrees of freedom where the noise is as declared
    views : (N,) how many images show it
    inverse_m, inverse_std_m : (N,) its inverse distance from the middle of the cameras, 1/m, negative where
        rays part, and that number's standard deviation from the pixels' noise
    directions : (N, 3) unit vectors in the world from the middle of the cameras
    """

    points: Array
    covs: Array
    angles_rad: Array
    rms_px: Array
    in_front: NDArray[np.bool_]
    chi2: Array
    views: NDArray[np.int64]
    inverse_m: Array
    inverse_std_m: Array
    directions: Array

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            getattr(self, name).setflags(write=False)

    @cached_property
    def at_infinity(self) -> NDArray[np.bool_]:
        """(N,) whether the images cannot tell the point from one at infinity: see `SURE`."""
        with np.errstate(invalid="ignore"):
            far: NDArray[np.bool_] = ~(self.inverse_m > SURE * self.inverse_std_m) & (self.views > 1)
        return far

    @cached_property
    def ok(self) -> NDArray[np.bool_]:
        """(N,) whether the point has a place: seen twice, ahead of its cameras, and not at infinity."""
        told = self.in_front & ~self.at_infinity & np.isfinite(self.covs).all(axis=(1, 2))
        return told & np.isfinite(self.points).all(axis=1)

    @property
    def dof(self) -> NDArray[np.int64]:
        """(N,) degrees of freedom of `chi2`."""
        return 2 * self.views - 3

    def scaled(self, factor: float) -> Triangulation:
        """The same points where the variance of all noise is so many times what was declared.

        See `vision3d.variance_factor`, which tells it from the residuals.
        """
        if not 0 < factor < np.inf:
            raise ModelError(f"a variance is multiplied by a positive number, got {factor}")
        root = np.sqrt(factor)
        return replace(
            self, covs=factor * self.covs, chi2=self.chi2 / factor, inverse_std_m=root * self.inverse_std_m
        )


def triangulate(
    cameras: Camera | Sequence[Camera],
    cameras_T_world: ArrayLike,
    pixels: ArrayLike,
    *,
    sigma_px: float | ArrayLike = 1.0,
    method: str = "optimal",
    pose_covs: ArrayLike | None = None,
) -> Triangulation:
    """Triangulate points.

    Parameters
    ----------
    cameras : one for all views, or one a view; any lens
    cameras_T_world : (V, 7) poses, two or more
    pixels : (V, N, 2), NaN where a view does not show a point
    sigma_px : standard deviation of a pixel along x and y, a number or (V, N); or covariances (V, N, 2, 2)
    method : "optimal" has the least reprojection error (Gauss-Newton on the real lenses); "linear" the least
        algebraic one (Hartley and Zisserman 2004, section 12.2), its covariance that of the optimum near it
    pose_covs : (V, 6, 6), or (6 V, 6 V) jointly, of the poses, in the chart of `vision3d.pose`: right
        exponential, rotation then translation, in the frame of the world; it adds to the covariances

    Raises
    ------
    ShapeError
        where shapes disagree, or fewer than two views are given.
    DataError
        where a pixel has only one coordinate, or no lens ray.
    ModelError, NotPositiveDefiniteError
        for another method, or a standard deviation or covariance that is not positive.
    """
    from vision3d.kernels import triangulation as kernel

    if method not in ("optimal", "linear"):
        raise ModelError(f"no method {method!r} of triangulation; known are 'optimal' and 'linear'")
    poses, seen, lenses = _checked(cameras, cameras_T_world, pixels)
    rays = np.stack([lens.unproject(row) for lens, row in zip(lenses, seen, strict=True)])
    unseen = np.asarray(np.isnan(seen).any(axis=2))
    rays[unseen] = np.nan
    lost = np.isnan(rays).any(axis=2) & ~unseen
    if lost.any():
        v, n = np.argwhere(lost)[0]
        raise DataError(
            f"pixel {seen[v, n].tolist()} of point {n} in view {v} has no ray through {lenses[v]}; "
            "it lies where the lens has folded: give NaN there"
        )
    whiten = _whitening(sigma_px, seen)
    # the optimum does not depend on where the world begins or on its unit; its numbers are best near one
    middle, unit = _scale(poses) if method == "optimal" else (np.zeros(3), 1.0)
    centres = (inverse(poses)[:, 4:] - middle) / unit
    rotations = rotation_matrix(poses[:, :4])
    projections = np.concatenate([rotations, -(rotations @ centres[:, :, None])], axis=2)
    params = np.zeros((len(lenses), max(lens.count for lens in lenses)))
    for row, lens in zip(params, lenses, strict=True):
        row[: lens.count] = lens.parameters
    count = seen.shape[1]
    points, covs, stats = np.empty((count, 4)), np.empty((count, 4, 4)), np.empty((count, kernel.STATS))
    kernel.triangulate(
        np.array([lens.code for lens in lenses]), params, np.ascontiguousarray(projections), centres, seen,
        rays, whiten.reshape(*seen.shape[:2], 4), method == "optimal", points, covs, stats,
    )  # fmt: skip
    found = _result(points, covs, stats, middle, unit)
    if pose_covs is None:
        return found
    return _with_pose_covs(found, lenses, poses, seen, whiten, pose_covs)


def pose_share(
    found: Triangulation, cameras: Sequence[Camera], cameras_T_world: Array, pixels: Array, whiten: Array
) -> Array:
    """How points move with the poses: (N, 3, V, 6), the chart as for `triangulate`.

    The minimum stays where it is in the pixels; the implicit function theorem tells how it follows the poses.
    """
    points, n = found.points, len(found.points)
    information = np.zeros((n, 3, 3))
    share = np.zeros((n, 3, len(cameras), 6))
    for v, (camera, pose) in enumerate(zip(cameras, cameras_T_world, strict=True)):
        rotation = rotation_matrix(pose[:4])
        with np.errstate(invalid="ignore"):
            _, d_point, _ = camera.project_jacobians(transform(pose, points))
        by_point = whiten[v] @ d_point @ rotation
        by_point[np.isnan(pixels[v]).any(axis=1)] = 0.0
        # camera_T_world Exp(ξ) p = R (p + ω x p + v) + t
        by_pose = np.concatenate([-by_point @ _cross_matrices(points), by_point], axis=2)
        information += by_point.transpose(0, 2, 1) @ by_point
        share[:, :, v] = by_point.transpose(0, 2, 1) @ by_pose
    good: NDArray[np.bool_] = found.ok
    moved = np.full_like(share, np.nan)
    flat = share[good].reshape(-1, 3, 6 * len(cameras))
    moved[good] = -np.linalg.solve(information[good], flat).reshape(-1, 3, len(cameras), 6)
    return moved


def _with_pose_covs(
    found: Triangulation, lenses: Sequence[Camera], poses: Array, seen: Array, whiten: Array, given: ArrayLike
) -> Triangulation:
    views = len(poses)
    covs = np.asarray(given, dtype=np.float64)
    if covs.shape == (views, 6, 6):
        joint = np.zeros((views, 6, views, 6))
        joint[np.arange(views), :, np.arange(views), :] = covs
        covs = joint.reshape(6 * views, 6 * views)
    if covs.shape != (6 * views, 6 * views):
        raise ShapeError(
            f"pose_covs are ({views}, 6, 6) or ({6 * views}, {6 * views}) for {views} views, got {covs.shape}"
        )
    moved = pose_share(found, lenses, poses, seen, whiten).reshape(len(found.points), 3, -1)
    total = found.covs + moved @ covs @ moved.transpose(0, 2, 1)
    return replace(found, covs=np.where(np.isnan(total), found.covs, total))


def _result(points: Array, covs: Array, stats: Array, middle: Array, unit: float) -> Triangulation:
    from vision3d.kernels.triangulation import ANGLE, CHI2, IN_FRONT, RMS, VIEWS

    w = points[:, 3]
    length = np.linalg.norm(points[:, :3], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        own = points[:, :3] / np.where(w > 0, w, np.nan)[:, None]
        d_point = np.zeros((len(points), 3, 4))
        d_point[:, :, :3] = np.eye(3)
        d_point[:, :, 3] = -own
        d_point *= (unit / w)[:, None, None]
        own_covs = d_point @ covs @ d_point.transpose(0, 2, 1)
        d_inverse = np.concatenate([-(w / length**3)[:, None] * points[:, :3], (1 / length)[:, None]], axis=1)
        spread = np.sqrt(np.einsum("ni,nij,nj->n", d_inverse, covs, d_inverse))
    return Triangulation(
        points=middle + unit * own,
        covs=0.5 * (own_covs + own_covs.transpose(0, 2, 1)),
        angles_rad=stats[:, ANGLE].copy(),
        rms_px=stats[:, RMS].copy(),
        in_front=stats[:, IN_FRONT] > 0,
        chi2=stats[:, CHI2].copy(),
        views=stats[:, VIEWS].astype(np.int64),
        inverse_m=w / length / unit,
        inverse_std_m=spread / unit,
        directions=points[:, :3] / length[:, None],
    )


def _checked(
    cameras: Camera | Sequence[Camera], cameras_T_world: ArrayLike, pixels: ArrayLike
) -> tuple[Array, Array, list[Camera]]:
    poses = np.array(cameras_T_world, dtype=np.float64, order="C")
    seen = np.array(pixels, dtype=np.float64, order="C")
    if poses.ndim != 2 or poses.shape[1] != 7 or len(poses) < 2:
        raise ShapeError(f"triangulation takes two poses or more, (V, 7); got shape {poses.shape}")
    if seen.ndim != 3 or seen.shape[::2] != (len(poses), 2):
        raise ShapeError(f"pixels are ({len(poses)}, N, 2) for {len(poses)} poses, got shape {seen.shape}")
    if not np.isfinite(poses).all():
        raise DataError("a pose is not finite; leave that view out")
    lenses = [cameras] * len(poses) if isinstance(cameras, Camera) else list(cameras)
    if len(lenses) != len(poses):
        raise ShapeError(f"one camera, or one a view: got {len(lenses)} for {len(poses)} views")
    half = np.isnan(seen).any(axis=2) & ~np.isnan(seen).all(axis=2)
    if half.any() or np.isinf(seen).any():
        raise DataError("a pixel has two finite numbers, or two NaN where a view does not show the point")
    return poses, seen, lenses


def _whitening(sigma_px: float | ArrayLike, seen: Array) -> Array:
    """(V, N, 2, 2) what takes a residual to one of unit variance."""
    given, shape = np.asarray(sigma_px, dtype=np.float64), seen.shape[:2]
    hidden = np.asarray(np.isnan(seen).any(axis=2))
    if given.shape == (*shape, 2, 2):
        covs = np.where(hidden[..., None, None], np.eye(2), given)
        try:
            root = np.linalg.cholesky(covs)
        except np.linalg.LinAlgError:
            root = np.full((1, 1, 2, 2), np.nan)
        if not np.isfinite(root).all():
            raise NotPositiveDefiniteError("a covariance of a pixel is not positive definite, px²")
        return np.ascontiguousarray(np.linalg.inv(root))
    if given.shape not in ((), shape):
        raise ShapeError(
            f"sigma_px is a number, {shape} or {(*shape, 2, 2)} for these pixels; got shape {given.shape}"
        )
    sigmas = np.where(hidden, 1.0, given)
    if not (sigmas > 0).all() or not np.isfinite(sigmas).all():
        raise ModelError("a standard deviation of a pixel is not a positive number, px")
    return np.ascontiguousarray(np.eye(2) / sigmas[..., None, None])


def _scale(poses: Array) -> tuple[Array, float]:
    """The middle of the cameras and their spread, m."""
    centres = inverse(poses)[:, 4:]
    middle: Array = centres.mean(axis=0)
    spread = float(np.sqrt(np.mean(np.sum((centres - middle) ** 2, axis=1))))
    return middle, spread if spread > 0 else 1.0


def _cross_matrices(points: Array) -> Array:
    """(N, 3, 3) matrices that multiply as the cross product of points (N, 3)."""
    x, y, z = points.T
    zero = np.zeros_like(x)
    return np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
