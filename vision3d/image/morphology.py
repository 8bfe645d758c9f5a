"""Erosion and dilation, and what is made of them.

An erosion takes the smallest pixel under a structuring element, a dilation the largest.  An opening (erosion,
then dilation) removes specks smaller than the element and leaves the rest as it was; a closing fills holes.
"""

from __future__ import annotations

from math import sqrt
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from vision3d.image.borders import Border, cv2_border, pad
from vision3d.image.pixels import Backend, Image, as_image, checked_backend, per_channel, saturate

__all__ = ["closing", "dilate", "erode", "morphological_gradient", "opening", "structuring_element"]

Shape: TypeAlias = Literal["rectangle", "cross", "ellipse"]


def structuring_element(size: int | tuple[int, int], shape: Shape = "rectangle") -> NDArray[np.uint8]:
    """A window of ones and zeros (OpenCV: `getStructuringElement`).

    Parameters
    ----------
    size : pixels, or (width, height)

    Returns
    -------
    (height, width) uint8
    """
    width, height = (size, size) if isinstance(size, int) else size
    if min(width, height) < 1:
        raise ShapeError(f"a structuring element of {width}x{height} pixels; expected one pixel at least")
    if shape not in get_args(Shape):
        raise DataError(f"no structuring element {shape!r}; known are {', '.join(get_args(Shape))}")
    if shape == "rectangle" or (width == 1 and height == 1):
        return np.ones((height, width), np.uint8)
    row, column = height // 2, width // 2
    element = np.zeros((height, width), np.uint8)
    if shape == "cross":
        element[row, :] = element[:, column] = 1
        return element
    for j in range(height):
        if abs(j - row) <= row:
            half = round(column * sqrt(row**2 - (j - row) ** 2) / row) if row else 0
            element[j, max(column - half, 0) : min(column + half + 1, width)] = 1
    return element


def erode(image: ArrayLike, element: ArrayLike | int = 3, **options: Any) -> Image:
    """The smallest pixel under the element (OpenCV: `erode`).

    Parameters
    ----------
    image : (h, w) or (h, w, channels)
    element : from `structuring_element`, or the side of a square
    **options : `iterations`, 1 unless given; `border`, "constant" unless given, and then what lies outside
        never wins, unless `value` says what it is; `backend`, "compiled", "numpy" or "opencv"
    """
    return _morphed(image, element, largest=False, **options)


def dilate(image: ArrayLike, element: ArrayLike | int = 3, **options: Any) -> Image:
    """The largest pixel under the element (OpenCV: `dilate`); arguments as for `erode`."""
    return _morphed(image, element, largest=True, **options)


def opening(image: ArrayLike, element: ArrayLike | int = 3, **options: Any) -> Image:
    """Eroded, then dilated: bright specks that the element does not fit into are gone."""
    return dilate(erode(image, element, **options), element, **options)


def closing(image: ArrayLike, element: ArrayLike | int = 3, **options: Any) -> Image:
    """Dilated, then eroded: dark holes and gaps that the element does not fit into are filled."""
    return erode(dilate(image, element, **options), element, **options)


def morphological_gradient(image: ArrayLike, element: ArrayLike | int = 3, **options: Any) -> Image:
    """Dilation less erosion: the edges."""
    return saturate(
        dilate(image, element, **options).astype(np.float64) - erode(image, element, **options),
        as_image(image).dtype,
    )


def _morphed(
    image: ArrayLike,
    element: ArrayLike | int,
    *,
    largest: bool,
    iterations: int = 1,
    border: Border = "constant",
    value: float | None = None,
    backend: Backend = "compiled",
) -> Image:
    pixels = as_image(image)
    window = _window(element)
    if iterations < 1:
        return pixels.copy()
    if window.all():  # a square repeated is a larger square
        rows, columns = ((n - 1) * iterations + 1 for n in window.shape)
        anchor = (window.shape[0] // 2 * iterations, window.shape[1] // 2 * iterations)
        window, iterations = np.ones((rows, columns), np.uint8), 1
    else:
        anchor = (window.shape[0] // 2, window.shape[1] // 2)
    outside = value if value is not None else neutral(pixels.dtype, largest=largest)
    if checked_backend(backend) == "opencv" and border != "wrap" and pixels.dtype != np.int32:
        import cv2

        work = cv2.dilate if largest else cv2.erode
        done = work(
            pixels, window, anchor=anchor[::-1], iterations=iterations, borderType=cv2_border(border),
            borderValue=[outside] * 4,
        )  # fmt: skip
        return np.asarray(done).reshape(pixels.shape)
    for _ in range(iterations):
        pixels = per_channel(
            pixels, lambda one: _once(one, window, anchor, largest, border, outside, backend)
        )
    return pixels


def _window(element: ArrayLike | int) -> NDArray[np.uint8]:
    if isinstance(element, int | np.integer):
        return structuring_element(int(element))
    window: NDArray[np.uint8] = (np.asarray(element) != 0).astype(np.uint8)
    if window.ndim != 2 or not window.any():
        raise ShapeError(
            f"a structuring element of shape {window.shape} with {int(window.sum())} ones; expected (rows,"
            " columns) with at least one"
        )
    return window


def neutral(kind: np.dtype, *, largest: bool) -> float:
    """The value that never wins."""
    if kind.kind == "f":
        limit = float(np.finfo(kind).max)
        return -limit if largest else limit
    return float(np.iinfo(kind).min if largest else np.iinfo(kind).max)


def _once(
    image: Image,
    window: NDArray[np.uint8],
    anchor: tuple[int, int],
    largest: bool,  # noqa: FBT001
    border: Border,
    outside: float,
    backend: Backend,
) -> Image:
    (rows, columns), (row, column) = window.shape, anchor
    padded = pad(image, row, rows - 1 - row, column, columns - 1 - column, border, outside)
    if backend == "numpy":
        h, w = image.shape
        pick = np.maximum if largest else np.minimum
        parts = (padded[j : j + h, i : i + w] for j, i in np.argwhere(window))
        out = next(parts).copy()
        for part in parts:
            pick(out, part, out=out)
        return out
    work = np.dtype(np.uint8) if image.dtype == np.uint8 else np.dtype(np.float64)
    work = image.dtype if image.dtype.kind == "f" else work
    padded = padded.astype(work, copy=False)
    if window.all():
        padded = _along(padded.T, rows, largest).T if rows > 1 else padded
        padded = _along(padded, columns, largest) if columns > 1 else padded
        return np.ascontiguousarray(padded).astype(image.dtype, copy=False)
    from vision3d.kernels import image_morphology

    out = np.empty(image.shape, work)
    image_morphology.extreme(padded, np.ascontiguousarray(np.argwhere(window)), largest, out)
    return out.astype(image.dtype, copy=False)


def _along(padded: Image, size: int, largest: bool) -> Image:  # noqa: FBT001
    """The extreme of `size` neighbours along x: windows that double, since a pixel may be counted twice."""
    pick = np.maximum if largest else np.minimum
    width, out = 1, padded
    while 2 * width <= size:
        out = pick(out[:, :-width], out[:, width:])
        width *= 2
    rest = size - width
    return pick(out[:, : out.shape[1] - rest], out[:, rest:]) if rest else out
