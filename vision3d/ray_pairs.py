"""Matched pixels of two cameras as pairs of rays that know their own noise: what every solver here takes.

A row has 18 numbers: the unit rays a and b, then how each moves with its pixel, A (3, 2) and B (3, 2), per
standard deviation of a coordinate.  So Sampson distances come out in standard deviations, whatever the lens.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotFiniteError, ShapeError
from vision3d.camera import Array, Camera

__all__ = ["moving_rays", "pairs_of_points", "pairs_of_rays", "ray_pairs"]


def moving_rays(camera: Camera, pixels: Array) -> tuple[Array, Array]:
    """Unit rays (N, 3) of pixels, and how they move with them (N, 3, 2), px⁻¹; NaN where there is none."""
    rays = camera.unproject(pixels)
    seen = np.isfinite(rays[:, 0])
    moves = np.full((len(rays), 3, 2), np.nan)
    slope = camera.project_jacobians(rays[seen])[1]
    # a pixel does not move with the length of its ray, so the pseudo-inverse stays across the ray
    moves[seen] = np.linalg.pinv(slope)
    return rays, moves


def ray_pairs(
    camera_a: Camera, camera_b: Camera, pixels_a: Array, pixels_b: Array, sigma_px: Any = 1.0
) -> tuple[Array, NDArray[np.bool_]]:
    """Rows (N, 18) of matched pixels, and which have a ray in both cameras, (N,) bool.

    Parameters
    ----------
    camera_a, camera_b : that took the pictures
    pixels_a, pixels_b : (N, 2) matched, px
    sigma_px : standard deviation of a coordinate: one number, (N,) for both sides, or (N, 2) for a and b

    Raises
    ------
    ShapeError, NotFiniteError
        where the pixels are not as many, a sigma is not positive, or a number is not finite.
    """
    pixels = [_pixels(rows) for rows in (pixels_a, pixels_b)]
    if len(pixels[0]) != len(pixels[1]):
        raise ShapeError(
            f"matches are pixels_a (N, 2) and pixels_b (N, 2), got {len(pixels[0])} and {len(pixels[1])}"
        )
    sigma = np.asarray(sigma_px, dtype=np.float64)
    count = len(pixels[0])
    if sigma.shape not in {(), (count,), (count, 2)}:
        raise ShapeError(f"sigma_px is one number, ({count},) or ({count}, 2) for a and b; got {sigma.shape}")
    sigma = np.broadcast_to(sigma[:, None] if sigma.ndim == 1 else sigma, (count, 2))
    if not (np.isfinite(sigma) & (sigma > 0.0)).all():
        raise NotFiniteError(
            "the standard deviation of a coordinate of a pixel, sigma_px, is a positive number"
        )
    rays, moves = zip(
        *(moving_rays(camera, rows) for camera, rows in zip((camera_a, camera_b), pixels, strict=True)),
        strict=True,
    )
    rows = _rows(rays, [move * sigma[:, side, None, None] for side, move in enumerate(moves)])
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(rows).all(axis=1))
    return rows, seen


def pairs_of_rays(rays_a: Array, rays_b: Array) -> Array:
    """Rows (N, 18) of unit rays (N, 3) whose noise is the same in every direction: distances in radians."""
    rays = [np.asarray(one, dtype=np.float64) for one in (rays_a, rays_b)]
    for one in rays:
        if one.ndim != 2 or one.shape != (len(rays[0]), 3):
            raise ShapeError(f"rays are two arrays (N, 3), got shapes {rays[0].shape} and {rays[1].shape}")
    rays = [one / np.linalg.norm(one, axis=1, keepdims=True) for one in rays]
    moves = []
    for one in rays:
        axis = np.eye(3)[np.argmin(np.abs(one), axis=1)]
        first = np.cross(one, axis)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        moves.append(np.stack([first, np.cross(one, first)], axis=-1))
    return _rows(rays, moves)


def pairs_of_points(points_a: Array, points_b: Array) -> Array:
    """Rows (N, 18) of normalised points (N, 2), x/z and y/z: distances in their unit."""
    rays, moves = [], []
    for points in (_pixels(points_a), _pixels(points_b)):
        homogeneous = np.column_stack([points, np.ones(len(points))])
        length = np.linalg.norm(homogeneous, axis=1)
        ray = homogeneous / length[:, None]
        rays.append(ray)
        moves.append((np.eye(3)[:, :2] - ray[:, :, None] * ray[:, None, :2]) / length[:, None, None])
    if len(rays[0]) != len(rays[1]):
        raise ShapeError(f"points are two arrays (N, 2), got {len(rays[0])} and {len(rays[1])} of them")
    return _rows(rays, moves)


def _rows(rays: Any, moves: Any) -> Array:
    n = len(rays[0])
    return np.ascontiguousarray(np.hstack([*rays, *(move.reshape(n, 6) for move in moves)]))


def _pixels(values: Any) -> Array:
    rows = np.ascontiguousarray(values, dtype=np.float64)
    if rows.size == 0:
        return rows.reshape(0, 2)
    if rows.ndim != 2 or rows.shape[1] != 2:
        raise ShapeError(f"matched points are arrays (N, 2), got shape {rows.shape}")
    if not np.isfinite(rows).all():
        raise NotFiniteError("matched points must be finite; leave out those that were not found")
    return rows
