"""How sure a disparity is: least squares on the levels of a window, and what windows cannot know."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["settled"]

Map = NDArray[np.float32]
HALF, ROUNDS = 3, 5
SAME_PX, PRIOR_PX = 1.0, 0.5
FLOOR_PX = 0.05  # sampling of the levels, and a surface that is not flat within a window


def settled(a: Any, b: Any, disparity: Map, valid: Any, *, refine: bool) -> tuple[Map, Map]:
    """Disparity between pixels, and its standard deviation (h, w), px.

    The grey levels of a 7 by 7 window of the right picture are brought onto the left one's (Lucas and
    Kanade 1981); the curvature of that fit against its residuals gives the variance.  Pixels that were filled
    in have the spread of their surroundings instead.
    """
    import cv2

    from vision3d.kernels.stereo_refinement import refine_disparity

    soft = [
        np.ascontiguousarray(cv2.GaussianBlur(one.mean(axis=2, dtype=np.float32), (0, 0), 0.5))
        for one in (a, b)
    ]
    slope = np.ascontiguousarray(np.gradient(soft[1], axis=1), dtype=np.float32)
    shifted, variance = np.empty_like(disparity), np.empty_like(disparity)
    refine_disparity(
        *soft,
        slope,
        disparity,
        np.ascontiguousarray(valid),
        HALF,
        ROUNDS,
        SAME_PX,
        PRIOR_PX,
        shifted,
        variance,
    )
    known = np.isfinite(variance)
    std = np.sqrt(np.where(known, variance, PRIOR_PX**2) + FLOOR_PX**2)
    around = _scatter(disparity)
    std = np.where(valid, std, np.maximum(2.0, around)).astype(np.float32)
    return (np.where(valid, shifted, disparity) if refine else disparity), std


def _scatter(disparity: Map) -> Map:
    """Range of the disparity in a window of 31 pixels, px."""
    import cv2

    kernel = np.ones((31, 31), np.uint8)
    bare = np.nan_to_num(disparity)
    return np.asarray(cv2.dilate(bare, kernel) - cv2.erode(bare, kernel), dtype=np.float32)
