"""Levels of grey: histogram, equalisation, and thresholds that are given, found (Otsu) or local.

>>> import numpy as np
>>> from vision3d.image import otsu, threshold
>>> image = np.array([[10, 12, 11, 200, 205, 201]], dtype=np.uint8)
>>> otsu(image)
12
>>> threshold(image, otsu(image))
array([[  0,   0,   0, 255, 255, 255]], dtype=uint8)
"""

from __future__ import annotations

from math import ceil, floor
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from vision3d.image.filters import box_blur
from vision3d.image.pixels import Backend, Image, as_bytes, as_image, checked_backend, saturate
from vision3d.image.smoothing import gaussian_blur

__all__ = ["adaptive_threshold", "equalise", "histogram", "otsu", "threshold"]

Rule: TypeAlias = Literal["binary", "binary_inv", "truncate", "to_zero", "to_zero_inv"]


def histogram(image: ArrayLike, *, backend: Backend = "compiled") -> NDArray[np.int64]:
    """(256,) counts of the levels of a grey image of bytes."""
    pixels = as_bytes(image)
    if checked_backend(backend) == "opencv":
        from vision3d.cv import calc_hist

        return np.rint(calc_hist(pixels)).astype(np.int64)
    if backend == "numpy":
        return np.bincount(pixels.ravel(), minlength=256).astype(np.int64)
    from vision3d.kernels import image_levels

    counts = np.zeros(256, np.int64)
    image_levels.histogram(pixels, counts)
    return counts


def equalise(image: ArrayLike, *, backend: Backend = "compiled") -> NDArray[np.uint8]:
    """The image with its levels spread so that each is about as frequent (OpenCV: `equalizeHist`).

    A level becomes 255 times the share of pixels at or below it, the darkest one present counting as zero.
    """
    pixels = as_bytes(image)
    if checked_backend(backend) == "opencv":
        import cv2

        return np.asarray(cv2.equalizeHist(pixels), np.uint8)
    counts = histogram(pixels, backend=backend)
    darkest = int(np.flatnonzero(counts)[0])
    rest = pixels.size - int(counts[darkest])
    if rest == 0:
        return pixels.copy()  # one level only: there is nothing to spread
    below = counts.cumsum() - counts[: darkest + 1].sum()
    table = saturate(below.astype(np.float32) * (np.float32(255.0) / np.float32(rest)), np.uint8)
    table[: darkest + 1] = 0
    equalised: NDArray[np.uint8]
    if backend == "numpy":
        equalised = table[pixels]
        return equalised
    from vision3d.kernels import image_levels

    equalised = np.empty(pixels.shape, np.uint8)
    image_levels.look_up(pixels, table, equalised)
    return equalised


def otsu(image: ArrayLike, *, backend: Backend = "compiled") -> int:
    """The level that parts an image best in two (Otsu 1979): pixels above it are one class.

    Among all levels t the one whose classes "at most t" and "above t" have means the farthest apart, in the
    sense of the greatest variance between classes, q₁ q₂ (μ₁ - μ₂)².  It is the first of several that are as
    good.
    """
    pixels = as_bytes(image)
    if checked_backend(backend) == "opencv":
        import cv2

        return int(cv2.threshold(pixels, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[0])
    return _otsu_level(histogram(pixels, backend=backend))


def _otsu_level(counts: NDArray[np.int64]) -> int:
    """Otsu's own recursion for class shares and means, one level after the other."""
    total = int(counts.sum())
    scale = 1.0 / total
    mean = float(np.arange(256) @ counts) * scale
    best, found = 0.0, 0
    q1 = mu1 = 0.0
    tiny = float(np.finfo(np.float32).eps)  # a class of fewer pixels has no mean to speak of
    for level, count in enumerate(counts.tolist()):
        p = count * scale
        mu1 *= q1
        q1 += p
        q2 = 1.0 - q1
        if min(q1, q2) < tiny or max(q1, q2) > 1.0 - tiny:
            continue
        mu1 = (mu1 + level * p) / q1
        mu2 = (mean - q1 * mu1) / q2
        between = q1 * q2 * (mu1 - mu2) * (mu1 - mu2)
        if between > best:
            best, found = between, level
    return found


def threshold(
    image: ArrayLike, level: float | Literal["otsu"], *, rule: Rule = "binary", high: float = 255
) -> Image:
    """What is brighter than a level, and what is not (OpenCV: `threshold`).

    Parameters
    ----------
    image : (h, w) or (h, w, channels)
    level : pixels strictly above it are bright; "otsu" finds it in a grey image of bytes
    rule : "binary" gives `high` where bright and 0 elsewhere, "binary_inv" the contrary; "truncate" cuts
        at the level, "to_zero" keeps what is bright, "to_zero_inv" what is not
    """
    pixels = as_image(image)
    if rule not in get_args(Rule):
        raise DataError(f"no rule {rule!r} of thresholds; known are {', '.join(get_args(Rule))}")
    cut = float(otsu(pixels)) if level == "otsu" else float(level)
    if pixels.dtype.kind != "f":
        cut = floor(cut)
    bright: NDArray[np.bool_] = pixels > cut
    value, zero = saturate(np.array([float(high), 0.0]), pixels.dtype)
    parted: Image
    match rule:
        case "binary":
            parted = np.where(bright, value, zero)
        case "binary_inv":
            parted = np.where(bright, zero, value)
        case "truncate":
            parted = np.where(bright, saturate(np.array(cut), pixels.dtype), pixels)
        case "to_zero":
            parted = np.where(bright, pixels, zero)
        case _:
            parted = np.where(bright, zero, pixels)
    return parted


def adaptive_threshold(
    image: ArrayLike,
    size: int,
    offset: float = 0.0,
    *,
    weights: Literal["mean", "gaussian"] = "mean",
    inverted: bool = False,
    high: int = 255,
    backend: Backend = "compiled",
) -> NDArray[np.uint8]:
    """Bright is what exceeds the mean around it less an offset (OpenCV: `adaptiveThreshold`).

    Light that changes slowly over the image moves the mean with it, where one level for all would fail.

    Parameters
    ----------
    image : (h, w) uint8
    size : of the window, odd, and larger than what is looked for is wide
    offset : levels below the mean that still count as bright; a few, so that noise on a plain ground does not
    weights : of the mean: all equal, or Gaussian with the sigma that suits the size
    inverted : give `high` where the image is dark: a black line, ink

    Returns
    -------
    (h, w) uint8, 0 or `high`
    """
    pixels = as_bytes(image)
    if size < 3 or size % 2 == 0:
        raise ShapeError(f"adaptive_threshold: a window of {size} pixels; expected an odd number above 1")
    if weights not in ("mean", "gaussian"):
        raise DataError(f"adaptive_threshold: no weights {weights!r}; known are mean and gaussian")
    if checked_backend(backend) == "opencv":
        import cv2

        kind = cv2.ADAPTIVE_THRESH_MEAN_C if weights == "mean" else cv2.ADAPTIVE_THRESH_GAUSSIAN_C
        way = cv2.THRESH_BINARY_INV if inverted else cv2.THRESH_BINARY
        return np.asarray(cv2.adaptiveThreshold(pixels, high, kind, way, size, offset), np.uint8)
    if weights == "mean":
        mean = box_blur(pixels, size, border="replicate", backend=backend)
    else:
        wide = pixels.astype(np.float32)
        mean = saturate(gaussian_blur(wide, size=size, border="replicate", backend=backend), np.uint8)
    below = floor(offset) if inverted else ceil(offset)
    above, otherwise = (0, high) if inverted else (high, 0)
    if backend == "numpy":
        difference = pixels.astype(np.int16) - mean.astype(np.int16)
        return np.where(difference > -below, above, otherwise).astype(np.uint8)
    from vision3d.kernels import image_levels

    out = np.empty(pixels.shape, np.uint8)
    image_levels.adaptive(pixels, mean, -below, above, otherwise, out)
    return out
