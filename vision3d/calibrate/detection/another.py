"""What an image shows where the board that was asked for is in none: another kind of board."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision3d.boards import Board, CharucoBoard, Checkerboard, CircleGrid, MarkerBoard
from vision3d.calibrate.detection.circle_lattices import find_lattices
from vision3d.calibrate.detection.grid_growth import find_grids
from vision3d.calibrate.detection.search import believable, scales

__all__ = ["another_kind"]

Grey = NDArray[np.uint8]

MARKERS = 4


def another_kind(grey: Grey, board: Board) -> str:
    """Say which other kind of board an image shows, and which option takes it; nothing for none."""
    image, _ = next(scales(grey))
    told = "" if isinstance(board, CharucoBoard | MarkerBoard) else _markers(image)
    told = told or ("" if isinstance(board, Checkerboard) else _checkerboard(image))
    return told or _circles(image, board)


def _markers(image: Grey) -> str:
    from vision3d.markers import find_markers

    found, dictionary = find_markers(image, "auto")
    if dictionary is None or len(found) < MARKERS:
        return ""
    return (
        f"{len(found)} markers of {dictionary}: a ChArUco board? try --kind charuco --dictionary {dictionary}"
    )


def _checkerboard(image: Grey) -> str:
    for grid in find_grids(image)[:2]:
        whole = grid.trimmed()
        columns, rows = sorted(whole.shape, reverse=True)
        if rows >= 3 and believable(whole.cells, whole.pixels, columns * rows, image.shape[::-1]):
            return f"a checkerboard: try --kind checkerboard --board {columns}x{rows}"
    return ""


def _circles(image: Grey, board: Board) -> str:
    """A grid of circles of the other kind, or of either."""
    kinds = [not board.asymmetric] if isinstance(board, CircleGrid) else [False, True]
    for asymmetric in kinds:
        any_grid = CircleGrid(2, 2, 1.0, asymmetric)
        lattice = next(find_lattices(image, any_grid, dark=True), None)
        if lattice is None or min(lattice.size) < 3:
            continue
        columns, rows = lattice.size if asymmetric else sorted(lattice.size, reverse=True)
        word, kind = ("n asymmetric", "acircles") if asymmetric else ("", "circles")
        return f"a{word} grid of circles: try --kind {kind} --board {columns}x{rows}"
    return ""
