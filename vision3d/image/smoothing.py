"""Gaussian smoothing: the kernel, and the blur that runs along rows and then along columns."""

from __future__ import annotations

from math import exp

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from vision3d.image.borders import Border, cv2_border, pad
from vision3d.image.filters import correlate
from vision3d.image.pixels import Backend, Image, as_image, checked_backend, per_channel, saturate

__all__ = ["gaussian_blur", "gaussian_kernel"]

# where no sigma is given OpenCV takes these for small windows: rows of Pascal's triangle, but for the 7 and 9
SMALL = {1: (1.0,), 3: (0.25, 0.5, 0.25), 5: (0.0625, 0.25, 0.375, 0.25, 0.0625),
         7: (0.03125, 0.109375, 0.21875, 0.28125, 0.21875, 0.109375, 0.03125),
         9: tuple(k / 256 for k in (4, 13, 30, 51, 60, 51, 30, 13, 4))}  # fmt: skip


def gaussian_kernel(size: int, sigma: float = 0.0) -> NDArray[np.float64]:
    """Taps exp(-x²/2σ²) that sum to one (OpenCV: `getGaussianKernel`).

    Parameters
    ----------
    size : number of taps, odd
    sigma : pixels; 0 takes the one that suits the size, 0.3 ((size - 1)/2 - 1) + 0.8

    Returns
    -------
    (size,)
    """
    if size < 1 or size % 2 == 0:
        raise ShapeError(f"a Gaussian of {size} taps; expected an odd number, so that one lies on the pixel")
    if sigma <= 0 and size in SMALL:
        return np.array(SMALL[size])
    sigma = sigma if sigma > 0 else 0.15 * size + 0.35
    half = [exp(-0.125 / sigma**2 * x * x) for x in range(1 - size, 0, 2)]  # x/2 pixels from the middle
    scale = 1.0 / (2.0 * sum(half) + 1.0)
    return np.array([*(k * scale for k in half), scale, *(k * scale for k in half[::-1])])


def gaussian_blur(
    image: ArrayLike,
    sigma: float = 0.0,
    *,
    size: int = 0,
    border: Border = "reflect101",
    backend: Backend = "compiled",
) -> Image:
    """The image smoothed by a Gaussian (OpenCV: `GaussianBlur`).

    Bytes are smoothed in fixed point with taps in 1/256, as OpenCV's are, and equal to its answer bit for
    bit.

    Parameters
    ----------
    image : (h, w) or (h, w, channels)
    sigma : pixels; 0 takes the one that suits `size`
    size : number of taps, odd; 0 takes 3σ on either side for bytes, 4σ for others
    """
    pixels = as_image(image)
    if sigma < 0 or not np.isfinite(sigma) or (sigma == 0 and size == 0):
        raise DataError(f"gaussian_blur: sigma {sigma} and size {size}; expected one of them above zero")
    reach = 3 if pixels.dtype == np.uint8 else 4
    size = size or round(sigma * reach * 2 + 1) | 1
    taps = gaussian_kernel(size, sigma)
    if checked_backend(backend) == "opencv" and border != "wrap" and pixels.dtype != np.int32:
        import cv2

        done = cv2.GaussianBlur(pixels, (size, size), sigma, borderType=cv2_border(border))
        return np.asarray(done).reshape(pixels.shape)
    if pixels.dtype == np.uint8:
        return _bytes(pixels, fixed_point(taps).astype(np.uint16), border, backend)
    if pixels.dtype == np.uint16:  # integers below 2⁵³ are exact in float64
        wide = _separable(
            pixels.astype(np.float64), fixed_point(taps, 16).astype(np.float64), border, backend
        )
        return np.floor((wide + 2.0**31) / 2.0**32).astype(np.uint16)
    work = np.dtype(np.float64 if pixels.dtype in (np.float64, np.int32) else np.float32)
    return saturate(_separable(pixels.astype(work), taps.astype(work), border, backend), pixels.dtype)


def _separable(pixels: Image, along: Image, border: Border, backend: Backend) -> Image:
    """One row of taps along x, then the same along y, on floating-point pixels."""
    if backend == "numpy":
        first = correlate(pixels, along[None, :], border=border, backend="numpy")
        return correlate(first, along[:, None], border=border, backend="numpy")
    half = len(along) // 2

    def one(channel: Image) -> Image:
        from vision3d.kernels import image_separable

        out = np.empty_like(channel)
        padded = pad(channel, half, half, half, half, border)
        image_separable.separable(padded, along, along, out)
        return out

    return per_channel(pixels, one)


def fixed_point(taps: NDArray[np.float64], bits: int = 8) -> NDArray[np.int64]:
    """Taps in 1/2^bits that still sum to one: what one was rounded by, the next makes good."""
    half = len(taps) // 2
    out = np.zeros(len(taps), np.int64)
    left = 0.0
    for k in range(half):
        wanted = taps[k] * 2.0**bits + left
        out[k] = out[-1 - k] = round(wanted)
        left = wanted - round(wanted)
    out[half] = 2**bits - 2 * int(out[:half].sum())
    return out


def _bytes(pixels: Image, taps: NDArray[np.uint16], border: Border, backend: Backend) -> Image:
    half = len(taps) // 2

    def one(channel: Image) -> Image:
        padded = pad(channel, half, half, half, half, border)
        if backend == "numpy":
            h, w = channel.shape
            rows, total = np.zeros((len(padded), w), np.uint32), np.zeros((h, w), np.uint32)
            for i, tap in enumerate(taps.astype(np.uint32)):
                rows += tap * padded[:, i : i + w]
            for j, tap in enumerate(taps.astype(np.uint32)):
                total += tap * rows[j : j + h]
            rounded: Image = ((total + (1 << 15)) >> 16).astype(np.uint8)
            return rounded
        from vision3d.kernels import image_separable

        out = np.empty(channel.shape, np.uint8)
        image_separable.separable_fixed(padded, taps, taps, out)
        return out

    return per_channel(pixels, one)
