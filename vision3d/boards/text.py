"""Boards and lengths as people write them: `9x6`, `25mm`."""

from __future__ import annotations

import re
from typing import Literal

from sequential.errors import ModelError
from vision3d.boards.board import Board
from vision3d.boards.charuco import CharucoBoard
from vision3d.boards.checkerboard import Checkerboard
from vision3d.boards.circles import CircleGrid
from vision3d.boards.marker_board import MarkerBoard

__all__ = ["KINDS", "Kind", "board_from_text", "metres", "size_from_text"]

Kind = Literal["checkerboard", "charuco", "circles", "acircles", "markers"]
KINDS: tuple[Kind, ...] = ("checkerboard", "charuco", "circles", "acircles", "markers")

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "inch": 0.0254, '"': 0.0254}
LONGEST_M = 10.0


def metres(text: str | float, what: str = "length") -> float:
    """Read a length with its unit: 25mm, 2.5 cm, 0.025m, 1in; a bare number is metres.

    Raises
    ------
    ModelError
        if it is no length, or one that no board has (such as 25, which was meant as millimetres).
    """
    match = re.fullmatch(r"\s*([0-9]*\.?[0-9]+(?:[eE][+-]?\d+)?)\s*([a-zA-Z\"]*)\s*", str(text))
    if match is None or (match[2].lower() or "m") not in UNITS:
        raise ModelError(f"a {what} is a number with a unit (mm, cm, m, in), such as 25mm; got {text!r}")
    length_m = float(match[1]) * UNITS[match[2].lower() or "m"]
    if not 0.0 < length_m <= LONGEST_M:
        hint = f"; did you mean {match[1]}mm?" if not match[2] else ""
        raise ModelError(f"a {what} is more than 0 and at most {LONGEST_M:g} m, got {text!r}{hint}")
    return length_m


def size_from_text(text: str) -> tuple[int, int]:
    """Read columns and rows: 9x6, 9X6, 9×6, 9*6 or 9,6."""
    match = re.fullmatch(r"\s*(\d{1,3})\s*[xX×*,]\s*(\d{1,3})\s*", text)
    if match is None:
        raise ModelError(f"the size of a board is columns x rows, such as 9x6; got {text!r}")
    return int(match[1]), int(match[2])


def board_from_text(
    size: str,
    *,
    square: str | float,
    kind: Kind = "checkerboard",
    marker: str | float | None = None,
    dictionary: str = "4x4_50",
    legacy: bool = False,
) -> Board:
    """Build a board from what is written on a command line.

    Parameters
    ----------
    size : columns x rows: inner corners of a checkerboard, squares of a ChArUco board, circles, markers
    square : side of a square; spacing of circles; side of a marker on a marker board
    kind : one of `KINDS`
    marker : side of the markers of a ChArUco board (0.75 of the square where it is not given); gap between
        the markers of a marker board (0.25 of the marker)
    dictionary, legacy : of the markers of a ChArUco or marker board

    Raises
    ------
    ModelError
        if a length or the size cannot be read, or the board cannot be built.
    """
    columns, rows = size_from_text(size)
    side_m = metres(square, "square" if kind in ("checkerboard", "charuco") else "spacing")
    if kind == "checkerboard":
        return Checkerboard(columns, rows, side_m)
    if kind in ("circles", "acircles"):
        return CircleGrid(columns, rows, side_m, asymmetric=kind == "acircles")
    if kind == "charuco":
        marker_m = 0.75 * side_m if marker is None else metres(marker, "marker")
        return CharucoBoard(columns, rows, side_m, marker_m, dictionary, legacy)
    if kind == "markers":
        gap_m = 0.25 * side_m if marker is None else metres(marker, "gap")
        return MarkerBoard.grid(columns, rows, side_m, gap_m, dictionary)
    raise ModelError(f"a board is one of {', '.join(KINDS)}; got {kind!r}")
