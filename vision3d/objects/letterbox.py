"""An image of any shape on the canvas that a network wants, and the way back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ShapeError
from vision3d.image.pixels import as_image

__all__ = ["Placement", "letterbox"]


@dataclass(frozen=True, slots=True)
class Placement:
    """Where an image lies on a canvas.

    Attributes
    ----------
    image_size, canvas_size : (width, height) px
    scale : canvas pixels a pixel of the image, along x and y
    offset : (left, top) of the image on the canvas, px
    """

    image_size: tuple[int, int]
    canvas_size: tuple[int, int]
    scale: tuple[float, float]
    offset: tuple[int, int]

    def to_image(self, boxes: ArrayLike) -> NDArray[np.float64]:
        """Boxes (n, 4) of the canvas in pixels of the image, cut at its edges."""
        rows = np.asarray(boxes, dtype=np.float64).reshape(-1, 4)
        scale, offset = np.array(self.scale), np.array(self.offset, dtype=np.float64)
        size = np.array(self.image_size, dtype=np.float64)
        low = np.clip((rows[:, :2] - offset) / scale, 0.0, size)
        high = np.clip((rows[:, :2] + rows[:, 2:] - offset) / scale, 0.0, size)
        return np.hstack([low, high - low])

    def to_canvas(self, boxes: ArrayLike) -> NDArray[np.float64]:
        """Boxes (n, 4) of the image in pixels of the canvas."""
        rows = np.asarray(boxes, dtype=np.float64).reshape(-1, 4)
        scale = np.array(self.scale)
        return np.hstack([rows[:, :2] * scale + np.array(self.offset), rows[:, 2:] * scale])

    def crop(self, map_size: tuple[int, int]) -> tuple[slice, slice]:
        """Rows and columns of a map over the canvas, of (width, height) cells, that the image covers."""
        slices = []
        for axis in (1, 0):
            cells = map_size[axis] / self.canvas_size[axis]
            first = self.offset[axis] * cells
            last = first + self.image_size[axis] * self.scale[axis] * cells
            slices.append(slice(round(first), max(round(last), round(first) + 1)))
        return slices[0], slices[1]


def letterbox(
    image: ArrayLike, canvas_size: tuple[int, int], *, keep_shape: bool = True, fill: int = 114
) -> tuple[NDArray[np.uint8], Placement]:
    """The image on a canvas, as large as fits, in the middle, a plain colour around it.

    Parameters
    ----------
    image : (h, w, 3) uint8
    canvas_size : (width, height) px
    keep_shape : else the image is stretched to fill the canvas, as some networks were trained
    fill : level of what is around; 114 is what YOLO was trained with

    Returns
    -------
    canvas (height, width, 3), and where the image lies on it
    """
    import cv2

    pixels = as_image(image)
    if pixels.ndim == 2:
        pixels = np.dstack([pixels] * 3)
    if pixels.shape[2] not in (3, 4) or pixels.dtype != np.uint8:
        raise ShapeError(
            f"image is {pixels.dtype} of shape {pixels.shape}; expected uint8 (height, width, 3)"
        )
    height, width = pixels.shape[:2]
    wide, high = canvas_size
    ratio = min(wide / width, high / height)
    inner = (max(round(width * ratio), 1), max(round(height * ratio), 1)) if keep_shape else canvas_size
    left, top = (wide - inner[0]) // 2, (high - inner[1]) // 2
    canvas = np.full((high, wide, 3), fill, np.uint8)
    shrinking = inner[0] < width and inner[1] < height
    way = cv2.INTER_AREA if shrinking else cv2.INTER_LINEAR
    canvas[top : top + inner[1], left : left + inner[0]] = cv2.resize(
        np.ascontiguousarray(pixels[:, :, :3]), inner, interpolation=way
    )
    scale = (inner[0] / width, inner[1] / height)
    return canvas, Placement((width, height), (wide, high), scale, (left, top))
