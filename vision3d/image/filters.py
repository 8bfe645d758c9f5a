"""Convolution: every output pixel is a weighted sum of its neighbours.

>>> import numpy as np
>>> from vision3d.image import convolve
>>> step = np.array([[0, 0, 10, 10]], dtype=np.uint8)
>>> convolve(step, [[1, 0, -1]], dtype=np.int16)
array([[ 0, 10, 10,  0]], dtype=int16)

Taps that are whole numbers are summed exactly on images of integers: bytes come out equal to OpenCV's
`filter2D` bit for bit.  Fractions are summed in the order of the taps, in float32, or in float64 where image
or result are of float64 or int32; OpenCV fuses products and sums where the processor can, so that a half may
be rounded otherwise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from sequential.errors import DataError, NotFiniteError, ShapeError
from vision3d.image.borders import Border, cv2_border, pad
from vision3d.image.pixels import Backend, Image, as_image, checked_backend, per_channel, saturate

__all__ = ["box_blur", "box_sums", "convolve", "correlate"]

OPENCV_DEPTHS = {"uint8": "uint8 int16 float32", "uint16": "uint16 float32", "int16": "int16 float32",
                 "float32": "float32", "float64": "float64", "int32": ""}  # fmt: skip


def correlate(
    image: ArrayLike,
    taps: ArrayLike,
    *,
    dtype: DTypeLike | None = None,
    border: Border = "reflect101",
    value: float = 0,
    anchor: tuple[int, int] | None = None,
    backend: Backend = "compiled",
) -> Image:
    """Weighted sums with the window laid on as it is written (OpenCV: `filter2D`).

    Parameters
    ----------
    image : (h, w) or (h, w, channels)
    taps : (rows, columns) weights
    dtype : of the result, saturated; the image's own unless given (take a signed one for differences)
    border, value : what lies beyond the edge, and the value of "constant"
    anchor : (row, column) of the tap that lies on the pixel; the middle unless given
    backend : "compiled", "numpy" or "opencv"

    Raises
    ------
    ShapeError
        where image or taps have another shape, or the anchor lies outside of the taps.
    """
    pixels, weights = as_image(image), _weights(taps)
    (rows, columns), (row, column) = weights.shape, anchor or (weights.shape[0] // 2, weights.shape[1] // 2)
    if not (0 <= row < rows and 0 <= column < columns):
        raise ShapeError(f"anchor ({row}, {column}) lies outside of taps of shape {weights.shape}")
    kind = np.dtype(pixels.dtype if dtype is None else dtype)
    around = (row, rows - 1 - row, column, columns - 1 - column)
    if checked_backend(backend) == "opencv":
        return _opencv(pixels, weights, kind, around, border, value)
    work = arithmetic(pixels.dtype, weights, kind)

    def one(channel: Image) -> Image:
        padded = pad(channel, *around, border, value)
        sums = (_numpy if backend == "numpy" else _compiled)(padded, weights.astype(work), channel.shape)
        return saturate(sums, kind)

    return per_channel(pixels, one)


def convolve(
    image: ArrayLike,
    taps: ArrayLike,
    *,
    dtype: DTypeLike | None = None,
    border: Border = "reflect101",
    value: float = 0,
    backend: Backend = "compiled",
) -> Image:
    """Weighted sums with the window turned by half a turn: (f * g)(x) = Σ g(i) f(x - i).

    For symmetric taps this is `correlate`; for a derivative it changes the sign.  Arguments are the same.
    """
    weights = _weights(taps)
    rows, columns = weights.shape
    middle = (rows - 1 - rows // 2, columns - 1 - columns // 2)
    return correlate(
        image, weights[::-1, ::-1], dtype=dtype, border=border, value=value, anchor=middle, backend=backend
    )


def box_sums(
    image: ArrayLike, size: int, *, border: Border = "reflect101", backend: Backend = "compiled"
) -> Image:
    """The sum over the size by size window around every pixel: int32 for uint8, float64 for others.

    The cost does not grow with the window: running sums compiled, an integral image in NumPy.
    """
    pixels = as_image(image)
    if pixels.dtype not in (np.uint8, np.float32, np.float64):
        pixels = pixels.astype(np.float64)
    before = size // 2
    if size < 1:
        raise ShapeError(f"a window of {size} pixels; expected 1 or more")
    kind = np.dtype(np.int32 if pixels.dtype == np.uint8 else np.float64)
    if size * size * 255 >= 2**31:
        raise ShapeError(f"a window of {size} pixels is too large; expected fewer than 2900")

    def one(channel: Image) -> Image:
        if checked_backend(backend) == "opencv" and border != "wrap":
            import cv2

            depth = cv2.CV_32S if kind == np.int32 else cv2.CV_64F
            done: Image = cv2.boxFilter(
                channel, depth, (size, size), normalize=False, borderType=cv2_border(border)
            )
            return done
        padded = pad(channel, before, size - 1 - before, before, size - 1 - before, border)
        if backend == "numpy":
            integral = np.zeros((padded.shape[0] + 1, padded.shape[1] + 1), kind)
            integral[1:, 1:] = padded.cumsum(axis=0, dtype=kind).cumsum(axis=1, dtype=kind)
            top, bottom = integral[:-size], integral[size:]
            return bottom[:, size:] - bottom[:, :-size] - top[:, size:] + top[:, :-size]
        from vision3d.kernels import image_boxes

        sums = np.empty(channel.shape, kind)
        image_boxes.box_sums(padded, size, sums)
        return sums

    return per_channel(pixels, one)


def box_blur(
    image: ArrayLike, size: int, *, border: Border = "reflect101", backend: Backend = "compiled"
) -> Image:
    """The mean over the size by size window around every pixel, of the image's type."""
    pixels = as_image(image)
    sums = box_sums(pixels, size, border=border, backend=backend)
    if pixels.dtype != np.uint8 or pixels.ndim != 2 or backend == "numpy":
        return saturate(sums * (1.0 / size**2), pixels.dtype)
    from vision3d.kernels import image_boxes

    mean = np.empty(pixels.shape, np.uint8)
    image_boxes.means(sums, 1.0 / size**2, mean)
    return mean


def arithmetic(pixels: np.dtype, weights: NDArray[np.generic], result: np.dtype) -> np.dtype:
    """The type that sums are taken in."""
    if pixels.kind in "ui" and np.array_equal(weights, np.rint(weights)):
        most = float(np.abs(weights).sum()) * 255
        if pixels == np.uint8 and most < 2**31:
            return np.dtype(np.int16 if most < 2**15 else np.int32)
        return np.dtype(np.float64)  # exact too, below 2⁵³
    wide = np.dtype(np.float64) in (pixels, result) or pixels == np.int32
    return np.dtype(np.float64 if wide else np.float32)


def _weights(taps: ArrayLike) -> NDArray[np.float64]:
    weights = np.asarray(taps, dtype=np.float64)
    if weights.ndim != 2 or weights.size == 0:
        raise ShapeError(
            f"taps have shape {weights.shape}; expected (rows, columns): for a row of them write [[1, 2, 1]]"
        )
    if not np.isfinite(weights).all():
        raise NotFiniteError("taps hold NaN or infinity, which would spread over the image")
    return weights


def _numpy(padded: Image, weights: NDArray[np.generic], shape: tuple[int, ...]) -> Image:
    """One shifted copy of the image for every tap, weighted and added: the definition."""
    h, w = shape
    total = np.zeros(shape, weights.dtype)
    for (j, i), weight in np.ndenumerate(weights):
        if weight:
            total += weight * padded[j : j + h, i : i + w].astype(weights.dtype, copy=False)
    return total


def _compiled(padded: Image, weights: NDArray[np.generic], shape: tuple[int, ...]) -> Image:
    from vision3d.kernels import image_filters

    if weights.dtype.kind == "f":
        padded = padded.astype(weights.dtype, copy=False)
    out = np.empty(shape, weights.dtype)
    image_filters.correlate(padded, np.ascontiguousarray(weights), out)
    return out


def _opencv(
    pixels: Image,
    weights: NDArray[np.float64],
    kind: np.dtype,
    around: tuple[int, int, int, int],
    border: Border,
    value: float,
) -> Image:
    """OpenCV's filter, which has neither a torus nor a constant other than zero: there we pad."""
    import cv2

    if kind.name not in OPENCV_DEPTHS[pixels.dtype.name].split():
        pixels = pixels.astype(np.float64)
    h, w = pixels.shape[:2]
    padded = border == "wrap" or (border == "constant" and value != 0)
    source = pad(pixels, *around, border, value) if padded else pixels
    done = cv2.filter2D(
        source, _depth(kind.name if pixels.dtype != np.float64 else "float64"), weights, anchor=(around[2],
        around[0]), borderType=cv2.BORDER_CONSTANT if padded else cv2_border(border),
    )  # fmt: skip
    if padded:
        done = done[around[0] : around[0] + h, around[2] : around[2] + w]
    return saturate(done.reshape(pixels.shape), kind)


def _depth(name: str) -> int:
    import cv2

    known = {"uint8": cv2.CV_8U, "uint16": cv2.CV_16U, "int16": cv2.CV_16S, "float32": cv2.CV_32F}
    if name not in (*known, "float64"):
        raise DataError(f"OpenCV has no images of {name}")
    return known.get(name, cv2.CV_64F)
