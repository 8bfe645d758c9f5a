"""What every operation on images asks of its arguments, and how numbers become pixels again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import DTypeLike, NDArray

from sequential.errors import DataError, NotFiniteError, ShapeError

__all__ = ["Backend", "Image", "as_grey", "as_image", "as_mask", "checked_backend", "per_channel", "saturate"]

Image: TypeAlias = NDArray[Any]
Backend: TypeAlias = Literal["compiled", "numpy", "opencv"]
"""Who computes: loops compiled by Numba, the NumPy text that a student reads, or OpenCV."""
KINDS = tuple(np.dtype(kind) for kind in (np.uint8, np.uint16, np.int16, np.int32, np.float32, np.float64))


def as_image(image: Any, name: str = "image") -> Image:
    """The same pixels as a contiguous (h, w) or (h, w, channels) array; a mask of booleans becomes 0 and 255.

    Raises
    ------
    ShapeError
        where it is no image, or an empty one.
    DataError
        where its numbers are of a kind that images do not have.
    """
    pixels = np.asarray(image)
    if pixels.ndim not in (2, 3) or (pixels.ndim == 3 and not 1 <= pixels.shape[2] <= 4):
        raise ShapeError(
            f"{name} has shape {pixels.shape}; expected (height, width), or (height, width, channels) with up"
            " to 4 channels"
        )
    if pixels.size == 0:
        raise ShapeError(f"{name} of shape {pixels.shape} has no pixel; was the file read at all?")
    if pixels.dtype == np.bool_:
        return np.ascontiguousarray(pixels.astype(np.uint8) * np.uint8(255))
    if pixels.dtype not in KINDS:
        known = ", ".join(kind.name for kind in KINDS)
        raise DataError(f"{name} is of {pixels.dtype}; expected {known}: convert it with .astype(…)")
    return np.ascontiguousarray(pixels)


def as_grey(image: Any, name: str = "image") -> Image:
    """The same for an image of one channel, (h, w).

    Raises
    ------
    ShapeError
        where it has colours.
    """
    pixels = as_image(image, name)
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        return pixels[:, :, 0]
    if pixels.ndim == 3:
        raise ShapeError(f"{name} has {pixels.shape[2]} channels; expected one: convert it with grey(image)")
    return pixels


def as_bytes(image: Any, name: str = "image") -> NDArray[np.uint8]:
    """The same for one channel of 8 bits, which levels and thresholds are about.

    Raises
    ------
    DataError
        where it is not of uint8.
    """
    pixels = as_grey(image, name)
    if pixels.dtype != np.uint8:
        raise DataError(f"{name} is of {pixels.dtype}; expected uint8, values 0 to 255: scale it first")
    return pixels


def as_mask(mask: Any, name: str = "mask") -> NDArray[np.uint8]:
    """1 where a mask is set, and 0: any (h, w) array whose numbers are 0 or something else.

    Raises
    ------
    ShapeError
        where it is not two-dimensional, or empty.
    NotFiniteError
        where it holds NaN, which is neither.
    """
    given = np.asarray(mask)
    if given.ndim == 3 and given.shape[2] == 1:
        given = given[:, :, 0]
    if given.ndim != 2 or given.size == 0:
        raise ShapeError(f"{name} has shape {given.shape}; expected (height, width), with at least one pixel")
    if given.dtype.kind == "f" and not np.isfinite(given).all():
        raise NotFiniteError(f"{name} holds NaN or infinity, which is neither set nor clear; compare first")
    if given.dtype == np.bool_:
        return np.ascontiguousarray(given).view(np.uint8)
    return np.ascontiguousarray(given != 0).view(np.uint8)


def checked_backend(backend: str) -> Backend:
    """The name of a backend.

    Raises
    ------
    DataError
        where there is none of that name.
    """
    if backend not in get_args(Backend):
        raise DataError(f"no backend {backend!r}; known are {', '.join(get_args(Backend))}")
    return backend  # type: ignore[return-value]


def saturate(values: NDArray[Any], dtype: DTypeLike) -> Image:
    """Numbers as pixels of a type: rounded to the nearest (halves to even), and held within its range.

    This is OpenCV's `saturate_cast`: 255.5 and 300 become 255 in uint8, -3 becomes 0, 2.5 becomes 2.
    """
    kind = np.dtype(dtype)
    if kind == values.dtype or kind.kind == "f":
        return values.astype(kind, copy=False)
    limits = np.iinfo(kind)
    if values.dtype.kind == "f":
        values = np.rint(values)
    held: Image = np.clip(values, limits.min, limits.max).astype(kind)
    return held


def per_channel(image: Image, work: Callable[[Image], Image]) -> Image:
    """One channel after the other through a function of (h, w) images, put together again."""
    if image.ndim == 2:
        return work(image)
    parts = [work(np.ascontiguousarray(image[:, :, k])) for k in range(image.shape[2])]
    return np.stack(parts, axis=2)
