"""A picture of a cloud without a graphics card: every point a small disc, the nearest one seen.

    camera, camera_T_world = viewpoint(points)
    image = splat(points, colors, camera, camera_T_world)

Edges are darkened where the depth jumps, which is what lets an eye see shape in a cloud of one colour:
Boucheny 2009, "Interactive scientific visualization of large datasets: towards a perceptive-based approach".
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError
from sequential.manifold.quaternion import quaternion_from_matrix
from vision3d.camera import Camera
from vision3d.cloud.arrays import Array, beside, checked_points
from vision3d.rigid import transform

__all__ = ["splat", "viewpoint"]

Image = NDArray[np.uint8]
Numbers = NDArray[np.int64]
WHITE, GREY = (255, 255, 255), (110, 120, 135)
STEPS = ((0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1))


def splat(
    points: ArrayLike,
    colors: ArrayLike | None,
    camera: Camera,
    camera_T_world: ArrayLike,
    *,
    radius_px: float = 1.0,
    shading: float = 0.6,
    background: tuple[int, int, int] = WHITE,
) -> Image:
    """Draw a cloud as a camera sees it.

    Parameters
    ----------
    points : (N, 3) in the world
    colors : (N, 3) uint8 RGB; without them everything is grey
    camera : any lens; its size is the picture's
    camera_T_world : (7,)
    radius_px : of a disc
    shading : how dark edges become, 0 for none

    Returns
    -------
    Array
        (h, w, 3) uint8 RGB.
    """
    place = checked_points(points)
    paint = np.broadcast_to(np.array(GREY, np.uint8), place.shape)
    if colors is not None:
        paint = beside(colors, place.shape, "colors").astype(np.uint8)
    width, height = camera.size
    seen = transform(np.asarray(camera_T_world, dtype=np.float64), place)
    pixels = camera.project(seen)
    index, which = _covered(pixels, radius_px, (width, height))
    order = np.argsort(-seen[which, 2], kind="stable")  # of what is written twice, the last, nearest stays
    index, which = index[order], which[order]
    depth, picture = np.full(width * height, np.inf), np.empty((width * height, 3), np.uint8)
    picture[:] = background
    depth[index], picture[index] = seen[which, 2], paint[which]
    shade = _edges(depth.reshape(height, width), shading).reshape(-1, 1)
    lit = np.where(np.isfinite(depth)[:, None], picture * shade, picture)
    return np.rint(lit).astype(np.uint8).reshape(height, width, 3)


def _covered(
    pixels: Array, radius_px: float, size: tuple[int, int]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which pixels of the picture the discs cover, and by which points."""
    reach = int(np.ceil(radius_px - 0.5))
    steps = [
        (dx, dy)
        for dy in range(-reach, reach + 1)
        for dx in range(-reach, reach + 1)
        if dx * dx + dy * dy <= radius_px * radius_px
    ]
    finite = np.flatnonzero(np.isfinite(pixels).all(axis=1) & (np.abs(pixels) < 1e6).all(axis=1))
    centre = np.rint(pixels[finite]).astype(np.int64)
    indices, whose = [], []
    for dx, dy in steps:
        x, y = centre[:, 0] + dx, centre[:, 1] + dy
        inside = (x >= 0) & (x < size[0]) & (y >= 0) & (y < size[1])
        indices.append(y[inside] * size[0] + x[inside])
        whose.append(finite[inside])
    return np.concatenate(indices), np.concatenate(whose)


def _edges(depth: Array, strength: float) -> Array:
    """(h, w) brightness: less where neighbours are nearer than the pixel itself."""
    near = np.log(np.where(np.isfinite(depth), depth, np.inf))
    edge = np.pad(near, 1, mode="edge")
    height, width = depth.shape
    hidden = np.zeros_like(depth)
    for dy, dx in STEPS:
        beside_it = edge[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width]
        with np.errstate(invalid="ignore"):
            step = near - beside_it
        hidden += np.where(np.isfinite(step), np.clip(step, 0.0, 0.05), 0.0)
    return np.asarray(np.exp(-strength * 20.0 * hidden / len(STEPS)))


def viewpoint(
    points: ArrayLike,
    *,
    size: tuple[int, int] = (960, 640),
    forward: ArrayLike = (0.35, 0.45, 1.0),
    down: ArrayLike = (0.0, 1.0, 0.0),
    keep: float = 0.96,
) -> tuple[Camera, Array]:
    """A camera that has a cloud in its picture.

    Parameters
    ----------
    points : (N, 3) in the world
    size : of the picture, px
    forward : (3,) where the camera looks; the default looks slightly from the left and from above
    down : (3,) a direction of the world that is down in the picture
    keep : share of the points that must be in view; far stragglers do not shrink the rest

    Returns
    -------
    tuple
        camera, and camera_T_world (7,).
    """
    place = checked_points(points, at_least=1)
    z = np.asarray(forward, dtype=np.float64)
    x = np.cross(np.asarray(down, dtype=np.float64), z)
    if not np.linalg.norm(x) > 1e-9 * np.linalg.norm(z):
        raise ModelError("down and forward point the same way; give two directions that do not")
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    camera_R_world = np.stack([x, np.cross(z, x), z])
    turned = place @ camera_R_world.T
    tails = 50.0 * (1.0 - keep)
    low, high = np.percentile(turned, [tails, 100.0 - tails], axis=0)
    centre, half = (low + high) / 2.0, np.maximum((high - low) / 2.0, 1e-9)
    width, height = size
    focal = 1.2 * max(width, height)
    away = 1.08 * focal * max(half[0] / (width / 2.0), half[1] / (height / 2.0))
    camera = Camera("pinhole", (focal, focal, (width - 1) / 2.0, (height - 1) / 2.0), (), size)
    moved = np.array([-centre[0], -centre[1], away + half[2] - centre[2]])
    return camera, np.concatenate([quaternion_from_matrix(camera_R_world), moved])
