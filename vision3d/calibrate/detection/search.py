"""Where boards are looked for: large images are reduced first, and what is seen instead is doubted."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from vision3d.calibrate.detection.lattice import Array, Ids
from vision3d.calibrate.detection.smooth import fit_smooth

__all__ = ["WIDE_PX", "believable", "enlarged", "scales"]

Grey = NDArray[np.uint8]

WIDE_PX = 1200
"""Longest side of an image that is searched as it is; larger ones are reduced to it first."""
FEWEST, WHOLE, SCATTER = 12, 0.85, 0.06
"""A grid that is believed has that many points, that share of its places, and scatters by that share of its
spacing about a plane seen through a lens."""


def scales(grey: Grey) -> Iterator[tuple[Grey, float]]:
    """The image to search and its scale: reduced where it is large, then as it is."""
    import cv2

    if (longest := max(grey.shape)) > WIDE_PX:
        scale = WIDE_PX / longest
        yield (
            np.asarray(cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8),
            scale,
        )
    yield grey, 1.0


def enlarged(pixels: Array, scale: float) -> Array:
    """Pixels of a reduced image where they are in the image itself: centres of pixels count from 0."""
    full: Array = (pixels + 0.5) / scale - 0.5
    return full


def believable(cells: Ids, pixels: Array, places: int, size: tuple[int, int]) -> bool:
    """Whether a grid is worth telling of: clutter may look like a few squares, but not like many in line.

    Parameters
    ----------
    cells, pixels : (N, 2) where the points are on a square lattice and in the image
    places : points that a whole grid of its size has
    size : (width, height) of the image
    """
    n = len(cells)
    if n < FEWEST or n < WHOLE * places:
        return False
    smooth = fit_smooth(np.column_stack([cells.astype(np.float64), np.zeros(n)]), pixels, size)
    if smooth is None:
        return False
    spacing = np.hypot(*np.ptp(pixels, axis=0)) / np.hypot(*np.ptp(cells, axis=0))
    return bool(smooth.scale_px < SCATTER * spacing)
