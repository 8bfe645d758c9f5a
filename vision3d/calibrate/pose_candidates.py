"""Poses of a board that a camera would see well: what the choice of the next pose chooses from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.manifold.quaternion import quaternion_exp, quaternion_from_matrix, rotate, rotation_matrix
from vision3d.boards import Board, CharucoBoard, MarkerBoard
from vision3d.calibrate.uncertainty import pixel_grid
from vision3d.camera import Camera
from vision3d.lenses import LENSES

__all__ = ["pose_candidates"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PLACES = (9, 7)
"""Columns and rows of the places in the image that are tried for the middle of the board."""
SIZES = (0.35, 0.55, 0.8, 1.1)
"""Sizes that are tried: the board's diagonal in units of the image's shorter side."""
TILTS_RAD = (float(np.radians(30.0)), float(np.radians(45.0)))
DIRECTIONS = 8
MARGIN = 0.02
"""Share of the image's shorter side that is kept free around the board."""
LEAST_PITCH_PX = 12.0
"""Neighbouring corners closer than this are not found well."""
LEAST_SEEN = 0.4
"""Share of the corners that must be in the image, for boards that need not be seen whole."""


def pose_candidates(camera: Camera, board: Board) -> tuple[Array, Mask]:
    """Lay out poses over the image, at several distances and tilts, and keep those that show the board well.

    Returns
    -------
    poses, seen : Array, Mask
        (C, 7) camera_T_board, and which points of the board are in the image, (C, N).
    """
    poses = _laid_out(camera, board)
    if not _known_by_part(board):
        poses = poses[_inside(camera, camera.project(_placed(poses, board.outline))).all(axis=1)]
    pixels = camera.project(_placed(poses, board.points))
    seen = _inside(camera, pixels)
    good = seen.mean(axis=1) >= (LEAST_SEEN if _known_by_part(board) else 1.0)
    good &= _pitch(board, pixels) >= LEAST_PITCH_PX
    return poses[good], seen[good]


def _laid_out(camera: Camera, board: Board) -> Array:
    """Every place, size and tilt, (C, 7)."""
    middle = board.points.mean(axis=0)
    diagonal = 2.0 * float(np.linalg.norm(board.points - middle, axis=1).max())
    focal = float(np.sqrt(camera.intrinsics[0] * camera.intrinsics[1]))
    rays = camera.unproject(pixel_grid(camera.size, PLACES))
    rays = rays[np.isfinite(rays[:, 0])]
    fisheye = LENSES[camera.lens].is_fisheye
    facing = np.array([_towards(ray) if fisheye else np.eye(3) for ray in rays])
    R = np.einsum("rij,tjk->rtik", facing, rotation_matrix(quaternion_exp(_tilts()))).reshape(-1, 3, 3)
    at = np.repeat(rays if fisheye else rays / rays[:, 2:], len(_tilts()), axis=0)
    depths = [diagonal * focal / (size * min(camera.size)) for size in SIZES]
    turns = quaternion_from_matrix(R)
    return np.concatenate([np.concatenate([turns, at * depth - R @ middle], axis=1) for depth in depths])


def _tilts() -> Array:
    """Rotation vectors of all tilts that are tried, (T, 3)."""
    around = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    axes = np.stack([np.cos(around), np.sin(around), np.zeros(DIRECTIONS)], axis=-1)
    return np.concatenate([np.zeros((1, 3)), *(tilt * axes for tilt in TILTS_RAD)])


def _placed(poses: Array, points: Array) -> Array:
    """Points (N, 3) of the board in the camera frame at every pose, (C, N, 3)."""
    return rotate(poses[:, None, :4], points[None]) + poses[:, None, 4:]


def _inside(camera: Camera, pixels: Array) -> Mask:
    """Whether pixels (C, N, 2) are in the image, a margin kept; not where there is no projection."""
    margin = MARGIN * min(camera.size)
    with np.errstate(invalid="ignore"):
        inside: Mask = np.all((pixels > margin) & (pixels < np.array(camera.size) - 1.0 - margin), axis=-1)
    return inside


def _known_by_part(board: Board) -> bool:
    """Whether a part of the board is enough: its points tell their numbers."""
    return isinstance(board, CharucoBoard | MarkerBoard)


def _pitch(board: Board, pixels: Array) -> Array:
    """Smallest distance between the images of neighbouring corners, (C,)."""
    columns, rows = board.shape
    if columns * rows != board.count or columns < 2 or rows < 2:
        return np.full(len(pixels), np.inf)
    table = pixels.reshape(-1, rows, columns, 2)
    across = np.linalg.norm(np.diff(table, axis=2), axis=-1).reshape(len(pixels), -1)
    down = np.linalg.norm(np.diff(table, axis=1), axis=-1).reshape(len(pixels), -1)
    smallest: Array = np.fmin(np.nanmin(across, axis=1), np.nanmin(down, axis=1))
    return smallest


def _towards(ray: Array) -> Array:
    """Rotation (3, 3) that turns the optical axis onto a ray by the shortest way."""
    axis = np.cross([0.0, 0.0, 1.0], ray)
    sine = float(np.linalg.norm(axis))
    angle = float(np.arctan2(sine, ray[2]))
    return rotation_matrix(quaternion_exp(axis * (angle / sine if sine > 1e-12 else 0.0)))
