"""First guesses of a pose: from the homography of a plane, both ways it may be tilted, or from OpenCV."""

from __future__ import annotations

import numpy as np

from sequential.errors import DataError, UnderConstrainedError
from sequential.manifold.quaternion import (
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_normalize,
    rotation_matrix,
)
from vision3d.camera import Array, Camera

__all__ = ["flipped", "frontal_pose", "starting_poses"]

LINE, PLANE, FLAT = 1e-6, 1e-6, 0.3
"""Extents relative to the largest: below them points lie on a line, on a plane, or nearly so."""


def starting_poses(camera: Camera, points: Array, pixels: Array) -> list[Array]:
    """Poses (7,) camera_T_object to refine.

    Parameters
    ----------
    camera : that took the picture
    points : (N, 3) on the object, m
    pixels : (N, 2), px

    Raises
    ------
    UnderConstrainedError
        where the points lie on a line.
    DataError
        where fewer than four pixels have a ray.
    """
    rays = camera.unproject(pixels)
    seen = np.isfinite(rays[:, 0])
    if seen.sum() < 4:
        raise DataError(
            f"{int(seen.sum())} of {len(pixels)} pixels have a ray in this camera, four are needed; the lens "
            "folds inside the image, or the pixels are of another camera"
        )
    centre = points.mean(axis=0)
    _, extents, axes = np.linalg.svd(points - centre, full_matrices=False)
    if extents[1] <= LINE * extents[0]:
        raise UnderConstrainedError("the points lie on a line, about which the object may turn")
    normal = axes[2] * np.sign(np.linalg.det(axes))
    if extents[2] <= PLANE * extents[0]:
        first = _plane_pose(rays[seen], points[seen], centre, np.array([axes[0], axes[1], normal]))
    else:
        first = _space_pose(rays[seen], points[seen])
    if extents[2] > FLAT * extents[0]:
        return [first]
    return [first, flipped(first, centre, normal)]


def flipped(camera_T_object: Array, centre: Array, normal: Array) -> Array:
    """The rival of a flat object's pose: its depths about the centre reversed.

    Seen from afar, a plane tilted away and one tilted towards the camera by as much have the same picture.
    Mirror the object along the line of sight, and in its own plane, which takes the handedness back.

    Parameters
    ----------
    camera_T_object : (7,)
    centre, normal : (3,) of the plane, in the frame of the object
    """
    R = rotation_matrix(camera_T_object[:4])
    place = R @ centre + camera_T_object[4:]
    sight = place / np.linalg.norm(place)
    mirrored = (np.eye(3) - 2.0 * np.outer(sight, sight)) @ R @ (np.eye(3) - 2.0 * np.outer(normal, normal))
    return _pose(mirrored, place - mirrored @ centre)


def frontal_pose(camera: Camera, points: Array, pixels: Array) -> Array:
    """The pose (7,) of an object that faces the camera, as large and turned as its pixels say.

    A start that noise cannot spoil: the homography of a dozen pixels may put points behind the camera.
    """
    rays = camera.unproject(pixels)
    seen = np.isfinite(rays[:, 0])
    rays, points = rays[seen], points[seen]
    sight = rays.mean(axis=0)
    basis = np.linalg.svd(sight[None])[2][[1, 2, 0]]
    basis *= np.sign(np.array([1.0, 1.0, basis[2] @ sight]))[:, None]
    basis[0] *= np.linalg.det(basis)
    centre = points.mean(axis=0)
    axes = np.linalg.svd(points - centre, full_matrices=False)[2]
    axes[2] *= np.linalg.det(axes)
    flat, image = (points - centre) @ axes[:2].T, rays @ basis[:2].T
    left, scales, right = np.linalg.svd(np.linalg.lstsq(flat, image - image.mean(axis=0), rcond=None)[0].T)
    turn = np.eye(3)
    turn[:2, :2] = left @ right
    turn[2, 2] = np.linalg.det(left @ right)  # seen from behind, its normal comes towards the camera
    R = basis.T @ turn @ axes
    return _pose(R, sight / np.linalg.norm(sight) / scales.mean() - R @ centre)


def _plane_pose(rays: Array, points: Array, centre: Array, axes: Array) -> Array:
    """Pose from the homography that takes points of the plane to rays: ray x (H p) = 0."""
    flat = (points - centre) @ axes[:2].T
    scale = float(np.sqrt(np.mean(flat**2)))
    p = np.column_stack([flat / scale, np.ones(len(flat))])
    # [ray]x' [ray]x = I - ray ray', so the normal matrix is a sum of Kronecker products
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    normal = np.einsum("nij,nkl->ikjl", across, p[:, :, None] * p[:, None, :]).reshape(9, 9)
    H = np.linalg.eigh(normal)[1][:, 0].reshape(3, 3)
    if np.sum(rays * (p @ H.T)) < 0.0:
        H = -H  # in front of the camera: along the rays
    size = np.sqrt(np.linalg.norm(H[:, 0]) * np.linalg.norm(H[:, 1]))
    first, second, shift = (H / size).T
    # the nearest rotation to what noise has made of one (Zhang 2000, appendix C)
    left, _, right = np.linalg.svd(np.column_stack([first, second, np.cross(first, second)]))
    camera_R_plane = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    R = camera_R_plane @ axes
    return _pose(R, shift * scale - R @ centre)


def _space_pose(rays: Array, points: Array) -> Array:
    """Pose of points that fill space, from OpenCV's SQPnP on an ideal camera."""
    import cv2

    from vision3d.cv import solve_pnp_all

    ahead = rays[:, 2] > 1e-3
    if ahead.sum() < 4:
        raise DataError("fewer than four of the points lie in front of the image plane of the camera")
    flat = rays[ahead, :2] / rays[ahead, 2:]
    solutions = solve_pnp_all(points[ahead], flat, np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_SQPNP)
    if not solutions:
        raise DataError("no pose explains the pixels; are points and pixels in the same order?")
    turn, shift, _ = solutions[0]
    return np.concatenate([quaternion_normalize(quaternion_exp(turn)), shift])


def _pose(R: Array, shift: Array) -> Array:
    return np.concatenate([quaternion_from_matrix(R), shift])
