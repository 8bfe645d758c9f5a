"""Draw what was found over the image it was found in; every function gives a copy in colour."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vision3d.lines.lane import Lane
from vision3d.lines.settings import LineReading
from vision3d.lines.vanishing import VanishingPoint

__all__ = ["draw_lane", "draw_line", "draw_segments"]

Colour = NDArray[np.uint8]
Array = NDArray[np.float64]
SHIFT = 4  # OpenCV draws at 1/16 px
# BGR, told apart by people who do not see red or green alike
ORANGE, BLUE, GREEN = (0, 130, 240), (190, 110, 20), (90, 160, 30)
GREY, WHITE = (150, 150, 150), (245, 245, 245)


def draw_line(image: ArrayLike, reading: LineReading) -> Colour:
    """The edges of the line, its middle in both rows, and the chord whose angle is the heading."""
    import cv2

    canvas = _canvas(image)
    thick = _thickness(canvas)
    if not reading.found:
        return canvas
    # straight ahead, from which heading and offset count
    ahead = 0.5 * (canvas.shape[1] - 1)
    bottom, middle = reading.bottom_px[1], reading.middle_px[1]
    for y in np.arange(bottom, middle, -24.0 * thick):
        _polyline(canvas, np.array([[ahead, y], [ahead, max(y - 12.0 * thick, middle)]]), WHITE, thick)
    for k in (1, 2):
        _polyline(canvas, np.column_stack([reading.edges_px[:, k], reading.edges_px[:, 0]]), BLUE, thick)
    chord = np.array([reading.bottom_px, reading.middle_px])
    _polyline(canvas, chord, ORANGE, thick)
    for x, y in chord:
        cv2.circle(canvas, _fixed((x, y)), (4 * thick) << SHIFT, ORANGE, -1, cv2.LINE_AA, SHIFT)
    return canvas


def draw_lane(image: ArrayLike, lane: Lane, *, opacity: float = 0.35) -> Colour:
    """The lane filled between its sides, and the sides themselves."""
    import cv2

    canvas = _canvas(image)
    if not lane.found:
        return canvas
    left, right = lane.left.reshape(2, 2), lane.right.reshape(2, 2)
    filled = canvas.copy()
    corners = np.array([left[0], left[1], right[1], right[0]])
    cv2.fillPoly(filled, [_fixed_all(corners)], GREEN, cv2.LINE_AA, SHIFT)
    canvas = np.asarray(cv2.addWeighted(filled, opacity, canvas, 1.0 - opacity, 0.0), dtype=np.uint8)
    for side in (left, right):
        _polyline(canvas, side, ORANGE, 2 * _thickness(canvas))
    return canvas


def draw_segments(image: ArrayLike, segments: Array, points: Sequence[VanishingPoint] = ()) -> Colour:
    """Segments (N, 4), coloured by the vanishing point that they aim at, grey where they aim at none."""
    canvas = _canvas(image)
    colours = [GREY] * len(segments)
    for point, colour in zip(points, (ORANGE, BLUE, GREEN), strict=False):
        for k in point.members:
            colours[int(k)] = colour
    for segment, colour in zip(segments, colours, strict=True):
        _polyline(canvas, segment.reshape(2, 2), colour, _thickness(canvas))
    return canvas


def _canvas(image: ArrayLike) -> Colour:
    """A copy in colour."""
    import cv2

    pixels = np.asarray(image, dtype=np.uint8)
    return np.array(pixels if pixels.ndim == 3 else cv2.cvtColor(pixels, cv2.COLOR_GRAY2BGR))


def _thickness(canvas: Colour) -> int:
    return max(1, round(float(max(canvas.shape[:2])) / 500.0))


def _fixed(point: Sequence[float]) -> tuple[int, int]:
    return round(point[0] * (1 << SHIFT)), round(point[1] * (1 << SHIFT))


def _fixed_all(points: Array) -> NDArray[np.int32]:
    return np.round(points * (1 << SHIFT)).astype(np.int32)


def _polyline(canvas: Colour, points: Array, colour: tuple[int, int, int], thickness: int) -> None:
    import cv2

    cv2.polylines(canvas, [_fixed_all(points)], False, colour, thickness, cv2.LINE_AA, SHIFT)  # noqa: FBT003
