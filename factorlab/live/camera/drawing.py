"""Marks drawn on an image, smooth and at fractions of a pixel."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.live.camera.reading import Dots, Label, Line, Mark, Role

__all__ = ["COLOURS", "drawn"]

# blue, green, red: Okabe and Ito's, and red, green, blue for the axes of a frame as everywhere
COLOURS: dict[Role, tuple[int, int, int]] = {
    "good": (115, 158, 0),
    "warn": (0, 159, 230),
    "bad": (0, 94, 213),
    "accent": (233, 180, 86),
    "soft": (190, 190, 190),
    "x": (60, 60, 235),
    "y": (70, 190, 60),
    "z": (240, 120, 40),
}
SHIFT = 4  # fractional bits of OpenCV's coordinates
FAR = 20000.0  # px; beyond, OpenCV's integers would wrap
DARK, LIGHT = (24, 24, 24), (245, 245, 245)


def drawn(image: NDArray[np.uint8], marks: Iterable[Mark]) -> NDArray[np.uint8]:
    """A copy of the image (h, w, 3) with the marks on it; what is not finite is left out."""
    canvas = np.array(image, dtype=np.uint8)
    for mark in marks:
        match mark:
            case Line():
                _line(canvas, mark)
            case Dots():
                _dots(canvas, mark)
            case Label():
                _label(canvas, mark)
    return canvas


def _fixed(points: NDArray[np.float64]) -> NDArray[np.int32]:
    """Points in OpenCV's fixed-point numbers, whose pixel centres are whole."""
    return np.round(np.clip(points, -FAR, FAR) * (1 << SHIFT)).astype(np.int32)


def _line(canvas: Any, mark: Line) -> None:
    import cv2

    points = np.asarray(mark.points, dtype=np.float64).reshape(-1, 2)
    if len(points) < 2 or not np.isfinite(points).all():
        return
    corners = [_fixed(points).reshape(-1, 1, 2)]
    cv2.polylines(canvas, corners, mark.closed, COLOURS[mark.role], mark.width, cv2.LINE_AA, SHIFT)


def _dots(canvas: Any, mark: Dots) -> None:
    import cv2

    points = np.asarray(mark.points, dtype=np.float64).reshape(-1, 2)
    for x, y in _fixed(points[np.isfinite(points).all(axis=1)]).tolist():
        cv2.circle(canvas, (x, y), mark.radius << SHIFT, COLOURS[mark.role], -1, cv2.LINE_AA, SHIFT)


def _label(canvas: Any, mark: Label) -> None:
    import cv2

    if not np.isfinite(mark.point).all():
        return
    font, scale = cv2.FONT_HERSHEY_SIMPLEX, max(0.45, 0.45 * canvas.shape[0] / 480)
    (width, height), below = cv2.getTextSize(mark.text, font, scale, 1)
    x = int(np.clip(mark.point[0], 2, max(2, canvas.shape[1] - width - 2)))
    y = int(np.clip(mark.point[1], height + 4, max(height + 4, canvas.shape[0] - below - 2)))
    cv2.rectangle(canvas, (x - 3, y - height - 3), (x + width + 3, y + below), DARK, -1)
    cv2.putText(canvas, mark.text, (x, y), font, scale, LIGHT, 1, cv2.LINE_AA)
    cv2.rectangle(canvas, (x - 5, y - height - 3), (x - 3, y + below), COLOURS[mark.role], -1)
