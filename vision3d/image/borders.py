"""What lies beyond the edge of an image: five conventions, as OpenCV names them.

    constant    v v v | a b c d | v v v      a value that is given
    replicate   a a a | a b c d | d d d      the edge goes on
    reflect     c b a | a b c d | d c b      a mirror on the edge of the last pixel
    reflect101  d c b | a b c d | c b a      a mirror on its centre: the edge is not doubled
    wrap        b c d | a b c d | a b c      the image is a torus

Filters take reflect101 unless told otherwise, as OpenCV's do: it keeps gradients at the edge near zero
without weighing the last pixel twice.
"""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from vision3d.image.pixels import Image, as_image

__all__ = ["Border", "border_index", "cv2_border", "pad"]

Border: TypeAlias = Literal["constant", "replicate", "reflect", "reflect101", "wrap"]


def border_index(index: NDArray[np.int64], size: int, border: Border) -> NDArray[np.int64]:
    """Which pixel of a row of `size` stands at an index inside or outside; -1 where it is the constant.

    Raises
    ------
    DataError
        where there is no border of that name.
    """
    i = np.asarray(index, dtype=np.int64)
    match border:
        case "constant":
            return np.where((i < 0) | (i >= size), -1, i)
        case "replicate":
            return np.clip(i, 0, size - 1)
        case "reflect":  # period 2n: forwards, then backwards with both edges doubled
            folded = i % (2 * size)
            return np.minimum(folded, 2 * size - 1 - folded)
        case "reflect101":  # period 2n - 2: the edges are met once
            period = max(2 * size - 2, 1)
            folded = i % period
            return np.minimum(folded, period - folded) if size > 1 else np.zeros_like(i)
        case "wrap":
            return i % size
    raise DataError(f"no border {border!r}; known are {', '.join(get_args(Border))}")


def pad(
    image: Image,
    top: int,
    bottom: int,
    left: int,
    right: int,
    border: Border = "reflect101",
    value: float = 0,
) -> Image:
    """A larger image with the given one inside (OpenCV: `copyMakeBorder`).

    Parameters
    ----------
    image : (h, w) or (h, w, channels)
    top, bottom, left, right : pixels to add on each side
    value : of the constant border

    Returns
    -------
    (top + h + bottom, left + w + right) or the same with channels, of the image's type
    """
    inside = as_image(image)
    if min(top, bottom, left, right) < 0:
        raise DataError(f"a border of ({top}, {bottom}, {left}, {right}) pixels; expected none below zero")
    h, w = inside.shape[:2]
    out = np.empty((top + h + bottom, left + w + right, *inside.shape[2:]), inside.dtype)
    middle = out[top : top + h]
    middle[:, left : left + w] = inside
    _strip(middle[:, :left].swapaxes(0, 1), inside.swapaxes(0, 1), np.arange(-left, 0), border, value)
    beyond = np.arange(w, w + right)
    _strip(middle[:, left + w :].swapaxes(0, 1), inside.swapaxes(0, 1), beyond, border, value)
    # whole rows now, so that the corners follow
    _strip(out[:top], middle, np.arange(-top, 0), border, value)
    _strip(out[top + h :], middle, np.arange(h, h + bottom), border, value)
    return out


def _strip(out: Image, inside: Image, index: NDArray[np.int64], border: Border, value: float) -> None:
    """Rows of `out`: those of the image that the convention puts there."""
    source = border_index(index, len(inside), border)
    if border == "constant":
        out[...] = value
    else:
        out[...] = inside[source]


def cv2_border(border: Border) -> int:
    """OpenCV's number of a border."""
    import cv2

    numbers = {
        "constant": cv2.BORDER_CONSTANT,
        "replicate": cv2.BORDER_REPLICATE,
        "reflect": cv2.BORDER_REFLECT,
        "reflect101": cv2.BORDER_REFLECT_101,
        "wrap": cv2.BORDER_WRAP,
    }
    if border not in numbers:
        raise DataError(f"no border {border!r}; known are {', '.join(numbers)}")
    return numbers[border]
