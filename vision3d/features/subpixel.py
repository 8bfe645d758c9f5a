"""Corners to fractions of a pixel: the peak of Harris' score about them, at their own scale."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision3d.features.features import Array

__all__ = ["CORNER_SIGMA_PX", "settle_corners"]

CORNER_SIGMA_PX = 0.35  # of a settled corner, px of its level
BLOCK = 3  # side of the window of the score, px of the corner's level


def settle_corners(image: NDArray[np.uint8], pixels: Array, scale: Array, *, climb: int = 1) -> Array:
    """Move corners to the nearest peak of the score, which a parabola places between pixels.

    Parameters
    ----------
    image : (h, w)
    pixels : (N, 2) px
    scale : (N,) how many pixels of the image one of the corner's level is
    climb : pixels of its level that a corner may be from the peak; 0 where it is the peak already

    Returns
    -------
    Array
        (N, 2) px; as given where there is no such peak.
    """
    out = np.array(pixels, dtype=np.float64)
    for step in np.unique(scale):
        rows = np.flatnonzero(scale == step)
        out[rows] = _of_level(image, out[rows], float(step), climb)
    return out


def _of_level(image: NDArray[np.uint8], pixels: Array, step: float, climb: int) -> Array:
    import cv2

    from vision3d.image.corners import harris

    height, width = image.shape
    if step != 1.0:
        size = (max(1, round(width / step)), max(1, round(height / step)))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
    zoom = np.array([width / image.shape[1], height / image.shape[0]])
    # corners of images coincide, and the first pixel's centre is half a pixel from its corner
    place = (pixels + 0.5) / zoom - 0.5
    scores = harris(cv2.GaussianBlur(image, (0, 0), 0.8), BLOCK).astype(np.float64)
    peak, good = _climb(scores, np.rint(place).astype(np.int64), climb)
    fine = peak + _parabola(scores, peak, good)
    good &= (np.abs(fine - place) <= climb + 1).all(axis=1)
    return np.where(good[:, None], (fine + 0.5) * zoom - 0.5, pixels)


def _climb(
    scores: Array, start: NDArray[np.int64], steps: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """The highest of the nine pixels about each, again and again; whether that came to rest inside."""
    most = np.array(scores.shape[::-1]) - 2
    at = np.clip(start, 1, np.maximum(most, 1))
    if (most < 1).any():
        return at, np.zeros(len(at), np.bool_)
    y, x = (grid.ravel() for grid in np.mgrid[-1:2, -1:2])
    best = np.full(len(at), 4)
    for _ in range(steps + 1):
        best = np.argmax(scores[at[:, 1:] + y, at[:, :1] + x], axis=1)
        at = np.clip(at + np.column_stack([x[best], y[best]]), 1, most)
    return at, best == 4


def _parabola(scores: Array, peak: NDArray[np.int64], good: NDArray[np.bool_]) -> Array:
    """Offset (N, 2) from each pixel to the top of the quadratic through its neighbours; 0 where none is."""
    offset = np.zeros(peak.shape)
    if not good.any():
        return offset
    x, y = peak.T
    gx = 0.5 * (scores[y, x + 1] - scores[y, x - 1])
    gy = 0.5 * (scores[y + 1, x] - scores[y - 1, x])
    xx = scores[y, x + 1] - 2.0 * scores[y, x] + scores[y, x - 1]
    yy = scores[y + 1, x] - 2.0 * scores[y, x] + scores[y - 1, x]
    xy = 0.25 * (scores[y + 1, x + 1] - scores[y + 1, x - 1] - scores[y - 1, x + 1] + scores[y - 1, x - 1])
    det = xx * yy - xy * xy
    with np.errstate(divide="ignore", invalid="ignore"):
        dx, dy = (xy * gy - yy * gx) / det, (xy * gx - xx * gy) / det
    near = good & (det > 0.0) & (np.abs(dx) <= 1.0) & (np.abs(dy) <= 1.0)
    offset[near] = np.column_stack([dx, dy])[near]
    return offset
