"""The lane between two lines: its sides, its middle, and where it runs to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vision3d.lines.detector import as_grey
from vision3d.lines.segments import SegmentSettings, find_segments, lengths

__all__ = ["Lane", "find_lane"]

Array = NDArray[np.float64]
STEEP = np.radians(10.0)  # from level; what lies flatter is no side of a lane
LEAST = 0.15  # of the height: length of a side's segment
WIDTH = (0.15, 2.0)  # of the image, at its bottom
ALIKE = 0.12  # of the lane's width: the two edges of one painted stripe
INNER = 0.5  # of the longer one's length, that the inner edge must have


@dataclass(frozen=True, slots=True, eq=False)
class Lane:
    """A lane in an image; NaN where there is none.

    Attributes
    ----------
    found : whether there are two sides
    left, right : (4,) x y at the bottom of the image, x y at the top of the lane, px
    meeting_px : (2,) where the sides meet, the vanishing point
    offset : of the lane's middle at the bottom from the middle of the image, in lane widths, right positive
    heading_rad : from the bottom's middle to where the sides meet, from straight up, positive to the right
    reason : why there is none; a phrase
    """

    found: bool
    left: Array
    right: Array
    meeting_px: Array
    offset: float
    heading_rad: float
    reason: str = ""


def find_lane(image: ArrayLike, *, top: float = 0.45, settings: SegmentSettings | None = None) -> Lane:
    """Find the two sides of the lane in front of a vehicle.

    Parameters
    ----------
    image : (h, w) grey levels or (h, w, 3) BGR, uint8
    top : the lane is looked for below this share of the height
    settings : of the segments

    Returns
    -------
    Lane
        the pair of long segments that lean towards each other, meet above `top` and have the most length; of
        the two edges of a painted stripe the inner one.
    """
    grey = as_grey(image)
    height, width = grey.shape
    first = int(top * height)
    below = np.array([0.0, first, 0.0, first])
    segments = find_segments(np.ascontiguousarray(grey[first:]), settings) + below
    segments = segments[lengths(segments) >= LEAST * height]
    rows = np.array([height - 1.0, float(first)])
    at = _crossings(segments, rows)
    lean = at[:, 1] - at[:, 0]  # how far to the right it moves upwards
    steep = np.abs(lean) < (rows[0] - rows[1]) / np.tan(STEEP)
    middle = 0.5 * (width - 1)
    lefts, rights = (np.flatnonzero(steep & side) for side in (at[:, 0] < middle, at[:, 0] >= middle))
    pair = _best_pair(at, lean, lengths(segments), lefts, rights, width)
    if pair is None:
        return _none("no two long segments lean towards each other on both sides of the middle")
    left, right = pair
    closing = lean[left] - lean[right]
    wide = at[right, 0] - at[left, 0]
    share = wide / closing
    meeting = np.array([at[left, 0] + share * lean[left], rows[0] + share * (rows[1] - rows[0])])
    centre = 0.5 * (at[left, 0] + at[right, 0])
    return Lane(
        found=True,
        left=np.array([at[left, 0], rows[0], at[left, 1], rows[1]]),
        right=np.array([at[right, 0], rows[0], at[right, 1], rows[1]]),
        meeting_px=meeting,
        offset=float((centre - middle) / wide),
        heading_rad=float(np.arctan2(meeting[0] - centre, rows[0] - meeting[1])),
    )


def _crossings(segments: Array, rows: Array) -> Array:
    """The x (N, len(rows)) at which the lines of segments cross rows; huge for level ones."""
    rise = segments[:, 3] - segments[:, 1]
    rise = np.where(np.abs(rise) < 1e-6, 1e-6, rise)
    slope = (segments[:, 2] - segments[:, 0]) / rise
    return np.asarray(segments[:, :1] + slope[:, None] * (rows[None, :] - segments[:, 1:2]))


def _best_pair(
    at: Array,
    lean: Array,
    long: Array,
    lefts: NDArray[np.int64],
    rights: NDArray[np.int64],
    width: int,
) -> tuple[int, int] | None:
    """The two sides with the greatest length of the shorter one, moved to the inner edges."""
    best, found = 0.0, None
    for left in lefts:
        for right in rights:
            wide, above = at[right, 0] - at[left, 0], at[right, 1] - at[left, 1]
            if not WIDTH[0] * width < wide < WIDTH[1] * width or not -0.1 * wide < above < 0.8 * wide:
                continue
            if min(long[left], long[right]) > best:
                best, found = min(long[left], long[right]), (int(left), int(right))
    if found is None:
        return None
    near = ALIKE * (at[found[1], 0] - at[found[0], 0])
    left = _inner(found[0], lefts, at[:, 0], long, near, sign=1.0)
    right = _inner(found[1], rights, at[:, 0], long, near, sign=-1.0)
    return left, right


def _inner(chosen: int, among: NDArray[np.int64], x: Array, long: Array, near: float, *, sign: float) -> int:
    """The innermost line that is nearly the chosen one."""
    alike = [k for k in among if abs(x[k] - x[chosen]) < near and long[k] > INNER * long[chosen]]
    return int(max(alike, key=lambda k: sign * x[k]))


def _none(reason: str) -> Lane:
    nan = float("nan")
    four = np.full(4, nan)
    return Lane(
        found=False,
        left=four,
        right=four,
        meeting_px=np.full(2, nan),
        offset=nan,
        heading_rad=nan,
        reason=reason,
    )
