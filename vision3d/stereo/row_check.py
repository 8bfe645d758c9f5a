"""Is a pair of pictures rectified?  What features matched between them say of their rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision3d.features import detect_features, match_features

__all__ = ["RowCheck", "check_rows", "row_check_of"]

Array = NDArray[np.float64]

FEATURES, RATIO = 1500, 0.75
FEWEST = 12  # matches from which anything is said
NEAR_PX = 3.0  # of the middle, within which a match counts as right
MAD = 1.4826


@dataclass(frozen=True, slots=True, eq=False)
class RowCheck:
    """Rows of features in both pictures.

    Parameters
    ----------
    offset_px : by how much the right picture's rows are lower, the median; NaN with too few matches
    spread_px : standard deviation of a match about it, from the median deviation
    tilt : change of the offset per px along a row, and down a column: a picture that is turned
    count : matches that agree
    matched : matches in all
    disparity_px : (2,) smallest and largest disparity (2nd and 98th of a hundred)
    """

    offset_px: float
    spread_px: float
    tilt: tuple[float, float]
    count: int
    matched: int
    disparity_px: tuple[float, float]

    @property
    def is_known(self) -> bool:
        """Whether there were matches enough."""
        return self.count >= FEWEST


def check_rows(left: NDArray[Any], right: NDArray[Any], axis: int = 0) -> RowCheck:
    """Match features of two pictures that ought to be rectified.

    Parameters
    ----------
    left, right : (h, w) or (h, w, 3), 8 bits
    axis : along which disparities run: 0 for x, 1 for y (a vertical rig)
    """
    a, b = (detect_features(image, "sift", count=FEATURES) for image in (left, right))
    if not len(a.pixels) or not len(b.pixels):
        return row_check_of(np.zeros((0, 2)), np.zeros((0, 2)), axis)
    pairs = match_features(a, b, ratio=RATIO).pairs
    return row_check_of(a.pixels[pairs[:, 0]], b.pixels[pairs[:, 1]], axis)


def row_check_of(left: Array, right: Array, axis: int = 0) -> RowCheck:
    """What matched pixels (N, 2) say."""
    across, nan = 1 - axis, float("nan")
    apart = right[:, across] - left[:, across]
    if len(apart) < FEWEST:
        return RowCheck(nan, nan, (nan, nan), 0, len(apart), (nan, nan))
    middle = _mode(apart)
    near = np.abs(apart - middle) < 3.0 * NEAR_PX
    offset = spread = nan
    for _ in range(3):
        offset = float(np.median(apart[near]))
        spread = MAD * float(np.median(np.abs(apart[near] - offset)))
        near = np.abs(apart - offset) < max(4.0 * spread, 0.5 * NEAR_PX)
    disparity = (left - right)[near, axis]
    low, high = np.quantile(disparity, (0.02, 0.98)) if near.any() else (nan, nan)
    at = left[near] - left[near].mean(axis=0) if near.any() else left[:0]
    slopes = np.linalg.lstsq(
        np.column_stack([np.ones(len(at)), at]), apart[near] - offset, rcond=None
    )[0] if len(at) >= FEWEST else np.full(3, nan)  # fmt: skip
    return RowCheck(
        offset,
        spread,
        (float(slopes[1]), float(slopes[2])),
        int(near.sum()),
        len(apart),
        (float(low), float(high)),
    )


def _mode(values: Array) -> float:
    """Middle of the window of 2 `NEAR_PX` that holds most values."""
    ordered = np.sort(values)
    ends = np.searchsorted(ordered, ordered + 2.0 * NEAR_PX, side="right")
    best = int(np.argmax(ends - np.arange(len(ordered))))
    return float(np.median(ordered[best : ends[best]]))
