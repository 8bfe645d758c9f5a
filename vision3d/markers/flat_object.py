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

__all__ = ["FlatModes", "flat_modes", "flat_modes_of_many", "sight_planes", "start_of_plane"]

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
    whitening : (B, 2 N / B, 2 N / B) lower triangular matrices that make blocks of residuals (x0 y0 x1 y1 …,
        px) white

    Raises
    ------
    DataError
        where a pixel has no ray, or no pose is near the pixels.
    """
    (found,) = flat_modes_of_many(camera, points, pixels[None], whitening[None])
    if found is not None:
        return found
    sight_planes(camera, pixels)
    x, y = pixels.mean(axis=0)
    raise DataError(
        f"the points around ({x:.0f}, {y:.0f}) px fit no pose of a flat object; are they on a line, or in "
        "another order?"
    )


def flat_modes_of_many(
    camera: Camera, points: Array, pixels: Array, whitening: Array
) -> list[FlatModes | None]:
    """Like `flat_modes` for M objects alike, at `pixels` (M, N, 2); None where there is no pose."""
    from vision3d.kernels.plane_posterior import posterior

    m = len(pixels)
    middle = points.mean(axis=0)
    own = np.ascontiguousarray(points - middle)
    A, n, rays = _linearised(camera, pixels)
    usable = np.asarray(np.isfinite(rays).all(axis=(1, 2)), dtype=np.bool_)
    R, t = np.empty((m, 2, 3, 3)), np.empty((m, 2, 3))
    usable[usable], R[usable, 0], t[usable, 0] = start_of_plane(own, rays[usable])
    best_R, best_t = np.empty_like(R), np.empty_like(t)
    cov, log_z, chi2 = np.empty((m, 2, 6, 6)), np.empty((m, 2)), np.empty((m, 2))
    limit, count = _quantile_95(2 * len(points) - 6), np.zeros(m, dtype=np.int64)
    W = whitening.copy()
    for k in np.flatnonzero(usable).tolist():
        count[k] = posterior(
            own, n[k], A[k], W[k], limit, R[k], t[k], best_R[k], best_t[k], cov[k], log_z[k], chi2[k]
        )
    there = np.arange(2) < count[:, None]
    there &= np.isfinite(cov).all(axis=(2, 3)) & np.isfinite(log_z)
    row, mode = np.nonzero(there)
    poses, minima = (_poses(r[row, mode], u[row, mode], middle) for r, u in ((R, t), (best_R, best_t)))
    covs, rms = (
        _moved(cov[row, mode], middle),
        _rms(own, n[row], A[row], best_R[row, mode], best_t[row, mode]),
    )
    found: list[FlatModes | None] = []
    for k in range(m):
        own_rows = np.flatnonzero(row == k)
        if not len(own_rows):
            found.append(None)
            continue
        each = (poses, minima, covs, log_z[row, mode], rms)
        own_poses, own_minima, own_covs, own_z, own_rms = (_frozen(value[own_rows]) for value in each)
        scale = max(1.0, float(chi2[k, 0]) / limit)
        found.append(FlatModes(own_poses, own_minima, own_covs, own_z, own_rms, scale))
    return found


def sight_planes(camera: Camera, pixels: Array) -> tuple[Array, Array, Array]:
    """A (N, 2, 3), n (N, 3) and rays (N, 3): residuals are A p / (n · p), see `vision3d.kernels.plane_pose`.

    Raises
    ------
    DataError
        where a pixel has no ray.
    """
    A, n, rays = _linearised(camera, pixels)
    if not np.isfinite(rays).all():
        lost = int(np.argmin(np.isfinite(rays).all(axis=1)))
        x, y = pixels[lost]
        raise DataError(f"no ray of the lens meets the pixel ({x:.1f}, {y:.1f}); check the camera's file")
    return A, n, rays


def _linearised(camera: Camera, pixels: Array) -> tuple[Array, Array, Array]:
    """The same for pixels (..., 2), NaN where there is no ray."""
    rays = camera.unproject(pixels)
    jacobian = camera.project_jacobians(rays)[1]
    straight = rays[..., 2] > WIDE
    n = np.where(straight[..., None], np.array([0.0, 0.0, 1.0]), rays)
    A = jacobian * np.where(straight, rays[..., 2], 1.0)[..., None, None]
    return np.ascontiguousarray(A), np.ascontiguousarray(n), rays


def start_of_plane(points: Array, rays: Array) -> tuple[NDArray[np.bool_], Array, Array]:
    """Poses (M, 3, 3), (M, 3) from homographies between a plane, `points` (N, 3), and `rays` (M, N, 3).

    The first of three is which of them are sound.  Zhang 2000, "A flexible new technique for camera
    calibration", section 3.1, on rays instead of pixels.
    """
    span = np.abs(points).max()
    flat = np.column_stack([points[:, :2] / span, np.ones(len(points))])
    x, y, z = (rays[..., k, None] for k in range(3))
    none = np.zeros((*rays.shape[:2], 3))
    rows = np.concatenate(
        [
            np.concatenate([none, -z * flat, y * flat], axis=-1),
            np.concatenate([z * flat, none, -x * flat], axis=-1),
            np.concatenate([-y * flat, x * flat, none], axis=-1),
        ],
        axis=1,
    )
    H = np.linalg.svd(rows)[2][:, -1].reshape(-1, 3, 3)
    H *= np.where(np.einsum("mni,mij,nj->m", rays, H, flat) < 0.0, -1.0, 1.0)[:, None, None]
    lengths = np.linalg.norm(H[:, :, :2], axis=1)
    sound = lengths.min(axis=1) > 1e-12
    U, _, Vt = np.linalg.svd(H[:, :, :2], full_matrices=False)
    two = U @ Vt
    R = np.concatenate([two, np.cross(two[:, :, 0], two[:, :, 1])[:, :, None]], axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = H[:, :, 2] * (2.0 * span / lengths.sum(axis=1))[:, None]
    return sound, R, t


def _poses(R: Array, t: Array, middle: Array) -> Array:
    """Poses (K, 7) of the frame whose point `middle` is at t."""
    return np.concatenate([quaternion_from_matrix(R), t - R @ middle], axis=-1)


def _moved(covs: Array, middle: Array) -> Array:
    """Covariances of the frame of the points, from those of the parallel frame at their middle."""
    if not middle.any():
        return covs
    x, y, z = middle
    adjoint = np.eye(6)  # a turn about the middle moves the origin by middle x turn
    adjoint[3:, :3] = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    moved: Array = adjoint @ covs @ adjoint.T
    return moved


def _rms(points: Array, n: Array, A: Array, R: Array, t: Array) -> Array:
    """Root mean square distances (K,) in px of the points from K poses."""
    p = points @ R.transpose(0, 2, 1) + t[:, None]
    residual = np.einsum("knij,knj->kni", A, p) / np.einsum("kni,kni->kn", n, p)[..., None]
    rms: Array = np.sqrt((residual**2).sum(axis=-1).mean(axis=-1))
    return rms


def _quantile_95(dof: int) -> float:
    """Of chi squared, by Wilson and Hilferty 1931; exact to 1 % from two degrees of freedom on."""
    k = 2.0 / (9.0 * dof)
    return float(dof * (1.0 - k + Z_95 * np.sqrt(k)) ** 3)


def _frozen(value: Array) -> Array:
    value.flags.writeable = False
    return value
