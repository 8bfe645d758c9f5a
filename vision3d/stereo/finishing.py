"""From a matcher's answer to a map: checked, filled, smoothed along edges, settled between pixels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vision3d.stereo.disparity import Disparity

if TYPE_CHECKING:
    from vision3d.stereo.disparity import StereoSettings
    from vision3d.stereo.semi_global import RawDisparity

__all__ = ["finished"]

LEAST_CONFIDENCE = 0.005  # below it every disparity costs the same
FLAT_HALF, FLAT_LEVELS = 7, 0.5  # a window whose levels vary by less has nothing to match
HALF_MEDIAN, MEDIAN_LEVELS = 5, 10.0  # of the weighted median, px, and grey levels a channel


def finished(a: Any, b: Any, raw: RawDisparity, range_px: tuple[int, int], how: StereoSettings) -> Disparity:
    """Check left against right, drop speckles, fill, take medians, refine and say how sure each pixel is."""
    import cv2

    from vision3d.stereo.filling import fill_rows, weighted_medians
    from vision3d.stereo.left_right import agree, hidden, without_speckles
    from vision3d.stereo.precision import settled

    valid = np.isfinite(raw.left) & ~(raw.confidence < LEAST_CONFIDENCE) & ~_flat(a)
    occluded = np.zeros_like(valid)
    if raw.right is not None:
        valid &= agree(raw.left, raw.right, how.left_right_px)
    valid = without_speckles(raw.left, valid, how.speckle_px)
    if raw.right is not None:
        occluded = hidden(raw.left, raw.right, valid)
    if not valid.any():
        return _nothing(raw, range_px, how)
    full = fill_rows(raw.left, valid)
    full = weighted_medians(full, ~valid, a, HALF_MEDIAN, MEDIAN_LEVELS)
    full = np.asarray(cv2.medianBlur(full, 5), dtype=np.float32)
    full, std = settled(a, b, full, valid, refine=how.refine)
    if not how.fill:
        full = np.where(valid, full, np.float32(np.nan))
        std = np.where(valid, std, np.float32(np.nan))
    return Disparity(full, std, valid, occluded, raw.confidence, range_px, how.matcher)


def _flat(a: Any) -> Any:
    """Where a window has no texture at all, not even noise: black, saturated or painted."""
    import cv2

    grey, size = a.mean(axis=2, dtype=np.float64), (2 * FLAT_HALF + 1, 2 * FLAT_HALF + 1)
    mean = cv2.blur(grey, size)
    return cv2.blur(grey**2, size) - mean**2 < FLAT_LEVELS**2


def _nothing(raw: RawDisparity, range_px: tuple[int, int], how: StereoSettings) -> Disparity:
    """No pixel was matched."""
    shape = raw.left.shape
    empty = np.full(shape, np.nan, np.float32)
    none = np.zeros(shape, np.bool_)
    return Disparity(empty, empty.copy(), none, none.copy(), raw.confidence, range_px, how.matcher)
