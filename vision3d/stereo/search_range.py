"""The range of disparities worth searching, from a small copy of the pair."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from vision3d.stereo.disparity import StereoSettings

__all__ = ["search_range"]

SMALL_WIDTH = 240  # px of the small copy
BEHIND, AHEAD = 0.10, 0.45  # of the width: the range of the first look
TAIL = 0.002  # share of the matches that may lie outside the range on either side
MARGIN = 0.06  # of the range, and two small pixels


def search_range(a: Any, b: Any, how: StereoSettings) -> tuple[int, int]:
    """First and last disparity, px, as the settings say, or from a look at a small copy."""
    if how.least_px is not None and how.most_px is not None:
        return how.least_px, how.most_px
    seen = _seen(a, b, how)
    first = how.least_px if how.least_px is not None else seen[0]
    last = how.most_px if how.most_px is not None else seen[1]
    return (first, max(last, first + 1)) if how.least_px is not None else (min(first, last - 1), last)


def _seen(a: Any, b: Any, how: StereoSettings) -> tuple[int, int]:
    """Range of the disparities that are confirmed from both sides on a copy a few hundred pixels wide."""
    import cv2

    from vision3d.stereo.left_right import agree, without_speckles
    from vision3d.stereo.semi_global import semi_global

    height, width = a.shape[:2]
    factor = max(1, round(width / SMALL_WIDTH))
    size = (max(16, width // factor), max(16, height // factor))
    near, far = (
        cv2.resize(one, size, interpolation=cv2.INTER_AREA).reshape(size[1], size[0], -1) for one in (a, b)
    )
    scale = width / size[0]
    first, last = -int(BEHIND * size[0]) - 2, int(AHEAD * size[0]) + 2
    raw = semi_global(near, far, first, last, how)
    good = agree(raw.left, raw.right, 1.0) & (raw.confidence > 0.02)
    good = without_speckles(raw.left, good, 20)
    found = raw.left[good]
    if found.size < 30:
        return 0, round(AHEAD * width)
    low, high = np.quantile(found, [TAIL, 1.0 - TAIL])
    room = MARGIN * (high - low) + 2.0
    return int(np.floor((low - room) * scale)), int(np.ceil((high + room) * scale))
