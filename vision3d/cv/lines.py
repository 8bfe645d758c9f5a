"""Lines, segments, histograms and masks."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from vision3d.cv.shapes import Array, Ids, flat, rows

__all__ = ["calc_hist", "find_nonzero", "hough_lines", "hough_segments", "line_segments"]

Image = NDArray[Any]


def hough_lines(edges: Image, rho_px: float, theta_rad: float, threshold: int, **options: Any) -> Array:
    """Lines (N, 2): distance rho from the top-left pixel, px, and angle theta of the normal, rad."""
    import cv2

    return rows(cv2.HoughLines(edges, rho_px, theta_rad, threshold, **options), 2)


def hough_segments(
    edges: Image,
    rho_px: float,
    theta_rad: float,
    threshold: int,
    *,
    shortest_px: float = 0.0,
    gap_px: float = 0.0,
) -> Array:
    """Segments (N, 4): x1, y1, x2, y2, px, of the probabilistic transform."""
    import cv2

    found = cv2.HoughLinesP(edges, rho_px, theta_rad, threshold, minLineLength=shortest_px, maxLineGap=gap_px)
    return rows(found, 4)


def line_segments(image: Image, *, refine: int | None = None) -> tuple[Array, Array]:
    """Segments (N, 4) x1, y1, x2, y2 and widths (N,), px, of the line segment detector (LSD)."""
    import cv2

    detector = cv2.createLineSegmentDetector() if refine is None else cv2.createLineSegmentDetector(refine)
    segments, widths, _, _ = detector.detect(image)
    return rows(segments, 4), rows(widths, 1)[:, 0]


def calc_hist(
    image: Image, bins: int = 256, low: float = 0.0, high: float = 256.0, *, mask: Image | None = None
) -> Array:
    """Histogram (bins,) of a single channel."""
    import cv2

    return rows(cv2.calcHist([image], [0], mask, [bins], [low, high]), 1)[:, 0]


def find_nonzero(mask: Image) -> Ids:
    """Pixels (N, 2), x and y, at which a mask is not zero, row by row."""
    import cv2

    return flat(cv2.findNonZero(mask)).reshape(-1, 2)
