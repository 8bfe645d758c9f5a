"""Whether matches of a pair lie in the same rows, as those of a rectified pair do.

rows = row_check(left, right)
rows.rms_px, rows.rectified, rows.words
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["RowCheck", "row_check"]

Array = NDArray[np.float64]
LEAST = 20  # matches
RECTIFIED_PX = 1.0  # root mean square of the offsets' smooth part, at most
WIDE = 1200  # px: larger pictures are halved until they are no wider
REACH = 0.15  # of the height, how far rows may be apart to be seen at all


@dataclass(frozen=True, slots=True, eq=False)
class RowCheck:
    """How far apart, px, matches' rows are: right less left.

    Attributes
    ----------
    count : matches that agree on a smooth offset
    tried : all matches
    mean_px : offset on the whole
    slopes : (2,) how it changes across and down the picture, px per width and height
    rms_px : of its smooth part over the picture: what rectification has left; NaN where too few matches
    noise_px : of the matches about it
    shifts_px : (count,) x of the left picture less x of the right one
    """

    count: int
    tried: int
    mean_px: float
    slopes: Array
    rms_px: float
    noise_px: float
    shifts_px: Array

    @property
    def known(self) -> bool:
        """Whether there were enough matches to tell."""
        return self.count >= LEAST

    @property
    def rectified(self) -> bool:
        """Whether rows of one picture are rows of the other; also where too few matches could tell."""
        return not self.known or self.rms_px <= RECTIFIED_PX

    @property
    def words(self) -> str:
        """In a phrase."""
        if not self.known:
            return f"too few matches to tell ({self.count})"
        turned = np.abs(self.slopes).max() > max(1.0, abs(self.mean_px))
        lead = f"rows differ by {self.mean_px:+.2f} px on the whole"
        change = (
            f", changing by {self.slopes[0]:+.1f} px across and {self.slopes[1]:+.1f} px down the picture"
        )
        return lead + (change if turned else "")


def row_check(left: Any, right: Any) -> RowCheck:
    """Match features of both pictures (h, w) or (h, w, c), and see in which rows they lie."""
    import cv2

    from vision3d.features import detect_features, match_features

    factor = 1
    while left.shape[1] // factor > WIDE:
        factor *= 2
    found = []
    for image in (left, right):
        grey = image if image.ndim == 2 else image.mean(axis=2).round().astype(np.uint8)
        if factor > 1:
            size = (grey.shape[1] // factor, grey.shape[0] // factor)
            grey = np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        found.append(detect_features(np.ascontiguousarray(grey), "sift", count=2000))
    pairs = match_features(*found, ratio=0.75).pairs
    if len(pairs) < LEAST:
        return _unknown(len(pairs))
    scale = left.shape[1] / (left.shape[1] // factor)
    a, b = (scale * one.pixels[pairs[:, k]] for k, one in enumerate(found))
    return _fitted(a, b, left.shape[1], left.shape[0])


def _unknown(tried: int) -> RowCheck:
    nan = float("nan")
    return RowCheck(0, tried, nan, np.full(2, nan), nan, nan, np.empty(0))


def _fitted(a: Array, b: Array, width: int, height: int) -> RowCheck:
    """A plane through the offsets of rows, matches off it left out."""
    offset = b[:, 1] - a[:, 1]
    design = np.column_stack([np.ones(len(a)), a[:, 0] / width - 0.5, a[:, 1] / height - 0.5])
    # where most offsets lie together
    ranked = np.sort(offset)
    half = len(ranked) // 2
    k = int(np.argmin(ranked[half:] - ranked[: len(ranked) - half]))
    keep = np.abs(offset - np.median(ranked[k : k + half + 1])) < max(3.0, REACH * height)
    solution = np.zeros(3)
    for _ in range(8):
        if keep.sum() < LEAST:
            return _unknown(len(a))
        solution = np.asarray(np.linalg.lstsq(design[keep], offset[keep], rcond=None)[0], dtype=np.float64)
        residual = np.abs(offset - design @ solution)
        keep = residual < max(0.5, 3.0 * 1.4826 * float(np.median(residual[keep])))
    if keep.sum() < LEAST:
        return _unknown(len(a))
    residual = (offset - design @ solution)[keep]
    smooth = design[keep] @ solution
    return RowCheck(
        int(keep.sum()), len(a), float(solution[0]), solution[1:], float(np.sqrt(np.mean(smooth**2))),
        float(np.sqrt(np.mean(residual**2))), (a - b)[keep, 0],
    )  # fmt: skip
