"""Checkerboards in one image: found by growing their grid or by OpenCV, refined, and put in order."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from vision3d.boards import Checkerboard
from vision3d.calibrate.detection.found import Found, NotFound
from vision3d.calibrate.detection.grid_growth import find_grids
from vision3d.calibrate.detection.lattice import Array
from vision3d.calibrate.detection.lattice_growth import Grid
from vision3d.calibrate.detection.ordering import Cells, dark_first, laid_out, parity_sign, turned_towards
from vision3d.calibrate.detection.refine import refine_saddles
from vision3d.calibrate.detection.search import believable, enlarged, scales

__all__ = ["find_checkerboard"]

Grey = NDArray[np.uint8]

AGREED = 0.8
"""Mean agreement of the corners about the colour of the squares, below which a grid is no checkerboard."""
FILLED = 0.6
BLURS_PX = (1.5, 1.0, 3.0)
"""Smoothings to try: fine ones for small squares, coarse ones for blurred images."""


def find_checkerboard(grey: Grey, board: Checkerboard) -> Found | NotFound:
    """Find the inner corners of a board; refined, in order, corner 0 beside a dark square where one is.

    Parameters
    ----------
    grey : (h, w)
    board : what to look for
    """
    seen: list[Grid] = []
    for image, scale in scales(grey):
        for blur_px in BLURS_PX:
            for grid in find_grids(image, blur_px)[:4]:
                whole = grid.trimmed()
                if sorted(whole.shape) == sorted(board.shape) and len(whole.cells) >= FILLED * board.count:
                    way = _filled(Cells(enlarged(whole.pixels, scale), whole.cells, whole.shape))
                    if (found := _settled(grey, way, board, "grown grid")) is not None:
                        return found
                elif min(whole.shape) >= 3 and believable(
                    whole.cells, whole.pixels, whole.shape[0] * whole.shape[1], image.shape[::-1]
                ):
                    seen.append(whole)
        if (another := _instead(seen, board)) is not None:
            return NotFound(another)
    for name, pixels in _opencv(grey, board):
        way = Cells(pixels, np.array(board.lattice), board.shape)
        if (found := _settled(grey, way, board, name)) is not None:
            return found
    return NotFound(_instead(seen, board, least=0.0))


def _instead(seen: list[Grid], board: Checkerboard, least: float = 0.5) -> tuple[int, int] | None:
    """Size of the largest other grid, longer side first, if it has at least a share of the board's points."""
    largest = max(seen, key=lambda grid: len(grid.cells), default=None)
    if largest is None or len(largest.cells) < least * board.count:
        return None
    columns, rows = largest.shape
    return max(columns, rows), min(columns, rows)


def _filled(way: Cells) -> Cells:
    """The lattice with its holes filled by a homography through the other points."""
    columns, rows = way.shape
    if len(way.cells) == columns * rows:
        return way
    import cv2

    every = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    there = np.zeros(columns * rows, dtype=np.bool_)
    there[way.ids] = True
    H = cv2.findHomography(way.cells.astype(np.float64), way.pixels, 0)[0]
    pixels = np.asarray(cv2.perspectiveTransform(every[None].astype(np.float64), H)[0], dtype=np.float64)
    offset = np.full((columns * rows, 2), np.nan)
    offset[way.ids] = way.pixels - pixels[way.ids]
    for hole in np.flatnonzero(~there):
        near = np.argsort(np.sum((every - every[hole]) ** 2, axis=1) + 1e9 * ~there)[:4]
        pixels[hole] += offset[near].mean(axis=0)
    pixels[way.ids] = way.pixels
    return Cells(pixels, every.astype(np.int64), way.shape)


def _opencv(grey: Grey, board: Checkerboard) -> Iterator[tuple[str, Array]]:
    """What OpenCV finds: as the image is, equalised, and by sectors; large images reduced."""
    import cv2

    from vision3d.cv import find_chessboard

    image, scale = next(scales(grey))
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    equalised = np.asarray(cv2.createCLAHE(3.0, (8, 8)).apply(image), dtype=np.uint8)
    tries = (
        ("OpenCV", image, {"flags": flags}),
        ("OpenCV, equalised", equalised, {"flags": flags | cv2.CALIB_CB_FAST_CHECK}),
        ("OpenCV, by sectors", image, {"sector_based": True}),
    )
    for name, one, options in tries:
        whole, pixels = find_chessboard(one, *board.shape, **options)
        if whole and len(pixels) == board.count:
            yield name, enlarged(pixels, scale)


def _settled(grey: Grey, way: Cells, board: Checkerboard, finder: str) -> Found | None:
    """Refine and put in order; None where the corners do not agree on the colours of the squares."""
    ways = laid_out(way, board.shape)
    if not ways:
        return None
    first = ways[0]
    refined = refine_saddles(grey, first.pixels, first.ids, first.shape)
    good = np.isfinite(refined.sigma_px)
    if good.sum() < FILLED * board.count:
        return None
    sign = parity_sign(first.cells[good], refined.contrast[good])
    if abs(sign) < AGREED:
        return None
    wrong = good & (np.sign(refined.contrast) * (1.0 - 2.0 * (first.cells.sum(axis=1) % 2)) * sign < 0.0)
    good &= ~wrong
    possible, dark = dark_first(ways, first, sign)
    ids = turned_towards(possible).ids
    order = np.argsort(ids)
    kept = order[good[order]]
    return Found(
        ids=ids[kept],
        refined=refined.rows(kept),
        finder=finder,
        lost=tuple(int(i) for i in np.sort(ids[~good])),
        dark_first=dark,
    )  # fmt: skip
