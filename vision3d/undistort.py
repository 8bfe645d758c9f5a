"""Images without distortion: look each pixel of a pinhole image up where the lens put it.

undistorter = Undistorter.of(camera, view="inside")
straight = undistorter(image)              # an image of the pinhole camera undistorter.target
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Array, Camera

__all__ = ["VIEWS", "Undistorter", "undistort", "undistort_maps", "undistorted_camera"]

VIEWS = ("same", "inside", "all")
Map = NDArray[np.float32]
STEEPEST = float(np.tan(np.radians(75.0)))
"""Largest x/z that an undistorted image shows: flat images stretch without bound towards 90°."""
BORDER_SAMPLES = 257
INWARD = 1e-4
"""What `inside` is smaller by, relative, so that rounded maps stay within the image."""


@dataclass(frozen=True, eq=False)
class Undistorter:
    """Undistorts any number of images of one camera.

    Parameters
    ----------
    camera : that takes them
    target : the pinhole camera that undistorted images are images of
    columns, rows : (h, w) where each of their pixels lies in the camera's image
    """

    camera: Camera
    target: Camera
    columns: Map
    rows: Map

    @classmethod
    def of(cls, camera: Camera, *, view: str = "same", size: tuple[int, int] | None = None) -> Undistorter:
        """Prepare for a camera; see `undistorted_camera` for `view` and `size`."""
        target = undistorted_camera(camera, view=view, size=size)
        return cls(camera, target, *undistort_maps(camera, target))

    @cached_property
    def seen(self) -> NDArray[np.bool_]:
        """(h, w) whether the camera sees what a pixel shows; the others are black."""
        width, height = self.camera.size
        inside = (self.columns >= 0) & (self.columns <= width - 1)
        return np.asarray(inside & (self.rows >= 0) & (self.rows <= height - 1))

    def __call__(self, image: NDArray[Any]) -> NDArray[Any]:
        """Undistort an image (h, w) or (h, w, channels); same type, 0 where the camera saw nothing.

        Raises
        ------
        ShapeError
            where the image has another size than the camera.
        """
        import cv2

        if image.shape[1::-1] != self.camera.size:
            width, height = self.camera.size
            raise ShapeError(
                f"the image is {image.shape[1]}x{image.shape[0]} px and the camera was calibrated at "
                f"{width}x{height}; use images of that size, or calibrate at theirs"
            )
        return cv2.remap(image, self.columns, self.rows, cv2.INTER_LINEAR)


def undistort(camera: Camera, image: NDArray[Any], *, view: str = "same") -> tuple[NDArray[Any], Camera]:
    """Undistort one image; gives it with its pinhole camera.  For many, keep an `Undistorter`."""
    undistorter = Undistorter.of(camera, view=view)
    return undistorter(image), undistorter.target


def undistorted_camera(camera: Camera, *, view: str = "same", size: tuple[int, int] | None = None) -> Camera:
    """Pinhole camera to undistort to.

    Parameters
    ----------
    camera : whose distortion is to go
    view : `"same"` keeps the intrinsics, so that positions in the middle hardly move; `"inside"` shows the
        largest centred rectangle without black borders; `"all"` shows every pixel of the camera, with black
        around.  The ratio fx / fy is kept: nothing is stretched.
    size : (width, height) of the undistorted image; None: the camera's

    Raises
    ------
    ModelError
        for an unknown view.

    Notes
    -----
    Rays of more than 75° off the axis are not asked for: an image on a plane would be mostly border.
    """
    if view not in VIEWS:
        raise ModelError(f"no view {view!r} of an undistorted image; known are {', '.join(VIEWS)}")
    width, height = camera.size if size is None else (int(size[0]), int(size[1]))
    if view == "same":
        return Camera("pinhole", camera.resized((width, height)).intrinsics, (), (width, height))
    fx, fy = camera.intrinsics[:2]
    left, right, top, bottom = _rectangle(camera, inner=view == "inside")
    across, down = (width - 1) / (fx * (right - left)), (height - 1) / (fy * (bottom - top))
    scale = (1.0 + INWARD) * max(across, down) if view == "inside" else min(across, down)
    fx, fy = scale * fx, scale * fy
    cx, cy = 0.5 * (width - 1 - fx * (left + right)), 0.5 * (height - 1 - fy * (top + bottom))
    return Camera("pinhole", (fx, fy, cx, cy), (), (width, height))


def undistort_maps(camera: Camera, target: Camera, camera_R_target: Array | None = None) -> tuple[Map, Map]:
    """Where the pixels of a pinhole image lie in the camera's image.

    Parameters
    ----------
    camera : the camera
    target : a pinhole camera
    camera_R_target : (3, 3) its attitude, for rectification; None: that of the camera

    Returns
    -------
    tuple
        columns and rows (h, w), float32, as `cv2.remap` takes them; far outside of the image for rays that
        the camera does not see.

    Raises
    ------
    ModelError
        where the target has a distortion.
    """
    from vision3d.kernels.undistortion import fill_maps

    if target.lens != "pinhole":
        raise ModelError(f"an undistorted image is that of a pinhole camera, got the lens {target.lens}")
    shape = target.size[::-1]
    columns, rows = np.empty(shape, dtype=np.float32), np.empty(shape, dtype=np.float32)
    R = np.eye(3) if camera_R_target is None else np.ascontiguousarray(camera_R_target, dtype=np.float64)
    brown = np.zeros(12)
    brown[: len(camera.distortion)] = camera.distortion
    fill_maps(camera.code, camera.parameters, brown, camera.limit, target.parameters, R, columns, rows)
    return columns, rows


def _rectangle(camera: Camera, *, inner: bool) -> tuple[float, float, float, float]:
    """Left, right, top, bottom (x/z and y/z) of what lies between the borders, or of all that they hold."""
    (x1, y1), share = np.array(camera.size) - 1.0, np.linspace(0.0, 1.0, BORDER_SAMPLES)
    zero = np.zeros_like(share)
    sides = [(zero, y1 * share), (zero + x1, y1 * share), (x1 * share, zero), (x1 * share, zero + y1)]
    left, right, top, bottom = (_flat(camera, np.column_stack(side)) for side in sides)
    if inner:
        columns = left[:, 0].max(), right[:, 0].min()
        lines = top[:, 1].max(), bottom[:, 1].min()
        return float(columns[0]), float(columns[1]), float(lines[0]), float(lines[1])
    whole = np.concatenate([left, right, top, bottom])
    (x0, y0), (x1, y1) = whole.min(axis=0), whole.max(axis=0)
    return float(x0), float(x1), float(y0), float(y1)


def _flat(camera: Camera, pixels: Array) -> Array:
    """Normalised coordinates (N, 2), no further than the lens and `STEEPEST` reach, also without a ray."""
    outward = (pixels - camera.intrinsics[2:]) / camera.intrinsics[:2]
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
    rays = camera.unproject(pixels)
    across = np.linalg.norm(rays[:, :2], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        flat: Array = rays[:, :2] / rays[:, 2:]
    reach = np.tan(min(camera.limit, 1.5)) if camera.lens == "fisheye4" else camera.limit
    furthest = min(STEEPEST, reach)
    steep = ~(across <= furthest * rays[:, 2])
    flat[steep] = furthest * outward[steep]
    return flat
