"""Corners of one size, FAST's or Harris', described by ORB's bits or by a patch of grey levels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision3d.features.detection import none_of
from vision3d.features.features import Array, Features
from vision3d.features.subpixel import CORNER_SIGMA_PX, settle_corners

__all__ = ["described"]

PATCH_PX = 31
SIDE = 8  # of a patch descriptor, samples
FAST_THRESHOLD = 10


def described(image: NDArray[np.uint8], mask: NDArray[np.uint8] | None, kind: str, count: int) -> Features:
    """The strongest corners, with descriptors."""
    patch = kind.endswith("-patch")
    width, dtype = (SIDE * SIDE, np.float32) if patch else (32, np.uint8)
    if min(image.shape) <= PATCH_PX:
        return none_of(kind, width, dtype)
    pixels, response = (_fast if kind.startswith("fast") else _harris)(image, mask)
    inside = ((pixels >= PATCH_PX) & (pixels < np.array(image.shape[::-1]) - PATCH_PX)).all(axis=1)
    order = np.argsort(-response[inside], kind="stable")[:count]
    pixels, response = pixels[inside][order], response[inside][order]
    if not len(pixels):
        return none_of(kind, width, dtype)
    angle = orientations(image, pixels)
    own = _patches(image, pixels, angle) if patch else _bits(image, pixels, angle)
    one = np.ones(len(pixels))
    fine = settle_corners(image, pixels, one, climb=int(kind.startswith("fast")))
    return Features(fine, own, PATCH_PX * one, angle, response, CORNER_SIGMA_PX * one, kind)


def _fast(image: NDArray[np.uint8], mask: NDArray[np.uint8] | None) -> tuple[Array, Array]:
    import cv2

    keypoints = cv2.FastFeatureDetector.create(FAST_THRESHOLD).detect(image, mask)
    rows = np.array([(*k.pt, k.response) for k in keypoints], dtype=np.float64).reshape(-1, 3)
    return rows[:, :2], rows[:, 2]


def _harris(image: NDArray[np.uint8], mask: NDArray[np.uint8] | None) -> tuple[Array, Array]:
    from vision3d.image.corners import corners, harris

    pixels = corners(image, quality=1e-4, min_distance_px=5.0, mask=mask)
    scores = harris(image, 3)
    x, y = pixels.astype(np.int64).T
    return pixels, scores[y, x].astype(np.float64)


def orientations(image: NDArray[np.uint8], pixels: Array) -> Array:
    """Angle (N,) from each pixel to the centre of brightness of the disc about it (Rosin, 1999)."""
    import cv2

    radius = PATCH_PX // 2
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    disc = x * x + y * y <= radius * radius
    column, row = np.rint(pixels).astype(np.int64).T
    moments = [
        cv2.filter2D(image, cv2.CV_32F, (axis * disc).astype(np.float32))[row, column] for axis in (x, y)
    ]
    return np.asarray(np.arctan2(moments[1], moments[0]), dtype=np.float64)


def _bits(image: NDArray[np.uint8], pixels: Array, angle: Array) -> NDArray[np.uint8]:
    import cv2

    keypoints = [
        cv2.KeyPoint(float(x), float(y), float(PATCH_PX), float(a))
        for (x, y), a in zip(pixels, np.degrees(angle) % 360.0, strict=True)
    ]
    return np.asarray(cv2.ORB.create().compute(image, keypoints)[1], dtype=np.uint8)


def _patches(image: NDArray[np.uint8], pixels: Array, angle: Array) -> NDArray[np.float32]:
    """(N, 64) grey levels about each corner, turned, with mean 0 and length 1."""
    import cv2

    step = 3.0
    blurred = cv2.GaussianBlur(image, (0, 0), 0.5 * step).astype(np.float32)
    along = step * (np.arange(SIDE) - 0.5 * (SIDE - 1))
    u, v = (grid.ravel() for grid in np.meshgrid(along, along))
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x = (pixels[:, :1] + c * u - s * v).astype(np.float32)
    y = (pixels[:, 1:] + s * u + c * v).astype(np.float32)
    values = [
        cv2.remap(blurred, x[i : i + 8192], y[i : i + 8192], cv2.INTER_LINEAR) for i in range(0, len(x), 8192)
    ]
    rows = np.concatenate(values).astype(np.float64)
    rows -= rows.mean(axis=1, keepdims=True)
    return np.asarray(rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-6), np.float32)
