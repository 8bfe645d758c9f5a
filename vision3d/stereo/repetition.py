"""Whether a picture looks the same a little farther along its rows, as tiles, blinds and shelves do."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

__all__ = ["Repetition", "repetition"]

HALF = 7  # px of a patch
PATCHES = 400
NEAREST = 5  # px: nearer than this a patch is like itself
ALIKE, UNLIKE = 0.85, 0.5  # correlation at a repetition, and at least once between
TEXTURE = 5.0  # levels: standard deviation of a patch that shows something


class Repetition(NamedTuple):
    """Share of the patches that come again in their row, how far apart they do (px, median), and how many."""

    share: float
    period_px: float
    patches: int


def repetition(image: Any, reach_px: int) -> Repetition:
    """Correlate patches of a picture (h, w) or (h, w, c) with their own rows, up to a distance of `reach_px`.

    A patch repeats where its correlation falls below one half and then rises above 0.85 again; what is alike
    all along the row (a level edge) does not count.
    """
    import cv2

    grey = image if image.ndim == 2 else image.mean(axis=2)
    grey = np.ascontiguousarray(grey, dtype=np.float32)
    height, width = grey.shape
    side = int(np.sqrt(PATCHES * width / height)) + 1
    rows = np.unique(np.linspace(HALF, height - HALF - 1, max(2, PATCHES // side)).astype(int))
    columns = np.unique(np.linspace(HALF, width - HALF - 1, side).astype(int))
    seen, periods = 0, []
    for y in rows:
        for x in columns:
            patch = grey[y - HALF : y + HALF + 1, x - HALF : x + HALF + 1]
            if patch.std() < TEXTURE:
                continue
            seen += 1
            begin, end = max(0, x - HALF - reach_px), min(width, x + HALF + reach_px + 1)
            strip = np.ascontiguousarray(grey[y - HALF : y + HALF + 1, begin:end])
            alike = cv2.matchTemplate(strip, np.ascontiguousarray(patch), cv2.TM_CCOEFF_NORMED)[0]
            period = _period(np.asarray(alike), x - HALF - begin)
            if period:
                periods.append(period)
    if not seen or not periods:
        return Repetition(0.0, float("nan"), seen)
    return Repetition(len(periods) / seen, float(np.median(periods)), seen)


def _period(alike: Any, at: int) -> int:
    """Distance to the nearest repetition on either side of `at`; 0 where there is none."""
    found = []
    for side in (alike[at:], alike[at::-1]):
        low = np.flatnonzero(side < UNLIKE)
        if not len(low):
            continue
        again = np.flatnonzero(side[low[0] :] > ALIKE)
        if len(again) and low[0] + again[0] >= NEAREST:
            peak = int(low[0] + again[0])
            found.append(peak + int(np.argmax(side[peak : peak + 5])))
    return min(found, default=0)
