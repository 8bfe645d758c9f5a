"""Derivatives of an image: Sobel and Scharr, and the gradient's length and direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from sequential.errors import DataError
from vision3d.image.borders import Border, cv2_border, pad
from vision3d.image.filters import arithmetic, correlate
from vision3d.image.pixels import Backend, Image, as_grey, as_image, checked_backend, per_channel, saturate

__all__ = ["Gradient", "derivative_kernels", "gradient", "sobel"]

Size: TypeAlias = Literal[1, 3, 5, 7, "scharr"]


@dataclass(frozen=True)
class Gradient:
    """The slope of an image at every pixel, in the kernel's own scale.

    Attributes
    ----------
    dx, dy : (h, w) float32, towards the right and downwards
    """

    dx: NDArray[np.float32]
    dy: NDArray[np.float32]

    @property
    def magnitude(self) -> NDArray[np.float32]:
        """(h, w) length."""
        return np.sqrt(self.dx * self.dx + self.dy * self.dy)

    @property
    def direction_rad(self) -> NDArray[np.float32]:
        """(h, w) angle in (-π, π], where the image brightens: 0 to the right, π/2 downwards."""
        return np.arctan2(self.dy, self.dx)


def derivative_kernels(dx: int, dy: int, size: Size = 3) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Taps along x and along y whose product is the window (OpenCV: `getDerivKernels`).

    A binomial smooths, each [-1, 1] differentiates once: Sobel's window of 3 is [-1 0 1] across [1 2 1].

    Raises
    ------
    DataError
        where the window is too small for the order.
    """
    if size == "scharr":
        if sorted((dx, dy)) != [0, 1]:
            raise DataError(f"Scharr's window is for one first derivative; asked for dx={dx}, dy={dy}")
        smooth, slope = np.array([3.0, 10.0, 3.0]), np.array([-1.0, 0.0, 1.0])
        return (slope, smooth) if dx else (smooth, slope)
    if min(dx, dy) < 0 or dx + dy < 1 or size not in (1, 3, 5, 7):
        raise DataError(f"sobel: dx={dx}, dy={dy}, size={size}; expected orders >= 0, one of them > 0, and"
                        " size 1, 3, 5, 7 or 'scharr'")  # fmt: skip
    return _taps(dx, size), _taps(dy, size)


def _taps(order: int, size: int) -> NDArray[np.float64]:
    length = 3 if size == 1 and order > 0 else size
    if order >= length:
        raise DataError(f"sobel: a derivative of order {order} needs a window above {size} pixels")
    taps = np.ones(1)
    for _ in range(length - 1 - order):
        taps = np.convolve(taps, [1.0, 1.0])
    for _ in range(order):
        taps = np.convolve(taps, [-1.0, 1.0])
    return taps


def sobel(
    image: ArrayLike,
    dx: int,
    dy: int,
    *,
    size: Size = 3,
    dtype: DTypeLike | None = None,
    border: Border = "reflect101",
    backend: Backend = "compiled",
) -> Image:
    """A derivative of the image (OpenCV: `Sobel`, `Scharr`), not divided by the window's weight.

    Parameters
    ----------
    image : (h, w) or (h, w, channels)
    dx, dy : orders of the derivative along x and y
    size : of the window, or "scharr"
    dtype : of the result; int16 for uint8, float32 for other integers, else the image's own
    """
    pixels = as_image(image)
    along_x, along_y = derivative_kernels(dx, dy, size)
    kind = np.dtype(dtype) if dtype is not None else _signed(pixels.dtype)
    window = np.outer(along_y, along_x)
    if checked_backend(backend) == "opencv" and border != "wrap" and pixels.dtype != np.int32:
        import cv2

        depth = {"int16": cv2.CV_16S, "float32": cv2.CV_32F}.get(kind.name, cv2.CV_64F)
        wide = cv2.CV_64F if pixels.dtype == np.float64 else depth
        ksize = cv2.FILTER_SCHARR if size == "scharr" else size
        done = cv2.Sobel(pixels, wide, dx, dy, ksize=ksize, borderType=cv2_border(border))
        return saturate(np.asarray(done).reshape(pixels.shape), kind)
    if backend == "numpy":
        return correlate(pixels, window, dtype=kind, border=border, backend="numpy")
    work = arithmetic(pixels.dtype, window, kind)
    row, column = len(along_y) // 2, len(along_x) // 2

    def one(channel: Image) -> Image:
        from vision3d.kernels import image_separable

        padded = pad(channel, row, row, column, column, border)
        if work.kind == "f":
            padded = padded.astype(work, copy=False)
        out = np.empty(channel.shape, work)
        image_separable.separable(padded, along_x.astype(work), along_y.astype(work), out)
        return saturate(out, kind)

    return per_channel(pixels, one)


def gradient(
    image: ArrayLike, *, size: Size = 3, border: Border = "reflect101", backend: Backend = "compiled"
) -> Gradient:
    """Both first derivatives of a grey image."""
    pixels = as_grey(image)
    dx, dy = (
        sobel(pixels, 1 - k, k, size=size, border=border, backend=backend).astype(np.float32, copy=False)
        for k in (0, 1)
    )
    return Gradient(dx, dy)


def _signed(kind: np.dtype) -> np.dtype:
    if kind == np.uint8:
        return np.dtype(np.int16)
    return kind if kind.kind == "f" else np.dtype(np.float32)
