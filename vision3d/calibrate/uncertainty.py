"""How surely a calibrated camera says where a direction appears: per pixel, in pixels.

The coefficients of a lens trade places with each other, so their standard deviations say little; where a ray
lands is what a user gets.  Here the covariance of all parameters is carried to the projection of the ray
through every pixel.  As in mrcal (Dima Kogan, "Projection uncertainty", mrcal.secretsauce.net), a part of
that may be a turn of the whole camera, which an application that finds the camera's pose never sees: it can
be freed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.manifold.quaternion import rotation_matrix
from sequential.manifold.so3 import skew
from vision3d.calibrate.calibration import Calibration
from vision3d.camera import Camera

__all__ = ["ProjectionUncertainty", "pixel_grid", "projection_uncertainty", "ray_jacobians", "turn_freed"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ProjectionUncertainty:
    """Covariance of where rays appear.

    Attributes
    ----------
    pixels : Array
        (N, 2), where the camera sees them.
    cov : Array
        (N, 2, 2) px²; NaN where the camera has no ray.
    grid : tuple[int, int] | None
        Columns and rows, where the pixels are a grid in row order.
    """

    pixels: Array
    cov: Array
    grid: tuple[int, int] | None = None

    @property
    def std_px(self) -> Array:
        """Root mean square distance from the truth that is to be expected, (N,): the root of the trace."""
        expected: Array = np.sqrt(np.trace(self.cov, axis1=1, axis2=2))
        return expected

    @property
    def worst_px(self) -> Array:
        """Standard deviation along the worst direction, (N,)."""
        a, b, d = self.cov[:, 0, 0], self.cov[:, 0, 1], self.cov[:, 1, 1]
        worst: Array = np.sqrt(0.5 * (a + d) + np.hypot(0.5 * (a - d), b))
        return worst

    @property
    def map_px(self) -> Array:
        """`std_px` as an image (rows, columns).

        Raises
        ------
        ModelError
            The pixels are no grid.
        """
        if self.grid is None:
            raise ModelError("only a grid makes a map: call projection_uncertainty without pixels")
        return self.std_px.reshape(self.grid[1], self.grid[0])

    @property
    def mean_px(self) -> float:
        """Root mean square of `std_px` over the pixels that have a ray."""
        return float(np.sqrt(np.nanmean(self.std_px**2)))


def projection_uncertainty(
    calibration: Calibration,
    pixels: Array | None = None,
    *,
    freed_rotation: bool = False,
    distance_m: float | None = None,
    grid: tuple[int, int] = (24, 18),
) -> ProjectionUncertainty:
    """Covariance of the projection of the rays through some pixels.

    Parameters
    ----------
    calibration : Calibration
        The camera and how sure it is.
    pixels : Array, optional
        (N, 2), px; by default a grid over the whole image, borders included.
    freed_rotation : bool
        Take away the turn of the camera that explains most of the error over the image: what is left
        cannot be made good by any pose.
    distance_m : float, optional
        Follow, instead, a point at this distance through the poses of the boards (mrcal's mean over frames):
        its place among the boards is what is known of it.
    grid : tuple[int, int]
        Columns and rows of the default grid.

    Returns
    -------
    ProjectionUncertainty
        Covariances, standard deviations, and their map.

    Notes
    -----
    To first order in the parameters' errors.
    """
    camera = calibration.camera
    at, shape = (pixel_grid(camera.size, grid), grid) if pixels is None else (np.atleast_2d(pixels), None)
    rays = camera.unproject(at)
    by_ray, by_parameters = ray_jacobians(camera, rays)
    if distance_m is not None:
        return ProjectionUncertainty(at, _through_boards(calibration, rays * distance_m), shape)
    if freed_rotation:
        by_parameters = by_parameters - by_ray @ turn_freed(camera)
    return ProjectionUncertainty(at, _carried(by_parameters, calibration.cov), shape)


def pixel_grid(size: tuple[int, int], grid: tuple[int, int] = (24, 18)) -> Array:
    """Pixels (columns * rows, 2) evenly over an image, its borders included, row by row."""
    x, y = np.linspace(0.0, size[0] - 1.0, grid[0]), np.linspace(0.0, size[1] - 1.0, grid[1])
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def ray_jacobians(camera: Camera, rays: Array) -> tuple[Array, Array]:
    """How the images of rays (N, 3) move when the rays turn, (N, 2, 3), and with the parameters, (N, 2, p).

    NaN where a ray is.
    """
    _, by_point, by_parameters = camera.project_jacobians(rays)
    # a turn by r moves the ray d by r × d = -[d]× r
    return -by_point @ skew(rays), by_parameters


def turn_freed(camera: Camera, weights: Array | None = None, grid: tuple[int, int] = (20, 15)) -> Array:
    """The turn (3, p) that a change of the parameters amounts to, by least squares over the image.

    Parameters
    ----------
    camera : Camera
        At its parameters.
    weights : Array, optional
        (columns * rows,), of the pixels of the grid; equal by default.
    grid : tuple[int, int]
        Columns and rows of the pixels over which the turn is fitted.
    """
    by_turn, by_parameters = ray_jacobians(camera, camera.unproject(pixel_grid(camera.size, grid)))
    seen = np.isfinite(by_turn[:, 0, 0])
    w = np.ones(len(seen)) if weights is None else weights
    w, by_turn, by_parameters = w[seen], by_turn[seen], by_parameters[seen]
    normal = np.einsum("n,nij,nik->jk", w, by_turn, by_turn)
    freed: Array = np.linalg.solve(normal, np.einsum("n,nij,nik->jk", w, by_turn, by_parameters))
    return freed


def _carried(jacobians: Array, cov: Array) -> Array:
    carried: Array = jacobians @ cov @ jacobians.transpose(0, 2, 1)
    return carried


def _through_boards(calibration: Calibration, points: Array) -> Array:
    """Covariance (N, 2, 2) of the images of points (N, 3) that stay where they are among the boards.

    With X_v the point in the frame of board v, its image moves with the parameters, and with the mean over
    the boards of how their poses carry it: R_v (ρ_v - X_v × φ_v).
    """
    _, by_point, by_parameters = calibration.camera.project_jacobians(points)
    R = rotation_matrix(calibration.poses[:, :4])
    own = np.einsum("vji,nvj->nvi", R, points[:, None] - calibration.poses[None, :, 4:])
    carried = np.concatenate(
        [-np.einsum("vij,nvjk->nvik", R, skew(own)), np.broadcast_to(R, (len(points), *R.shape))], axis=-1
    )
    by_pose = np.einsum("nij,nvjk->nvik", by_point, carried) / len(R)
    along = np.einsum("nvik,vkq->niq", by_pose, calibration.pose_follows)
    along[..., : calibration.camera.count] += by_parameters
    cov: Array = np.einsum("nvik,vkl,nvjl->nij", by_pose, calibration.pose_alone, by_pose)
    return cov + _carried(along, calibration.joint_cov)
