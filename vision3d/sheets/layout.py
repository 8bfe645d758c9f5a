"""A pattern in the middle of a sheet, with a ruler to check the print by and words that say what it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sequential.errors import ModelError
from vision3d.boards import Board, CharucoBoard, Checkerboard, CircleGrid, MarkerBoard
from vision3d.boards.board import millimetres
from vision3d.sheets.page import PAPERS, Disc, Line, Page, Rect, Text, paper_size
from vision3d.sheets.patterns import board_shapes, marker_shapes

__all__ = ["board_page", "calibration_command", "largest_square_m", "marker_pages"]

EDGE = 5.0
"""What printers leave blank along the edges, mm."""
FOOT = 12.0
"""Height of the ruler and the words below the pattern, mm."""
QUIET = 2.0
"""Blank between the pattern and the words, mm."""
RULER = 100.0


def board_page(board: Board, paper: str = "a4") -> Page:
    """Lay a board out on a sheet, turned so that it fits.

    Raises
    ------
    ModelError
        if it does not fit; the sentence names the largest size that does, and the smallest paper.
    """
    width, height = _extent(board)
    sheet = _turned(paper, width, height)
    if sheet is None:
        raise ModelError(_too_large(board, paper))
    left, top = 0.5 * (sheet[0] - width), EDGE + 0.5 * (sheet[1] - 2 * EDGE - FOOT - height)
    black = tuple(_moved(shape, left, top) for shape in board_shapes(board))
    lines, words = _foot(sheet, board.name, calibration_command(board))
    return Page(*sheet, board.name, black, lines, words)


def largest_square_m(board: Board, paper: str = "a4") -> float:
    """The largest whole number of millimetres for the squares, spacing or markers, in m.

    Everything else on the board keeps its proportion to it.

    Raises
    ------
    ModelError
        if not even one millimetre fits.
    """
    side = _side(board)
    for side_mm in range(int(max(paper_size(paper))), 0, -1):
        width, height = (size * 1e-3 * side_mm / side for size in _extent(board))
        if _turned(paper, width, height) is not None:
            return 1e-3 * side_mm
    raise ModelError(f"no {board.kind} board of this size fits on {paper}: take a larger paper")


def marker_pages(
    dictionary: str, ids: list[int], size_m: float, *, gap_m: float | None = None, paper: str = "a4"
) -> list[Page]:
    """Lay single markers out, each with its number and lines to cut along, on as many sheets as they need.

    Parameters
    ----------
    dictionary, ids : which markers
    size_m : side of the black square
    gap_m : white around each marker, half of it on each side; by default a quarter of the marker, and at
        least 8 mm
    paper : of `vision3d.sheets.PAPERS`, or width x height in mm
    """
    from vision3d.boards import DICTIONARIES, dictionary_name

    name, size = dictionary_name(dictionary), 1e3 * size_m
    if wrong := [number for number in ids if not 0 <= number < DICTIONARIES[name].count]:
        raise ModelError(f"{name} has the markers 0 to {DICTIONARIES[name].count - 1}, got {wrong}")
    if not ids:
        raise ModelError("there is no marker to print; give --ids, such as 0-11 or 3,7,12")
    gap = max(0.25 * size, 8.0) if gap_m is None else 1e3 * gap_m
    pitch, words = size + gap, 4.0
    paper_width, paper_height = paper_size(paper)
    columns = int((paper_width - 2 * EDGE) // pitch)
    rows = int((paper_height - 2 * EDGE - FOOT) // (pitch + words))
    if columns < 1 or rows < 1:
        raise ModelError(
            f"a marker of {millimetres(size_m)} with {millimetres(1e-3 * gap)} around it does not fit on "
            f"{paper}; take a larger paper or a smaller --size"
        )
    pages = []
    for first in range(0, len(ids), columns * rows):
        shapes: list[Rect | Disc] = []
        lines: list[Line] = []
        texts: list[Text] = []
        left = 0.5 * (paper_width - columns * pitch)
        for place, number in enumerate(ids[first : first + columns * rows]):
            x, y = left + place % columns * pitch, EDGE + place // columns * (pitch + words)
            shapes += marker_shapes(name, number, x + 0.5 * gap, y + 0.5 * gap, size)
            lines += _frame(x, y, pitch, pitch + words)
            told = f"{name} · id {number} · {millimetres(size_m)}"
            texts.append(Text(x + 0.5 * pitch, y + pitch + 1.5, told, min(2.8, pitch / 16.0), middle=True))
        title = f"{len(ids)} markers of {name}, {millimetres(size_m)} wide"
        command = f"factorlab markers IMAGE --size {1e3 * size_m:g}mm --dictionary {name}"
        ruler, foot = _foot((paper_width, paper_height), title, command)
        pages.append(Page(paper_width, paper_height, title, tuple(shapes), (*lines, *ruler), (*texts, *foot)))
    return pages


def calibration_command(board: Board) -> str:
    """What to type to calibrate a camera with the board."""
    start = "factorlab calibrate camera IMAGES"
    if isinstance(board, Checkerboard):
        return f"{start} --board {board.columns}x{board.rows} --square {1e3 * board.square_m:g}mm"
    if isinstance(board, CharucoBoard):
        return (
            f"{start} --kind charuco --board {board.columns}x{board.rows} "
            f"--square {1e3 * board.square_m:g}mm --marker {1e3 * board.marker_m:g}mm "
            f"--dictionary {board.dictionary}"
        )
    if isinstance(board, CircleGrid):
        kind = "acircles" if board.asymmetric else "circles"
        size = f"{board.columns}x{board.rows}"
        return f"{start} --kind {kind} --board {size} --square {1e3 * board.spacing_m:g}mm"
    if isinstance(board, MarkerBoard):
        size_mm = 1e3 * board.pitch_m
        return f"factorlab markers IMAGE --size {size_mm:g}mm --dictionary {board.dictionary}"
    return start


def _extent(board: Board) -> tuple[float, float]:
    """Width and height of the printed pattern, mm."""
    width, height = 1e3 * np.ptp(board.outline[:, :2], axis=0)
    return float(width), float(height)


def _side(board: Board) -> float:
    """The length that is given on the command line, m."""
    return board.spacing_m if isinstance(board, CircleGrid) else board.pitch_m


def _turned(paper: str, width: float, height: float) -> tuple[float, float] | None:
    """The paper upright or on its side, whichever holds the pattern; None where neither does."""
    one = paper_size(paper)
    for sheet in sorted((one, one[::-1]), key=lambda size: (size[0] < size[1]) == (width > height)):
        if width <= sheet[0] - 2 * EDGE and height + FOOT + QUIET <= sheet[1] - 2 * EDGE:
            return sheet
    return None


def _too_large(board: Board, paper: str) -> str:
    width, height = _extent(board)
    fits = millimetres(largest_square_m(board, paper))
    what = "a spacing" if isinstance(board, CircleGrid) else "squares"
    roomy = [name for name in PAPERS if _turned(name, width, height) is not None]
    smallest = min(roomy, key=lambda name: PAPERS[name][0] * PAPERS[name][1], default="a larger paper")
    told = f"{what} of {fits} would fit, or take {smallest}"
    return f"the {board.name} measures {width:g} x {height:g} mm and does not fit on {paper}: {told}"


def _moved(shape: Rect | Disc, dx: float, dy: float) -> Rect | Disc:
    return replace(shape, x=shape.x + dx, y=shape.y + dy)


def _frame(x: float, y: float, width: float, height: float) -> list[Line]:
    """Grey lines to cut along."""
    right, bottom = x + width, y + height
    ends = [(x, y, right, y), (right, y, right, bottom), (right, bottom, x, bottom), (x, bottom, x, y)]
    return [Line(*four, width=0.1, grey=0.7) for four in ends]


def _foot(sheet: tuple[float, float], title: str, command: str) -> tuple[tuple[Line, ...], tuple[Text, ...]]:
    """A ruler of 100 mm (50 mm on small sheets) with its ticks, and two lines of words."""
    length = RULER if sheet[0] >= RULER + 60.0 else 0.5 * RULER
    x, y = EDGE + 2.0, sheet[1] - EDGE - 1.0
    lines = [Line(x, y, x + length, y, 0.25)]
    lines += [
        Line(x + k, y, x + k, y - (3.0 if k % 50 == 0 else 2.0 if k % 10 == 0 else 1.0), 0.15)
        for k in range(int(length) + 1)
    ]
    small = min(2.5, (sheet[0] - 2 * EDGE) / 75.0)
    told = f"{title}. Print at 100 %, without scaling, and measure: the ruler is {length:g} mm."
    texts = [
        Text(x, y - 4.2, told, small),
        Text(x + length + 4.0, y, command, min(small, (sheet[0] - x - length - 9.0) / (0.55 * len(command)))),
    ]
    return tuple(lines), tuple(texts)
