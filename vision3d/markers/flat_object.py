"""Both poses of a flat object from its points in one picture: the door to the compiled posterior."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.manifold.quaternion import quaternion_from_matrix

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["FlatModes", "flat_modes", "sight_planes", "start_of_plane"]

Array = NDArray[np.float64]
WIDE = 0.17  # cosine of the angle from the axis beyond which residuals are taken in the plane across the ray
Z_95 = 1.645


@dataclass(frozen=True, eq=False)
class FlatModes:
    """What the kernel says of one object, for K = 1 or 2 readings; arrays are read-only.

    Parameters
    ----------
    poses, minima : (K, 7) means and places of least error
    covs : (K, 6, 6)
    log_z : (K,) logarithms of the probabilities, up to a constant
    rms_px : (K,) at the minima
    scale : of the variance of the points: 1 where they fit as well as they claim
    """

    poses: Array
    minima: Array
    covs: Array
    log_z: Array
    rms_px: Array
    scale: float


def flat_modes(camera: Camera, points: Array, pixels: Array, whitening: Array) -> FlatModes:
    """Poses of the frame of `points` (N, 3) seen at `pixels` (N, 2).

    Parameters
    ----------
    whitening : (B, 2 N / B, 2 N / B) matrices that make blocks of residuals (x0 y0 x1 y1 …, px) white
    """
    from vision3d.kernels.plane_posterior import posterior

    A, n, rays = sight_planes(camera, pixels)
    middle = points.mean(axis=0)
    own = np.ascontiguousarray(points - middle)
    R, t = np.empty((2, 3, 3)), np.empty((2, 3))
    R[0], t[0] = start_of_plane(own, rays)
    best_R, best_t = np.empty_like(R), np.empty_like(t)
    cov, log_z, chi2 = np.empty((2, 6, 6)), np.empty(2), np.empty(2)
    limit = _quantile_95(2 * len(points) - 6)
    count = posterior(own, n, A, whitening.copy(), limit, R, t, best_R, best_t, cov, log_z, chi2)
    if count == 0 or not (np.isfinite(cov[:count]).all() and np.isfinite(log_z[:count]).all()):
        raise DataError(_no_pose(pixels))
    covs = np.array([_moved(cov[k], middle) for k in range(count)])
    rms = [_rms(own, n, A, best_R[k], best_t[k]) for k in range(count)]
    return FlatModes(
        _frozen(_poses(R[:count], t[:count], middle)),
        _frozen(_poses(best_R[:count], best_t[:count], middle)),
        _frozen(covs),
        _frozen(log_z[:count].copy()),
        _frozen(np.array(rms)),
        max(1.0, float(chi2[0]) / limit),
    )


def sight_planes(camera: Camera, pixels: Array) -> tuple[Array, Array, Array]:
    """A (N, 2, 3), n (N, 3) and rays (N, 3): residuals are A p / (n · p), see `vision3d.kernels.plane_pose`.

    Raises
    ------
    DataError
        where a pixel has no ray.
    """
    rays = camera.unproject(pixels)
    if not np.isfinite(rays).all():
        lost = int(np.argmin(np.isfinite(rays).all(axis=1)))
        x, y = pixels[lost]
        raise DataError(f"no ray of the lens meets the pixel ({x:.1f}, {y:.1f}); check the camera's file")
    jacobian = camera.project_jacobians(rays)[1]
    straight = rays[:, 2] > WIDE
    n = np.where(straight[:, None], np.array([0.0, 0.0, 1.0]), rays)
    A = jacobian * np.where(straight, rays[:, 2], 1.0)[:, None, None]
    return np.ascontiguousarray(A), np.ascontiguousarray(n), rays


def start_of_plane(points: Array, rays: Array) -> tuple[Array, Array]:
    """A pose (3, 3), (3,) from the homography between the plane z = 0 of `points` (N, 3) and `rays` (N, 3).

    Zhang 2000, "A flexible new technique for camera calibration", section 3.1, on rays instead of pixels.
    """
    span = np.abs(points).max()
    flat = np.column_stack([points[:, :2] / span, np.ones(len(points))])
    x, y, z = rays.T[:, :, None]
    none = np.zeros_like(flat)
    rows = np.concatenate(
        [
            np.hstack([none, -z * flat, y * flat]),
            np.hstack([z * flat, none, -x * flat]),
            np.hstack([-y * flat, x * flat, none]),
        ]
    )
    H = np.linalg.svd(rows)[2][-1].reshape(3, 3)
    if np.einsum("ni,ij,nj->n", rays, H, flat).sum() < 0.0:
        H = -H
    a, b = H[:, 0], H[:, 1]
    lengths = float(np.linalg.norm(a)), float(np.linalg.norm(b))
    if min(lengths) < 1e-12 * max(*lengths, 1e-300):
        raise DataError("the points of the object lie on one line in the picture, which leaves its pose open")
    U, _, Vt = np.linalg.svd(np.column_stack([a, b]), full_matrices=False)
    first_two = U @ Vt
    R = np.column_stack([first_two, np.cross(first_two[:, 0], first_two[:, 1])])
    t = H[:, 2] * (2.0 / sum(lengths)) * span
    return R, t


def _poses(R: Array, t: Array, middle: Array) -> Array:
    """(K, 7) poses of the frame whose point `middle` is at t."""
    return np.column_stack([quaternion_from_matrix(R), t - R @ middle])


def _moved(cov: Array, middle: Array) -> Array:
    """Covariance of the frame of the points, from that of the parallel frame at their middle."""
    x, y, z = middle
    adjoint = np.eye(6)  # a turn about the middle moves the origin by middle x turn
    adjoint[3:, :3] = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    moved: Array = adjoint @ cov @ adjoint.T
    return moved


def _rms(points: Array, n: Array, A: Array, R: Array, t: Array) -> float:
    """Root mean square distance in px of the points from a pose."""
    p = points @ R.T + t
    residual = np.einsum("nij,nj->ni", A, p) / np.einsum("ni,ni->n", n, p)[:, None]
    return float(np.sqrt((residual**2).sum(axis=1).mean()))


def _quantile_95(dof: int) -> float:
    """Of chi squared, by Wilson and Hilferty 1931; exact to 1 % from two degrees of freedom on."""
    k = 2.0 / (9.0 * dof)
    return float(dof * (1.0 - k + Z_95 * np.sqrt(k)) ** 3)


def _no_pose(pixels: Array) -> str:
    x, y = pixels.mean(axis=0)
    return (
        f"the points around ({x:.0f}, {y:.0f}) px fit no pose of a flat object; are they in the right order?"
    )


def _frozen(value: Array) -> Array:
    value.flags.writeable = False
    return value
