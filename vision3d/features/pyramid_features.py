"""Features of every scale: SIFT and ORB, by OpenCV, with positions and standard deviations of our own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision3d.features.detection import none_of
from vision3d.features.features import Features
from vision3d.features.subpixel import CORNER_SIGMA_PX, settle_corners

__all__ = ["ORB_PATCH_PX", "orb", "sift"]

ORB_PATCH_PX, ORB_STEP, ORB_LEVELS = 31, 1.2, 8
SIFT_SIGMA_PX, SIFT_SIGMA_SHARE = 0.12, 0.018  # at size 0, and what each pixel of size adds
SMALLEST_PX = 16  # side of an image below which there is no pyramid


def sift(image: NDArray[np.uint8], mask: NDArray[np.uint8] | None) -> Features:
    """Every SIFT feature, with RootSIFT descriptors."""
    if min(image.shape) < SMALLEST_PX:
        return none_of("sift", 128, np.float32)
    import cv2

    # without the precise doubling every position is off by a quarter of a pixel of its octave
    detector = cv2.SIFT.create(nfeatures=0, contrastThreshold=0.02, enable_precise_upscale=True)
    keypoints, described = detector.detectAndCompute(image, mask)
    if not keypoints:
        return none_of("sift", 128, np.float32)
    root = np.sqrt(described / np.maximum(described.sum(axis=1, keepdims=True), 1e-9))
    return _features(keypoints, root.astype(np.float32), "sift")


def orb(image: NDArray[np.uint8], mask: NDArray[np.uint8] | None, count: int) -> Features:
    """The strongest ORB features of every level."""
    if min(image.shape) < 2 * ORB_PATCH_PX:
        return none_of("orb", 32, np.uint8)
    import cv2

    detector = cv2.ORB.create(nfeatures=count, scaleFactor=ORB_STEP, nlevels=ORB_LEVELS, fastThreshold=10)
    keypoints, described = detector.detectAndCompute(image, mask)
    if not keypoints:
        return none_of("orb", 32, np.uint8)
    found = _features(keypoints, described, "orb")
    step = np.round(found.size_px / ORB_PATCH_PX, 4)
    # levels are shrunk corner on corner, and their pixels counted from centres
    pixels = settle_corners(image, found.pixels + 0.5 * (step[:, None] - 1.0), step)
    return replace(found, pixels=pixels, sigma_px=CORNER_SIGMA_PX * step)


def _features(keypoints: Any, described: NDArray[Any], kind: str) -> Features:
    rows = np.array([(*k.pt, k.size, k.angle, k.response) for k in keypoints], dtype=np.float64)
    size = rows[:, 2]
    sigma = np.hypot(SIFT_SIGMA_PX, SIFT_SIGMA_SHARE * size)
    return Features(rows[:, :2], described, size, np.radians(rows[:, 3]), rows[:, 4], sigma, kind)
