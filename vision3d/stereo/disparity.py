"""Disparity of a rectified pair: how far each pixel of the left picture has moved in the right one.

    disparity = compute_disparity(left, right)
    disparity.map_px, disparity.std_px, disparity.valid

A point at pixel x of the left picture is at x - disparity in the same row of the right one.  The default
matcher is our own semi-global matching; OpenCV's stand behind the same call (`matcher="sgbm"`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError

__all__ = ["MATCHERS", "Disparity", "Matcher", "StereoSettings", "compute_disparity"]

Matcher = Literal["semi-global", "sgbm", "sgbm-3way", "sgbm-hh", "bm"]
MATCHERS: tuple[Matcher, ...] = get_args(Matcher)
Map = NDArray[np.float32]
Mask = NDArray[np.bool_]
LEAST_SIDE = 16  # px; the window of the census is 9 by 7
MOST_DISPARITIES = 2048


@dataclass(frozen=True, slots=True)
class StereoSettings:
    """How disparity is looked for.

    Attributes
    ----------
    matcher : `semi-global` (ours), or OpenCV's `sgbm` (5 paths), `sgbm-3way`, `sgbm-hh` (8 paths), `bm`
    least_px, most_px : range of the search; None finds it on a small copy of the pair
    paths : 4 or 8 directions along which costs are summed
    small_step, large_step : what a change of disparity by one, and by more, costs along a path (P1 and P2 of
        Hirschmüller 2008); a match costs 0 to 187
    edge_levels : grey levels; a large step across an image edge of so many costs half
    left_right_px : matches from the left and from the right agree to this
    speckle_px : patches of disparity of fewer pixels are dropped
    fill : give pixels that were not matched the disparity of what lies around and behind
    refine : settle disparity between pixels by least squares on the levels, where that is sharper
    """

    matcher: Matcher = "semi-global"
    least_px: int | None = None
    most_px: int | None = None
    paths: Literal[4, 8] = 8
    small_step: float = 45.0
    large_step: float = 300.0
    edge_levels: float = 20.0
    left_right_px: float = 1.0
    speckle_px: int = 100
    fill: bool = True
    refine: bool = True

    def __post_init__(self) -> None:
        if self.matcher not in MATCHERS:
            raise ModelError(f"no matcher {self.matcher!r}; known are {', '.join(MATCHERS)}")
        if self.paths not in (4, 8):
            raise ModelError(f"costs are summed along 4 or 8 paths, got {self.paths}")
        if not 0.0 <= self.small_step <= self.large_step <= 1000.0:
            raise ModelError(
                "steps of disparity cost 0 <= small_step <= large_step <= 1000; "
                f"got {self.small_step:g} and {self.large_step:g}"
            )
        if self.least_px is not None and self.most_px is not None:
            count = self.most_px - self.least_px + 1
            if not 2 <= count <= MOST_DISPARITIES:
                raise ModelError(
                    f"the search covers 2 to {MOST_DISPARITIES} disparities, got {self.least_px} to "
                    f"{self.most_px} px"
                )


@dataclass(frozen=True, slots=True, eq=False)
class Disparity:
    """Disparity of every pixel of the left picture; arrays are (h, w) and read-only.

    Attributes
    ----------
    map_px : float32, px; NaN where there is none
    std_px : float32, px; its standard deviation where `valid`, a bound from the surroundings where filled
    valid : matched, and confirmed from the right picture
    occluded : seen by the left camera only, as far as the matches tell
    confidence : 0 to 1; how far the best match costs less than the next (1 - best / next)
    range_px : first and last disparity that was looked for
    matcher : which one
    """

    map_px: Map
    std_px: Map
    valid: Mask
    occluded: Mask
    confidence: Map
    range_px: tuple[int, int]
    matcher: str = "semi-global"
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        for name in ("map_px", "std_px", "valid", "occluded", "confidence"):
            array = getattr(self, name)
            array.setflags(write=False)

    @property
    def matched_px(self) -> Map:
        """The disparity where it was matched, NaN elsewhere."""
        return np.where(self.valid, self.map_px, np.float32(np.nan))

    @property
    def density(self) -> float:
        """Share of the pixels that were matched and confirmed."""
        return float(self.valid.mean())


def compute_disparity(
    left: NDArray[np.uint8], right: NDArray[np.uint8], settings: StereoSettings | None = None
) -> Disparity:
    """Disparity of a rectified pair.

    Parameters
    ----------
    left, right : (h, w) or (h, w, 3) uint8; rows of one are rows of the other

    Raises
    ------
    ShapeError
        where the pictures differ in size or are no pictures.
    DataError
        where they are too small, or the same picture twice.

    Notes
    -----
    Census and colour cost (Zabih and Woodfill 1994; Mei et al. 2011), summed along paths (Hirschmüller 2008);
    left-right check, filling from the background, weighted median; least squares between pixels.
    """
    from vision3d.stereo.finishing import finished
    from vision3d.stereo.pair import levelled, require_pair
    from vision3d.stereo.search_range import search_range

    how = settings or StereoSettings()
    a, b = require_pair(left, right, LEAST_SIDE)
    b = levelled(a, b)
    first, last = search_range(a, b, how)
    raw = _matched(a, b, first, last, how)
    return finished(a, b, raw, (first, last), how)


def _matched(a: Any, b: Any, first: int, last: int, how: StereoSettings) -> Any:
    if how.matcher == "semi-global":
        from vision3d.stereo.semi_global import semi_global

        return semi_global(a, b, first, last, how)
    from vision3d.stereo.opencv_matching import opencv_match

    return opencv_match(a, b, first, last, how)
