"""Matches seen from the left held against those seen from the right."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["agree", "hidden", "without_speckles"]

Mask = NDArray[np.bool_]


def agree(left: Any, right: Any, tolerance_px: float) -> Mask:
    """Where a left pixel's match, looked up in the right picture's disparity, leads back to it."""
    there, inside = _looked_up(left, right)
    with np.errstate(invalid="ignore"):
        return np.asarray(inside & (np.abs(there - left) <= tolerance_px))


def hidden(left: Any, right: Any, valid: Any) -> Mask:
    """Where a pixel that is not valid looks at something nearer in the right picture, or out of it."""
    there, inside = _looked_up(left, right)
    with np.errstate(invalid="ignore"):
        return np.asarray(~np.asarray(valid) & (~inside | (there > left + 1.0)))


def without_speckles(disparity: Any, valid: Any, least: int, step_px: float = 1.0) -> Mask:
    """`valid` without patches of fewer than `least` pixels of one surface."""
    import cv2

    if least <= 1:
        return np.asarray(valid).copy()
    none = np.int16(-32768)
    # sixteenths of a pixel where they fit in 16 bits
    fine = 16 if np.nanmax(np.abs(disparity), initial=0.0) < 2000 else 4
    with np.errstate(invalid="ignore"):
        fixed = np.where(valid, np.round(np.nan_to_num(disparity) * fine), none).astype(np.int16)
    cv2.filterSpeckles(fixed, float(none), least, step_px * fine)
    return np.asarray(fixed != none)


def _looked_up(left: Any, right: Any) -> tuple[Any, Mask]:
    """The right picture's disparity at each left pixel's match, and whether that is in the picture."""
    width = left.shape[1]
    known = np.isfinite(left)
    at = np.arange(width) - np.round(np.where(known, left, 0.0)).astype(np.int64)
    inside = known & (at >= 0) & (at < width)
    return np.take_along_axis(right, np.clip(at, 0, width - 1), axis=1), inside
