"""Straight segments of an image, and the longer lines that they are pieces of.

The line segment detector (LSD) or the probabilistic Hough transform gives segments; those that continue each
other are merged, and refitted to all their ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError
from vision3d.lines.detector import as_grey

__all__ = ["SegmentSettings", "find_segments", "lengths", "merge_segments"]

Array = NDArray[np.float64]
MOST = 1500  # longest segments that are merged; the pairs of more would take seconds


@dataclass(frozen=True, slots=True)
class SegmentSettings:
    """How segments are found and merged.

    Attributes
    ----------
    method : lsd, or hough
    shortest : shares of the image's diagonal that a segment must have before, and a line after merging
    angle_rad : largest angle between pieces of one line
    aside_px : how far the ends of a piece may lie from the line of another
    gap : longest gap between pieces, as a share of the longer one
    """

    method: Literal["lsd", "hough"] = "lsd"
    shortest: tuple[float, float] = (0.02, 0.04)
    angle_rad: float = 0.05
    aside_px: float = 2.0
    gap: float = 0.4

    def __post_init__(self) -> None:
        if self.method not in ("lsd", "hough"):
            raise ModelError(f"segments are found by 'lsd' or 'hough', not by {self.method!r}")


def find_segments(image: ArrayLike, settings: SegmentSettings | None = None) -> Array:
    """Straight lines of an image, the longest first.

    Parameters
    ----------
    image : (h, w) grey levels or (h, w, 3) BGR, uint8

    Returns
    -------
    Array
        (N, 4) x1, y1, x2, y2, px; read-only.
    """
    own = settings or SegmentSettings()
    grey = as_grey(image)
    diagonal = float(np.hypot(*grey.shape))
    raw = _hough(grey, diagonal) if own.method == "hough" else _lsd(grey)
    long = raw[lengths(raw) >= own.shortest[0] * diagonal]
    merged = merge_segments(long, own)
    merged = merged[lengths(merged) >= own.shortest[1] * diagonal]
    merged.setflags(write=False)
    return merged


def lengths(segments: Array) -> Array:
    """Lengths (N,) of segments (N, 4), px."""
    length: Array = np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])
    return length


def _lsd(grey: NDArray[np.uint8]) -> Array:
    from vision3d.cv import line_segments

    return line_segments(grey)[0]


def _hough(grey: NDArray[np.uint8], diagonal: float) -> Array:
    """Segments on the edges that Canny's thresholds keep, these taken from the image's own contrast."""
    import cv2

    from vision3d.cv import hough_segments

    level, _ = cv2.threshold(grey, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    edges = cv2.Canny(cv2.GaussianBlur(grey, (0, 0), 1.2), 0.5 * level, level)
    shortest = 0.02 * diagonal
    return hough_segments(
        edges, 1.0, np.pi / 360, max(20, int(0.6 * shortest)), shortest_px=shortest, gap_px=0.2 * shortest
    )


def merge_segments(segments: Array, settings: SegmentSettings | None = None) -> Array:
    """Join segments (N, 4) that continue each other, the longest first.

    A piece joins the longest line that it fits: nearly parallel, both its ends near the line, and the gap
    between them short.  The line is then fitted to the ends of all its pieces, weighted by their lengths.
    """
    own = settings or SegmentSettings()
    rest = segments[np.argsort(-lengths(segments))][:MOST].copy()
    done: list[Array] = []
    while len(rest):
        line, members = rest[0], np.zeros(len(rest), dtype=np.bool_)
        members[0] = True
        while True:
            fits = _continues(line, rest, own)
            fits[0] = True
            if not (fits & ~members).any():
                break
            members |= fits
            line = _through(rest[members])
        done.append(line)
        rest = rest[~members]
    merged = np.array(done).reshape(-1, 4)
    return np.asarray(merged[np.argsort(-lengths(merged))])


def _continues(line: Array, others: Array, own: SegmentSettings) -> NDArray[np.bool_]:
    """Which segments are pieces of a line."""
    start, step = line[:2], line[2:] - line[:2]
    long = max(float(np.hypot(*step)), 1e-9)
    along = step / long
    across = np.array([-along[1], along[0]])
    ends = others.reshape(-1, 2, 2) - start
    aside = np.abs(ends @ across).max(axis=1)
    place = np.sort(ends @ along, axis=1)
    gap = np.maximum(np.maximum(place[:, 0] - long, -place[:, 1]), 0.0)
    sine = np.abs((others[:, 2:] - others[:, :2]) @ across) / np.maximum(lengths(others), 1e-9)
    longer = np.maximum(lengths(others), long)
    fits: NDArray[np.bool_] = (
        (sine < np.sin(own.angle_rad)) & (aside < own.aside_px) & (gap < own.gap * longer)
    )
    return fits


def _through(pieces: Array) -> Array:
    """The segment through the ends of its pieces."""
    ends = pieces.reshape(-1, 2)
    weights = np.repeat(lengths(pieces), 2)
    middle = np.average(ends, axis=0, weights=weights)
    centred = ends - middle
    _, _, axes = np.linalg.svd(centred * np.sqrt(weights)[:, None], full_matrices=False)
    place = centred @ axes[0]
    return np.concatenate([middle + place.min() * axes[0], middle + place.max() * axes[0]])
