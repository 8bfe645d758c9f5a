"""What the robot reads from one image: where the line crosses two rows, in pixels and in metres."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.follower.curves import WIDTH_M
from factorlab.l19.follower.robot import CAMERA, ground
from vision3d.lines import LineReading, TwoRows, find_line, read_two_rows
from vision3d.lines.settings import no_line

__all__ = ["BOTTOM", "MIDDLE", "Sighting", "aheads", "on_ground", "read", "sight"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
BOTTOM, MIDDLE = 37, 20  # rows in the middle of the two bands
THRESHOLD_PX = 1.0  # what a mean column of a thresholded row is believed to
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


def read(image: Image, detector: str) -> LineReading:
    """The line in an image, by one of three detectors: "bands", "threshold", "find_line"."""
    if detector == "find_line":
        return find_line(image)
    if detector == "threshold":
        return by_threshold(image)
    return read_two_rows(image, TwoRows(widths(), middle=MIDDLE / (CAMERA.size[1] - 1)))


def by_threshold(image: Image) -> LineReading:
    """What one tries first: Otsu's level, and the mean column of what is dark in each of two rows."""
    from vision3d.image import otsu

    dark = image <= otsu(image)
    columns = [np.flatnonzero(dark[row]) for row in (BOTTOM, MIDDLE)]
    if not all(len(one) for one in columns) or dark.mean() > 0.5:
        return no_line("no row is dark in a part only")
    bottom, ahead = (float(one.mean()) for one in columns)
    lit = sum(float(np.ptp(one)) + 1.0 for one in columns)
    width = dark.shape[1]
    return LineReading(
        found=True,
        bottom_px=(bottom, float(BOTTOM)),
        middle_px=(ahead, float(MIDDLE)),
        cov_px=THRESHOLD_PX**2 * np.eye(2),
        offset=(bottom - 0.5 * (width - 1)) / (0.5 * width),
        heading_rad=float(np.arctan2(ahead - bottom, BOTTOM - MIDDLE)),
        confidence=float(min(1.0, sum(widths()) / lit)),
        dark=True,
        width_px=float(len(columns[0])),
        edges_px=np.array([[BOTTOM, columns[0][0], columns[0][-1]], [MIDDLE, columns[1][0], columns[1][-1]]]),
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
