"""Poses in which a person would hold a board, and sets of photographs with their truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.manifold.quaternion import quaternion_exp, quaternion_multiply, rotate
from vision3d.boards import Board
from vision3d.render.patterns import board_planes
from vision3d.render.scene import render_planes

if TYPE_CHECKING:
    from vision3d.camera import Camera

__all__ = ["RenderedSet", "board_pixels", "board_poses", "render_set"]

MARGIN_PX, OUTLINE_PX = 25.0, 4.0
TRIES = 2000


@dataclass(frozen=True, slots=True, eq=False)
class RenderedSet:
    """Photographs of one board by one camera, with what is true of them.

    Attributes
    ----------
    camera, board : what took them, and what they show
    images : n of (h, w) uint8
    poses : (n, 7) camera_T_board
    corners : (n, N, 2) px, where `board.points` truly project
    """

    camera: Camera
    board: Board
    images: tuple[NDArray[np.uint8], ...]
    poses: NDArray[np.float64]
    corners: NDArray[np.float64]

    def named(self) -> list[tuple[str, NDArray[np.uint8]]]:
        """Pairs of a name and an image, as `detect_views` takes them."""
        return [(f"view{k + 1:02d}", image) for k, image in enumerate(self.images)]


def board_pixels(camera: Camera, board: Board, camera_T_board: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where the points (N, 3) of a board project, (N, 2) px."""
    return _project(camera, board.points, camera_T_board)


def _project(
    camera: Camera, points: NDArray[np.float64], camera_T_board: NDArray[np.float64]
) -> NDArray[np.float64]:
    return camera.project(rotate(camera_T_board[:4], points) + camera_T_board[4:])


def board_poses(
    camera: Camera,
    board: Board,
    n: int,
    rng: np.random.Generator,
    *,
    tilt_rad: tuple[float, float] = (0.0, 0.8),
    fill: tuple[float, float] = (0.35, 0.9),
    margin_px: float = MARGIN_PX,
) -> NDArray[np.float64]:
    """Plausible poses (n, 7) camera_T_board: tilted about any axis, all over the image, every point inside.

    Parameters
    ----------
    tilt_rad : least and largest angle between the board's normal and the ray to its middle
    fill : least and largest extent of the board's diagonal, as a share of the image's
    margin_px : least distance of any point from the edge of the image

    Raises
    ------
    ModelError
        where no such pose is found: the board is too large for the image, or the bounds contradict it.
    """
    poses: list[NDArray[np.float64]] = []
    for _ in range(TRIES * n):
        if len(poses) == n:
            break
        pose = _pose(camera, board, rng, tilt_rad, fill)
        pixels = board_pixels(camera, board, pose)
        outline = _project(camera, board.outline, pose)
        if _inside(pixels, camera, margin_px) and _inside(outline, camera, OUTLINE_PX):
            poses.append(pose)
    if len(poses) < n:
        raise ModelError(
            f"{len(poses)} of {n} poses found with the whole board {margin_px:g} px inside the image of "
            f"{camera.size[0]} by {camera.size[1]} px; let `fill` {fill} begin lower"
        )
    return np.array(poses).reshape(n, 7)


def _inside(pixels: NDArray[np.float64], camera: Camera, margin_px: float) -> bool:
    last = np.array(camera.size) - 1 - margin_px
    return bool((pixels > margin_px).all() and (pixels < last).all())


def _pose(
    camera: Camera,
    board: Board,
    rng: np.random.Generator,
    tilt_rad: tuple[float, float],
    fill: tuple[float, float],
) -> NDArray[np.float64]:
    """One pose: the board's middle on the ray of a random pixel, at a random distance, turned and tilted."""
    points = board.points
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    size = np.array(camera.size, dtype=np.float64)
    ray = camera.unproject((size * rng.uniform(0.15, 0.85, 2))[None])[0]
    share = float(np.exp(rng.uniform(*np.log(fill))))
    distance = float(np.mean(camera.intrinsics[:2])) * diagonal / (share * float(np.linalg.norm(size)))
    axis = rng.uniform(0.0, 2.0 * np.pi)
    tilt = rng.uniform(*tilt_rad) * np.array([np.cos(axis), np.sin(axis), 0.0])
    roll = np.array([0.0, 0.0, rng.normal(0.0, 0.25)])
    facing = _turning_z_to(ray)
    attitude = quaternion_multiply(facing, quaternion_multiply(quaternion_exp(tilt), quaternion_exp(roll)))
    if attitude[0] < 0:
        attitude = -attitude
    return np.concatenate([attitude, distance * ray - rotate(attitude, middle)])


def _turning_z_to(ray: NDArray[np.float64]) -> NDArray[np.float64]:
    """The shortest rotation (4,) that takes the optical axis to a unit vector."""
    axis = np.array([-ray[1], ray[0], 0.0])
    sine = float(np.linalg.norm(axis))
    angle = float(np.arctan2(sine, ray[2]))
    scaled = axis if sine < 1e-12 else axis * (angle / sine)
    return quaternion_exp(scaled)


def render_set(
    camera: Camera,
    board: Board,
    n: int,
    rng: np.random.Generator,
    *,
    poses: NDArray[np.float64] | None = None,
    **settings: Any,
) -> RenderedSet:
    """Photograph a board n times, each image with noise of its own.

    Parameters
    ----------
    poses : (n, 7) camera_T_board; by default `board_poses`
    settings : of `render_planes`: blur_px, noise, vignetting …
    """
    chosen = board_poses(camera, board, n, rng) if poses is None else np.asarray(poses, dtype=np.float64)
    images = tuple(
        render_planes(camera, board_planes(board, pose), rng=own, **settings)
        for pose, own in zip(chosen, rng.spawn(len(chosen)), strict=True)
    )
    corners = np.array([board_pixels(camera, board, pose) for pose in chosen])
    for array in (chosen, corners, *images):
        array.setflags(write=False)
    return RenderedSet(camera, board, images, chosen, corners)
