"""How sure a disparity is: least squares on the levels of a window, and what windows cannot know."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["settled"]

Map = NDArray[np.float32]
HALF, ROUNDS, PASSES = 3, 5, 2
SAME_PX, PRIOR_PX = 1.0, 0.5
NEIGHBOURS = 1.15  # errors of neighbouring levels go together: σ of rendered pairs is larger by so much
LEAST_FLOOR_PX, UNKNOWN_FLOOR_PX = 0.02, 0.1
# a window that is larger than that of the match shows by how much matches of one surface really differ
FACET_HALF, FACET_STRIDE, FACET_SHARE, FACETS = 8, 3, 0.8, 100


def settled(a: Any, b: Any, disparity: Map, valid: Any, *, refine: bool) -> tuple[Map, Map]:
    """Disparity between pixels, and its standard deviation (h, w), px.

    The grey levels of a 7 by 7 window of the right picture are brought onto the left one's, on the plane
    through the disparities of the window (Lucas and Kanade 1981); the curvature of that fit against its
    residuals gives the variance.  What it leaves out (lenses, rows, surfaces that are not flat) is measured
    on the pair: by how much more than that matches scatter about planes through larger windows.  Pixels that
    were filled in have the spread of their surroundings instead.
    """
    import cv2

    from vision3d.kernels.stereo_refinement import refine_disparity

    grey = [np.ascontiguousarray(one.mean(axis=2, dtype=np.float32)) for one in (a, b)]
    slope = np.ascontiguousarray(np.gradient(grey[0], axis=1), dtype=np.float32)
    known = np.ascontiguousarray(valid)
    shifted, variance = np.empty_like(disparity), np.empty_like(disparity)
    start = disparity
    for k in range(PASSES):
        if k > 0:
            start = np.asarray(cv2.medianBlur(np.where(valid, shifted, disparity), 3), dtype=np.float32)
        refine_disparity(*grey, slope, start, known, HALF, ROUNDS, SAME_PX, PRIOR_PX, shifted, variance)
    matched = np.where(valid, shifted if refine else disparity, disparity)
    own = NEIGHBOURS * np.sqrt(np.where(np.isfinite(variance), variance, PRIOR_PX**2))
    std = np.hypot(own, _floor(matched, own, known))
    return matched, np.where(valid, std, np.maximum(2.0, _scatter(disparity))).astype(np.float32)


def _floor(disparity: Map, own: Any, valid: Any) -> float:
    """Standard deviation, px, that matches have beside their own: from their scatter about local planes."""
    from vision3d.kernels.stereo_refinement import facet_residuals

    residual = np.empty_like(disparity)
    facet_residuals(disparity, valid, FACET_STRIDE, FACET_HALF, SAME_PX, FACET_SHARE, residual)
    seen = np.isfinite(residual)
    if seen.sum() < FACETS:
        return UNKNOWN_FLOOR_PX
    scatter = float(np.median(np.abs(residual[seen]))) / 0.6745
    return float(np.sqrt(max(scatter**2 - float(np.median(own[seen])) ** 2, LEAST_FLOOR_PX**2)))


def _scatter(disparity: Map) -> Map:
    """Range of the disparity in a window of 31 pixels, px."""
    import cv2

    kernel = np.ones((31, 31), np.uint8)
    bare = np.nan_to_num(disparity)
    return np.asarray(cv2.dilate(bare, kernel) - cv2.erode(bare, kernel), dtype=np.float32)
