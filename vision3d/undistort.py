"""Images without distortion: look each pixel of a pinhole image up where the lens put it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Camera

if TYPE_CHECKING:
    from vision3d.camera import Array

__all__ = ["View", "undistort", "undistort_maps", "undistorted_camera"]

View = Literal["same", "inside", "all"]


def undistort(camera: Camera, image: NDArray[Any], *, view: str = "same") -> tuple[NDArray[Any], Camera]:
    """Undistort an image.

    Parameters
    ----------
    camera : the camera that took it
    image : (h, w) or (h, w, channels), of the camera's size
    view : which pinhole camera to make it an image of, see `undistorted_camera`

    Returns
    -------
    tuple
        the image, of the same size and type, 0 where the camera saw nothing, and its pinhole camera.
    """
    import cv2

    if image.shape[1::-1] != camera.size:
        raise ShapeError(
            f"the image is {image.shape[1]}x{image.shape[0]} px and the camera was calibrated at "
            f"{camera.size[0]}x{camera.size[1]}; use images of that size"
        )
    target = undistorted_camera(camera, view=view)
    columns, rows = undistort_maps(camera, target)
    return cv2.remap(image, columns, rows, cv2.INTER_LINEAR), target


def undistorted_camera(camera: Camera, *, view: str = "same") -> Camera:
    """Pinhole camera to undistort to.

    `"same"` keeps the intrinsics.
    """
    if view != "same":
        raise ModelError(f"no view {view!r}; known is 'same'")
    return Camera("pinhole", camera.intrinsics, (), camera.size)


def undistort_maps(camera: Camera, target: Camera) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """For every pixel of the target's image, column and row (h, w) in the camera's image."""
    width, height = target.size
    across, down = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    rays: Array = target.unproject(np.stack([across, down], axis=-1))
    # far outside of the image where the camera has no ray: NaN would be undefined there
    pixels = np.nan_to_num(camera.project(rays), nan=-1e4).clip(-1e4, 1e5).astype(np.float32)
    return np.ascontiguousarray(pixels[..., 0]), np.ascontiguousarray(pixels[..., 1])
