"""How the line on the ground is looked for, and what is said of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError

__all__ = ["NO_LINE", "LineReading", "LineSettings"]

Polarity = Literal["auto", "dark", "light"]


@dataclass(frozen=True, slots=True)
class LineSettings:
    """Where a line may be, and what it looks like.

    Attributes
    ----------
    polarity : a line darker or lighter than the ground; auto takes the better of both
    threshold : adaptive (against the median round each pixel) or otsu (one level for all)
    window : side of the square that adaptive takes the median of, as a share of the width of the image
    contrast : least difference between line and ground, as a share of the ground's brightness
    middle : the row that looks ahead, as a share of the height from the top
    top : nothing above this share of the height is looked at
    width : least and largest width of the line at the bottom, as shares of the image's
    opening_px : what is narrower is taken for noise, after scaling the image to `working_px`
    working_px : the image is made smaller by a whole number until it is at most about as wide
    least_confidence : below it there is no line
    """

    polarity: Polarity = "auto"
    threshold: Literal["adaptive", "otsu"] = "adaptive"
    window: float = 0.8
    contrast: float = 0.15
    middle: float = 0.5
    top: float = 0.35
    width: tuple[float, float] = (0.012, 0.5)
    opening_px: int = 3
    working_px: int = 320
    least_confidence: float = 0.5

    def __post_init__(self) -> None:
        if not 0.0 <= self.top <= self.middle < 1.0:
            raise ModelError(f"expected 0 <= top <= middle < 1; got top {self.top} and middle {self.middle}")
        if not 0.0 < self.width[0] < self.width[1] <= 1.0:
            raise ModelError(
                f"width must be two shares of the image, 0 < least < largest <= 1; got {self.width}"
            )
        if self.polarity not in ("auto", "dark", "light") or self.threshold not in ("adaptive", "otsu"):
            raise ModelError(f"no polarity {self.polarity!r} or threshold {self.threshold!r}")


@dataclass(frozen=True, slots=True, eq=False)
class LineReading:
    """What an image says of the line in front of a robot.

    Attributes
    ----------
    found : whether there is one; without it the numbers are NaN
    bottom_px, middle_px : (x, y) of the line's middle in the lowest row and in the row that looks ahead
    cov_px : (2, 2) covariance of the two x, px²
    offset : of the bottom from the middle of the image, -1 at its left edge, 1 at its right one
    heading_rad : of the chord from bottom to middle, from straight up, positive to the right
    confidence : 0-1
    dark : whether the line is darker than the ground
    width_px : of the line in the lowest row
    edges_px : (n, 3) row y, x of the left edge, x of the right one, wherever they were seen
    reason : why there is no line, or what weakens it; a phrase
    parts : the factors of the confidence, by name
    """

    found: bool
    bottom_px: tuple[float, float]
    middle_px: tuple[float, float]
    cov_px: NDArray[np.float64]
    offset: float
    heading_rad: float
    confidence: float
    dark: bool
    width_px: float
    edges_px: NDArray[np.float64]
    reason: str
    parts: dict[str, float]


def no_line(reason: str, confidence: float = 0.0, parts: dict[str, float] | None = None) -> LineReading:
    """A reading without a line."""
    nan = float("nan")
    return LineReading(
        found=False,
        bottom_px=(nan, nan),
        middle_px=(nan, nan),
        cov_px=np.full((2, 2), nan),
        offset=nan,
        heading_rad=nan,
        confidence=confidence,
        dark=True,
        width_px=nan,
        edges_px=np.zeros((0, 3)),
        reason=reason,
        parts=parts or {},
    )


NO_LINE = no_line("no image yet")
