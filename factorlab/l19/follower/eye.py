"""What the robot reads from one image: where the line crosses two rows, in pixels and in metres."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.follower.curves import WIDTH_M
from factorlab.l19.follower.robot import CAMERA, ground
from sequential.errors import DataError
from vision3d.lines import LineReading, TwoRows, find_line, read_two_rows
from vision3d.lines.settings import no_line

__all__ = ["BOTTOM", "MIDDLE", "Detector", "Sighting", "aheads", "on_ground", "read", "sight"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Detector = Callable[[Image], tuple[float, float] | None]
BOTTOM, MIDDLE = 37, 20  # rows in the middle of the two bands
COLUMN_PX = 1.0  # what a column without a standard deviation is believed to
FLOOR_M = 5e-4  # what the map and the bend of the line within a band leave


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """Two points of the line on the ground, in the robot's frame when the shutter closes.

    Attributes
    ----------
    ahead : (2,) m in front of the robot's centre, near and far
    left : (2,) m to its left
    sigma : (2,) standard deviations of `left`, m
    """

    ahead: Array
    left: Array
    sigma: Array


@cache
def ground_from_pixels() -> Array:
    """(3, 3) from homogeneous pixels to homogeneous ground coordinates."""
    fx, fy, cx, cy = CAMERA.intrinsics[:4]
    return ground().ground_H_image @ np.linalg.inv(np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]))


def on_ground(columns: Array, rows: Array) -> tuple[Array, Array]:
    """Places (N, 2) m of pixels, and how far a pixel of column is (N,), m."""
    H = ground_from_pixels()
    q = columns[:, None] * H[:, 0] + rows[:, None] * H[:, 1] + H[:, 2]
    # the camera is level: a column changes y alone
    return q[:, :2] / q[:, 2:], np.abs(H[1, 0] / q[:, 2])


@cache
def aheads() -> Array:
    """(2,) m in front of the robot's centre, of both rows."""
    places, _ = on_ground(np.full(2, CAMERA.intrinsics[2]), np.array([BOTTOM, MIDDLE], dtype=np.float64))
    return places[:, 0]


@cache
def widths() -> tuple[float, float]:
    """Of the line in both rows, px."""
    _, per_pixel = on_ground(np.zeros(2), np.array([BOTTOM, MIDDLE], dtype=np.float64))
    near, far = WIDTH_M / per_pixel
    return float(near), float(far)


def read(image: Image, detector: str | Detector) -> LineReading:
    """The line in an image, by "bands", "threshold" or "find_line", or by a function of your own.

    Raises
    ------
    DataError
        where the function gives neither two columns nor None.
    """
    if callable(detector):
        return at_columns(detector(image))
    if detector == "find_line":
        return find_line(image)
    if detector == "threshold":
        return at_columns(by_threshold(image))
    return read_two_rows(image, TwoRows(widths(), middle=MIDDLE / (CAMERA.size[1] - 1)))


def by_threshold(image: Image) -> tuple[float, float] | None:
    """What one tries first: Otsu's level, and the mean column of what is dark in each of two rows."""
    from vision3d.image import otsu

    dark = image <= otsu(image)
    bottom, middle = (np.flatnonzero(dark[row]) for row in (BOTTOM, MIDDLE))
    if not len(bottom) or not len(middle) or dark.mean() > 0.5:
        return None
    return float(bottom.mean()), float(middle.mean())


def at_columns(columns: tuple[float, float] | None) -> LineReading:
    """A reading from the line's columns, px, in the rows `BOTTOM` and `MIDDLE`; None for no line."""
    if columns is None:
        return no_line("the detector found none")
    found = np.asarray(columns, dtype=np.float64)
    if found.shape != (2,):
        raise DataError(
            f"a detector gives two columns, in rows {BOTTOM} and {MIDDLE}, or None; got {columns!r}"
        )
    if not np.isfinite(found).all():
        return no_line("the detector found none")
    bottom, ahead = found.tolist()
    half = 0.5 * np.array(widths())
    return LineReading(
        found=True,
        bottom_px=(bottom, float(BOTTOM)),
        middle_px=(ahead, float(MIDDLE)),
        cov_px=COLUMN_PX**2 * np.eye(2),
        offset=(bottom - 0.5 * (CAMERA.size[0] - 1)) / (0.5 * CAMERA.size[0]),
        heading_rad=math.atan2(ahead - bottom, BOTTOM - MIDDLE),
        confidence=1.0,
        dark=True,
        width_px=widths()[0],
        edges_px=np.column_stack([(BOTTOM, MIDDLE), found - half, found + half]),
        reason="",
        parts={},
    )


def sight(reading: LineReading, moved: Array) -> Sighting:
    """A reading that was found, in metres; `moved` (3,) is the way since the exposure's middle."""
    pixels = np.array([reading.bottom_px, reading.middle_px])
    places, per_pixel = on_ground(pixels[:, 0], pixels[:, 1])
    c, s = math.cos(moved[2]), math.sin(moved[2])
    dx, dy = places[:, 0] - moved[0], places[:, 1] - moved[1]
    variance = reading.cov_px.diagonal() * per_pixel**2 + FLOOR_M**2
    return Sighting(c * dx + s * dy, c * dy - s * dx, np.sqrt(variance))
