"""Semi-global matching of our own: census and colour costs, summed along paths in strips of the picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from vision3d.stereo.disparity import StereoSettings

__all__ = ["RawDisparity", "grey_of", "semi_global"]

HALF_WINDOW = (4, 3)  # of the census: 9 by 7 pixels, 62 bits
LEAST = 2  # levels that a neighbour must be darker by, to be told from noise
BITS_COST, BITS_SCALE = 127.0, 30.0
LEVELS_COST, LEVELS_SCALE = 60.0, 10.0
OUTSIDE = 60  # what a match outside the right picture costs: as much as a poor one
MOST_CELLS = 100_000_000  # of one strip's volume: 300 MB
OVERLAP = 48  # rows that strips share, so that paths have settled where a strip begins


@dataclass(frozen=True, slots=True, eq=False)
class RawDisparity:
    """What a matcher gives: both pictures' disparity (h, w), and the confidence of the left one's.

    `left` is float32, NaN where nothing was matched; `right` int32 whole pixels, below `first` where none, or
    None where the matcher has made its own check; the confidence is NaN where the matcher tells none.
    """

    left: NDArray[np.float32]
    right: NDArray[np.int32] | None
    confidence: NDArray[np.float32]


def semi_global(a: Any, b: Any, first: int, last: int, how: StereoSettings) -> RawDisparity:
    """Match a (h, w, c) with b over the disparities first … last."""
    height, width = a.shape[:2]
    n = last - first + 1
    rows = max(3 * OVERLAP, MOST_CELLS // (width * n))
    left, confidence = (np.empty((height, width), np.float32) for _ in range(2))
    right = np.empty((height, width), np.int32)
    begin = 0
    while begin < height:
        end = min(height, begin + rows)
        if height - end < OVERLAP:
            end = height
        top, bottom = max(0, begin - OVERLAP), min(height, end + OVERLAP)
        strip = _strip(a[top:bottom], b[top:bottom], first, n, how)
        for whole, part in zip((left, right, confidence), strip, strict=True):
            whole[begin:end] = part[begin - top : end - top]
        begin = end
    return RawDisparity(left, right, confidence)


def grey_of(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Grey levels (h, w) of a picture (h, w, c)."""
    import cv2

    if image.shape[2] == 1:
        return np.ascontiguousarray(image[..., 0])
    return np.ascontiguousarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _strip(a: Any, b: Any, first: int, n: int, how: StereoSettings) -> tuple[Any, Any, Any]:
    """Left and right disparity and confidence of some rows."""
    from vision3d.kernels.stereo_cost import census, matching_cost
    from vision3d.kernels.stereo_paths import sum_paths
    from vision3d.kernels.stereo_winner import winners

    grey_a, grey_b = grey_of(a), grey_of(b)
    words = [np.empty(grey_a.shape, np.uint64) for _ in range(2)]
    census(grey_a, *HALF_WINDOW, LEAST, words[0])
    census(grey_b, *HALF_WINDOW, LEAST, words[1])
    channels = a.shape[2]
    of_bits = BITS_COST * (1.0 - np.exp(-np.arange(65) / BITS_SCALE))
    of_levels = LEVELS_COST * (1.0 - np.exp(-np.arange(256 * channels) / (channels * LEVELS_SCALE)))
    volume = np.empty((*grey_a.shape, n), np.uint8)
    matching_cost(
        *words, np.ascontiguousarray(a), np.ascontiguousarray(b), of_bits.astype(np.float32),
        of_levels.astype(np.float32), first, np.uint8(OUTSIDE), volume,
    )  # fmt: skip
    large = np.maximum(how.small_step, how.large_step / (1.0 + np.arange(256) / max(how.edge_levels, 1e-3)))
    total = np.zeros(volume.shape, np.uint16)
    sum_paths(
        volume, grey_a, np.float32(how.small_step), large.astype(np.float32), int(how.paths == 8), total
    )
    shape = grey_a.shape
    left, right, margin = np.empty(shape, np.float32), np.empty(shape, np.int32), np.empty(shape, np.float32)
    winners(total, first, left, right, margin)
    return left, right, margin
