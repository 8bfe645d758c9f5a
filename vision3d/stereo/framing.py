"""Focal length and principal points of rectified images: what of both pictures they show."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from vision3d.camera import Camera
from vision3d.stereo.rig import StereoRig

__all__ = ["framed"]

Array = NDArray[np.float64]
Box = tuple[int, int, int, int]
SAMPLES = 513
"""Points along each side of a picture."""
STEEPEST = float(np.tan(np.radians(75.0)))
"""Largest x/z that a rectified image is made to show."""
INWARD = 1e-4
"""What an image without black is smaller by, relative, so that rounded maps stay within the picture."""


class Border(NamedTuple):
    """Sides of a picture (N, 2) as the rectified camera sees them, in focal lengths from its axis."""

    left: Array
    right: Array
    top: Array
    bottom: Array

    def inner(self) -> Array:
        """(x0, y0, x1, y1) of a rectangle between the sides."""
        return np.array(
            [self.left[:, 0].max(), self.top[:, 1].max(), self.right[:, 0].min(), self.bottom[:, 1].min()]
        )

    def outer(self) -> Array:
        """(x0, y0, x1, y1) of the rectangle around them."""
        whole = np.concatenate(self)
        return np.concatenate([whole.min(axis=0), whole.max(axis=0)])


def framed(
    rig: StereoRig,
    attitudes: tuple[Array, Array],
    size: tuple[int, int],
    alpha: float | None,
    *,
    zero_disparity: bool,
) -> tuple[tuple[Camera, Camera], tuple[Box, Box]]:
    """Rectified cameras, and the part of each image that is all picture.

    Raises
    ------
    ModelError
        where nothing of a picture is left in front of the rectified camera.
    """
    cameras, axis = (rig.left, rig.right), int(rig.is_vertical)
    borders = tuple(_border(camera, R) for camera, R in zip(cameras, attitudes, strict=True))
    focal = _focal(cameras, size, axis)
    middle = 0.5 * (np.array(size) - 1.0)
    # the mean of a picture's four corners is put into the middle of its image
    offsets = np.array([middle - focal * _corners(border).mean(axis=0) for border in borders])
    shared = offsets.mean(axis=0)
    offsets[:, 1 - axis] = shared[1 - axis]
    if zero_disparity:
        offsets[:] = shared
    if alpha is not None:
        focal = _zoomed(borders, offsets, size, alpha)
    made = [Camera("pinhole", (focal, focal, *offset), (), size) for offset in offsets]
    valid = [_valid(border.inner(), camera) for border, camera in zip(borders, made, strict=True)]
    return (made[0], made[1]), (valid[0], valid[1])


def _focal(cameras: tuple[Camera, Camera], size: tuple[int, int], axis: int) -> float:
    """OpenCV's: the mean focal length across the baseline, scaled as the image is."""
    across = 1 - axis
    ratios = [camera.intrinsics[across] * size[across] / camera.size[across] for camera in cameras]
    return float(np.mean(ratios))


def _zoomed(borders: tuple[Border, ...], offsets: Array, size: tuple[int, int], alpha: float) -> float:
    """Focal length at which the image lies between the sides (alpha 0), or holds them all (alpha 1)."""
    last = np.array(size) - 1.0
    inner: list[Array] = []
    outer: list[Array] = []
    for border, offset in zip(borders, offsets, strict=True):
        room = np.concatenate([offset, last - offset])
        for kept, box in ((inner, border.inner()), (outer, border.outer())):
            reach = np.concatenate([-box[:2], box[2:]])
            kept.append(room / np.where(reach > 0.0, reach, np.nan))
    if not (np.isfinite(inner).all() and np.isfinite(outer).all()):
        raise ModelError(
            "the cameras have no image plane in common on which both pictures lie around its middle; they "
            "look too far apart (or is the rotation between them wrong?)"
        )
    tight, wide = (1.0 + INWARD) * float(np.max(inner)), float(np.min(outer))
    return (1.0 - alpha) * tight + alpha * wide


def _valid(inner: Array, camera: Camera) -> Box:
    """First and last column and row of the image that lie within the picture."""
    low = np.ceil(camera.intrinsics[:2] * inner[:2] + camera.intrinsics[2:] - 1e-6)
    high = np.floor(camera.intrinsics[:2] * inner[2:] + camera.intrinsics[2:] + 1e-6)
    x0, y0 = np.maximum(low, 0.0)
    x1, y1 = np.minimum(high, np.array(camera.size) - 1.0)
    return int(x0), int(y0), int(x1), int(y1)


def _corners(border: Border) -> Array:
    return np.concatenate([border.top[[0, -1]], border.bottom[[0, -1]]])


def _border(camera: Camera, camera_R_rectified: Array) -> Border:
    """Sides of the picture on the rectified image plane, no further off than `STEEPEST`."""
    (x1, y1), share = np.array(camera.size) - 1.0, np.linspace(0.0, 1.0, SAMPLES)
    zero = np.zeros_like(share)
    sides = [(zero, y1 * share), (zero + x1, y1 * share), (x1 * share, zero), (x1 * share, zero + y1)]
    middle = camera_R_rectified[2]  # the camera's own axis as the rectified camera sees it
    if not middle[2] > 0.1:
        raise ModelError(
            "a camera of the rig looks away from the rectified image plane by more than 84°; the cameras of "
            "a stereo rig look the same way: is the rotation between them right?"
        )
    return Border(*(_flat(camera, np.column_stack(side), camera_R_rectified) for side in sides))


def _flat(camera: Camera, pixels: Array, R: Array) -> Array:
    rays = camera.unproject(pixels)
    lost = ~np.isfinite(rays[:, 0])
    if lost.any():
        # beyond the lens: as far out as is asked for, on the pixel's own side
        outward = (pixels[lost] - camera.intrinsics[2:]) / camera.intrinsics[:2]
        outward *= STEEPEST / np.linalg.norm(outward, axis=1, keepdims=True)
        rays[lost] = np.column_stack([outward, np.ones(len(outward))])
    turned = rays @ R
    across = np.linalg.norm(turned[:, :2], axis=1)
    z = np.maximum(turned[:, 2], across / STEEPEST)
    flat: Array = turned[:, :2] / z[:, None]
    return flat
