"""Two pictures side by side, with lines between what belongs together."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vision3d.features.features import Array

__all__ = ["draw_matches"]

Colour = NDArray[np.uint8]
SHIFT = 4  # OpenCV draws at 1/16 px
GAP_PX = 8
# BGR, told apart by people who do not see red or green alike
RIGHT, WRONG, OUTLINE = (115, 158, 0), (0, 94, 213), (0, 200, 255)
FAINT = 0.45


def draw_matches(
    image_a: ArrayLike,
    image_b: ArrayLike,
    pixels_a: ArrayLike,
    pixels_b: ArrayLike,
    inliers: ArrayLike | None = None,
    *,
    outline: ArrayLike | None = None,
    most: int = 200,
) -> Colour:
    """Draw both pictures and their matches: inliers green over faint orange outliers.

    Parameters
    ----------
    image_a, image_b : (h, w) or (h, w, 3) BGR, uint8, of any two sizes
    pixels_a, pixels_b : (M, 2) px, best first
    inliers : (M,) bool; None draws all alike
    outline : (K, 2) px of a polygon in the second picture, such as the corners of the first through a
        homography
    most : lines of either colour, evenly chosen

    Returns
    -------
    NDArray[np.uint8]
        (max height, sum of widths and a gap, 3) BGR.
    """
    import cv2

    a, b = (np.asarray(pixels, dtype=np.float64).reshape(-1, 2) for pixels in (pixels_a, pixels_b))
    agree = np.ones(len(a), bool) if inliers is None else np.asarray(inliers, dtype=bool)
    canvas, shift = _side_by_side(image_a, image_b)
    to_right = np.array([shift, 0.0])
    b = b + to_right
    thick = max(1, round(max(canvas.shape[:2]) / 1400))
    wrong = _some(np.flatnonzero(~agree), most)
    if len(wrong):
        over = canvas.copy()
        _lines(over, a[wrong], b[wrong], WRONG, thick)
        canvas = np.asarray(cv2.addWeighted(over, FAINT, canvas, 1.0 - FAINT, 0.0), dtype=np.uint8)
    if outline is not None:
        polygon = np.asarray(outline, dtype=np.float64) + to_right
        _outline(canvas, polygon, shift, 2 * thick)
    right = _some(np.flatnonzero(agree), most)
    _lines(canvas, a[right], b[right], RIGHT, thick)
    for points in (a[right], b[right]):
        for centre in _fixed(points).tolist():
            cv2.circle(canvas, centre, (2 * thick) << SHIFT, RIGHT, -1, cv2.LINE_AA, SHIFT)
    return canvas


def _side_by_side(image_a: ArrayLike, image_b: ArrayLike) -> tuple[Colour, int]:
    """Both on one white canvas, and where the second begins."""
    import cv2

    both = [np.asarray(image, dtype=np.uint8) for image in (image_a, image_b)]
    both = [
        image if image.ndim == 3 else np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)) for image in both
    ]
    (ha, wa), (hb, wb) = (image.shape[:2] for image in both)
    canvas = np.full((max(ha, hb), wa + GAP_PX + wb, 3), 255, np.uint8)
    canvas[:ha, :wa], canvas[:hb, wa + GAP_PX :] = both
    return canvas, wa + GAP_PX


def _some(rows: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """At most so many rows, evenly over their order."""
    if len(rows) <= most:
        return rows
    return np.asarray(rows[np.linspace(0, len(rows) - 1, most).astype(np.int64)])


def _lines(canvas: Colour, a: Array, b: Array, colour: tuple[int, int, int], thick: int) -> None:
    import cv2

    for start, end in zip(_fixed(a).tolist(), _fixed(b).tolist(), strict=True):
        cv2.line(canvas, start, end, colour, thick, cv2.LINE_AA, SHIFT)


def _outline(canvas: Colour, polygon: Array, left: int, thick: int) -> None:
    """A polygon of the second picture, cut off at its edge; none where it runs to infinity."""
    import cv2

    if not np.isfinite(polygon).all() or np.abs(polygon).max() > 1e5:
        return
    second = np.ascontiguousarray(canvas[:, left:])
    moved = _fixed(polygon - (left, 0.0))
    cv2.polylines(
        second, [moved], isClosed=True, color=OUTLINE, thickness=thick, lineType=cv2.LINE_AA, shift=SHIFT
    )
    canvas[:, left:] = second


def _fixed(points: Array) -> NDArray[np.int32]:
    return np.asarray(np.rint(np.asarray(points) * (1 << SHIFT)), dtype=np.int32)
