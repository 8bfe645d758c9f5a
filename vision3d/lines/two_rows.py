"""The line in two bands of rows of a small image: what a controller needs, in a few microseconds.

Where the width of the line is known, and the ground round it plain, nothing has to be followed from row to
row: in each band a matched filter finds the stripe and least squares place it, with a standard deviation that
grows with the noise of the image.  `find_line` is for everything else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sequential.errors import ModelError
from vision3d.lines.settings import LineReading, no_line

__all__ = ["TwoRows", "read_two_rows"]

SOFT = 2.0  # px over which an edge rises: the pixel's own width, and as much for tilt and focus
FLOOR = 0.06  # px that a centre is never better known than
SURE = 2.0  # times the least contrast, from which on the reading is sure


@dataclass(frozen=True, slots=True)
class TwoRows:
    """Where to look, and for what.

    Attributes
    ----------
    width_px : of the line, in the lowest band and in the one that looks ahead
    middle : the middle of the band that looks ahead, as a share of the height from the top
    half_rows : rows of a band above its middle, and below
    dark : a line darker than the ground
    least_contrast : the difference from the ground over its standard deviation, below which there is no line
    """

    width_px: tuple[float, float]
    middle: float = 0.5
    half_rows: int = 2
    dark: bool = True
    least_contrast: float = 5.0

    def __post_init__(self) -> None:
        if not (min(self.width_px) >= 1.0 and 0.0 <= self.middle < 1.0 and self.half_rows >= 0):
            raise ModelError(
                "two rows take widths of 1 px or more, 0 <= middle < 1 and half_rows >= 0; "
                f"got {self.width_px}, {self.middle} and {self.half_rows}"
            )


def read_two_rows(image: ArrayLike, settings: TwoRows) -> LineReading:
    """Find the line in the lowest rows and in those that look ahead.

    Parameters
    ----------
    image : (h, w) grey levels or (h, w, 3) BGR, uint8

    Returns
    -------
    LineReading
        as `find_line` gives it; `bottom_px` and `middle_px` are in the middles of the two bands.

    Raises
    ------
    ShapeError
        where the array is no image.
    """
    from vision3d.kernels.row_centre import row_centre
    from vision3d.lines.detector import as_grey

    grey = np.ascontiguousarray(as_grey(image))
    height, width = grey.shape
    rows = (height - 1 - settings.half_rows, round(settings.middle * (height - 1)))
    profile, sums, out = np.empty(width), np.empty(width + 1), np.empty((2, 4))
    for k, row in enumerate(rows):
        sign = 1.0 if settings.dark else -1.0
        row_centre(grey, row, settings.half_rows, settings.width_px[k], SOFT, sign, profile, sums, out[k])
    clear = out[:, 3] / settings.least_contrast
    parts = {"bottom": float(np.clip(clear[0], 0.0, 1.0)), "middle": float(np.clip(clear[1], 0.0, 1.0))}
    confidence = float(np.clip(clear.min() / SURE, 0.0, 1.0))
    if not (clear >= 1.0).all() or not np.isfinite(out[:, 1]).all():
        where = "near" if clear[0] <= clear[1] else "ahead"
        return no_line(f"nothing {where} stands out from the noise of the image", confidence, parts)
    (bottom, _, _, _), (ahead, _, _, _) = out.tolist()
    cov = np.diag(out[:, 1] ** 2 + FLOOR**2)
    half = 0.5 * np.array(settings.width_px)
    edges = np.column_stack([rows, out[:, 0] - half, out[:, 0] + half])
    for array in (cov, edges):
        array.setflags(write=False)
    return LineReading(
        found=True,
        bottom_px=(bottom, float(rows[0])),
        middle_px=(ahead, float(rows[1])),
        cov_px=cov,
        offset=(bottom - 0.5 * (width - 1)) / (0.5 * width),
        heading_rad=float(np.arctan2(ahead - bottom, rows[0] - rows[1])),
        confidence=confidence,
        dark=settings.dark,
        width_px=settings.width_px[0],
        edges_px=edges,
        reason="",
        parts=parts,
    )
