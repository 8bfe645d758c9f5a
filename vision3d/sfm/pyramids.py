"""Cameras as pyramids: the tip where the camera was, the base what its image sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision3d.rigid import inverse, transform
from vision3d.sfm.reconstruction import Reconstruction

__all__ = ["camera_pyramids", "pyramid_size"]

Array = NDArray[np.float64]
FACES = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
SHARE = 0.06  # of the distance to the points


def pyramid_size(found: Reconstruction) -> float:
    """Depth of a pyramid that can be seen beside the points and hides few of them."""
    if not len(found.points):
        return SHARE
    middle = np.median(found.points, axis=0)
    return SHARE * float(np.median(np.linalg.norm(found.centres - middle, axis=1)))


def camera_pyramids(found: Reconstruction, depth: float | None = None) -> tuple[Array, NDArray[np.int64]]:
    """Corners (5 V, 3) in the world, tip first, then the image's corners round; and faces (4 V, 3)."""
    size = pyramid_size(found) if depth is None else depth
    corners = []
    for view, world_T_camera in enumerate(inverse(found.cameras_T_world)):
        camera = found.camera(view)
        width, height = camera.size
        fx, fy, cx, cy = camera.intrinsics  # straight edges: the pyramid of a pinhole camera
        edges = np.array([[0.0, 0.0], [width - 1.0, 0.0], [width - 1.0, height - 1.0], [0.0, height - 1.0]])
        base = np.column_stack([(edges - [cx, cy]) / [fx, fy], np.ones(4)]) * size
        corners.append(transform(world_T_camera, np.vstack([np.zeros(3), base])))
    faces = np.concatenate([FACES + 5 * view for view in range(len(found))]) if len(found) else FACES[:0]
    return np.concatenate(corners) if corners else np.zeros((0, 3)), faces
