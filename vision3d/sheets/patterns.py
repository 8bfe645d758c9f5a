"""Boards and markers as black shapes, in millimetres from the top left corner of the pattern."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sequential.errors import ModelError
from vision3d.boards import Board, CharucoBoard, Checkerboard, CircleGrid, MarkerBoard
from vision3d.sheets.page import Disc, Rect

__all__ = ["board_shapes", "marker_shapes"]

Shape = Rect | Disc


def board_shapes(board: Board) -> tuple[Shape, ...]:
    """Draw a board, the top left corner of its outline at the origin."""
    left, top = board.outline[0, :2]
    if isinstance(board, Checkerboard):
        s = 1e3 * board.square_m
        squares = (board.columns + 1, board.rows + 1)
        return tuple(_squares(squares, s, 0))
    if isinstance(board, CharucoBoard):
        s = 1e3 * board.square_m
        first = 0 if board.is_dark(0, 0) else 1
        dark = _squares((board.columns, board.rows), s, first)
        inset, size = 0.5e3 * (board.square_m - board.marker_m), 1e3 * board.marker_m
        markers = (
            shape
            for number, (c, r) in enumerate(board.marker_squares.tolist())
            for shape in marker_shapes(board.dictionary, number, c * s + inset, r * s + inset, size)
        )
        return (*dark, *markers)
    if isinstance(board, CircleGrid):
        radius = 0.5e3 * board.diameter_m
        return tuple(Disc(1e3 * (x - left), 1e3 * (y - top), radius) for x, y, _ in board.points.tolist())
    if isinstance(board, MarkerBoard):
        return tuple(
            shape
            for number, corners in zip(board.ids.tolist(), board.corners, strict=True)
            for shape in marker_shapes(
                board.dictionary, number, 1e3 * (corners[0, 0] - left), 1e3 * (corners[0, 1] - top),
                1e3 * float(np.linalg.norm(corners[1] - corners[0])),
            )
        )  # fmt: skip
    raise ModelError(f"a {board.kind} board cannot be drawn")


def _squares(shape: tuple[int, int], side: float, first: int) -> Iterator[Rect]:
    """The squares of a checkerboard of (columns, rows) whose cells add up to `first`, modulo 2."""
    columns, rows = shape
    for row in range(rows):
        for column in range(columns):
            if (column + row) % 2 == first:
                yield Rect(column * side, row * side, side, side)


def marker_shapes(dictionary: str, number: int, x: float, y: float, size: float) -> Iterator[Rect]:
    """A marker whose top left corner is at (x, y): its black cells, row by row, as long as they go."""
    from vision3d.render.patterns import marker_bits

    bits = ~marker_bits(dictionary, number)
    cell = size / len(bits)
    for row, line in enumerate(bits):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], line, [False]]).astype(np.int8)))
        for begin, end in edges.reshape(-1, 2).tolist():
            yield Rect(x + begin * cell, y + row * cell, (end - begin) * cell, cell)
