"""The homography between the ground and an image, from points seen in both, with its covariance.

A linear start (the direct linear transform of Hartley's normalised points), then Gauss-Newton on the
reprojection error in pixels.  Hartley, Zisserman 2004, "Multiple view geometry", sections 4.1 and 5.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, UnderConstrainedError

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["FittedHomography", "fit_homography"]

Array = NDArray[np.float64]
ROUNDS = 20
FLAT = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class FittedHomography:
    """The homography (3, 3), the covariance (9, 9) of its elements row by row, and the residuals' RMS."""

    ground_H_image: Array
    cov: Array
    rms_px: float


def fit_homography(
    pixels: Array, ground: Array, camera: Camera | None, sigma_px: float, sigma_m: float
) -> FittedHomography:
    """Fit ground_H_image to pixels (N, 2) of ground points (N, 2).

    Raises
    ------
    DataError
        for fewer than four points, or pixels that the lens does not see.
    UnderConstrainedError
        where too many of them lie on one line.
    """
    if len(pixels) < 4:
        raise DataError(f"a homography takes four points or more, no three on a line; got {len(pixels)}")
    plane = pixels if camera is None else camera.undistort_points(pixels)
    if not np.isfinite(plane).all() or not np.isfinite(ground).all():
        raise DataError("a point is not finite, or lies where the lens has no image; leave it out")
    H = _linear(ground, plane)  # image_H_ground: its errors are those that were made
    for _ in range(ROUNDS):
        residual, jacobian, root = _system(H, ground, pixels, camera, sigma_px, sigma_m)
        step = np.linalg.lstsq(root @ jacobian, root @ residual, rcond=1e-10)[0]
        H = H + step.reshape(3, 3)
        H /= np.linalg.norm(H)
        if np.linalg.norm(step) < 1e-12:
            break
    residual, jacobian, root = _system(H, ground, pixels, camera, sigma_px, sigma_m)
    cov = np.linalg.pinv((root @ jacobian).T @ (root @ jacobian), rcond=1e-10, hermitian=True)
    inverse = np.linalg.inv(H)
    change = np.kron(inverse, inverse.T)  # d(H⁻¹) = -H⁻¹ dH H⁻¹, row by row
    cov = change @ cov @ change.T
    sign = np.sign(np.mean(np.column_stack([plane, np.ones(len(plane))]) @ inverse[2]))
    spare = 2 * len(pixels) - 8
    rms = float(np.sqrt(np.mean(residual**2))) if spare > 0 else float("nan")
    return FittedHomography(sign * inverse, cov, rms)


def _linear(source: Array, target: Array) -> Array:
    """target_H_source by the direct linear transform."""
    t_source, t_target = _normalising(source), _normalising(target)
    a = np.column_stack([source, np.ones(len(source))]) @ t_source.T
    b = np.column_stack([target, np.ones(len(target))]) @ t_target.T
    rows = np.zeros((2 * len(a), 9))
    rows[0::2, :3], rows[0::2, 6:] = a, -b[:, :1] * a
    rows[1::2, 3:6], rows[1::2, 6:] = a, -b[:, 1:2] * a
    _, values, basis = np.linalg.svd(rows)
    if len(values) >= 8 and values[7] < FLAT * values[0]:
        raise UnderConstrainedError(
            "too many of the points lie on one line: four of them must span the ground, no three on a line"
        )
    H = np.linalg.inv(t_target) @ basis[-1].reshape(3, 3) @ t_source
    return np.asarray(H / np.linalg.norm(H))


def _normalising(points: Array) -> Array:
    """The similarity that brings points to mean 0 and mean distance √2."""
    middle = points.mean(axis=0)
    distance = float(np.linalg.norm(points - middle, axis=1).mean())
    if distance <= 0.0:
        raise UnderConstrainedError("all the points are one; take four that span the ground")
    scale = np.sqrt(2.0) / distance
    return np.array([[scale, 0.0, -scale * middle[0]], [0.0, scale, -scale * middle[1]], [0.0, 0.0, 1.0]])


def _system(
    H: Array, ground: Array, pixels: Array, camera: Camera | None, sigma_px: float, sigma_m: float
) -> tuple[Array, Array, Array]:
    """Residuals (2N,), their derivatives by image_H_ground (2N, 9), and the root of the weights (2N, 2N)."""
    n = len(ground)
    g = np.column_stack([ground, np.ones(n)])
    q = g @ H.T
    q[np.abs(q[:, 2]) < 1e-12, 2] = 1e-12
    plane = q[:, :2] / q[:, 2:]
    d_q = np.zeros((n, 2, 3))
    d_q[:, 0, 0] = d_q[:, 1, 1] = 1.0 / q[:, 2]
    d_q[:, :, 2] = -plane / q[:, 2:]
    if camera is None:
        seen = plane
    else:
        seen, d_point, _ = camera.project_jacobians(np.column_stack([plane, np.ones(n)]))
        d_q = d_point[:, :, :2] @ d_q
        if not np.isfinite(seen).all():
            raise DataError(
                "the points do not fit a plane that this camera sees; is each with its own pixel?"
            )
    jacobian = (d_q[:, :, :, None] * g[:, None, None, :]).reshape(2 * n, 9)
    by_place = d_q @ H[:, :2]
    cov = sigma_px**2 * np.eye(2) + sigma_m**2 * by_place @ by_place.transpose(0, 2, 1)
    root = np.zeros((2 * n, 2 * n))
    for k, block in enumerate(np.linalg.inv(np.linalg.cholesky(cov))):
        root[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = block
    return (pixels - seen).ravel(), jacobian, root
