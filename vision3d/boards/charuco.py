"""The ChArUco board: a checkerboard with a marker in every light square, which says where one looks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, final

import numpy as np

from sequential.errors import ModelError
from vision3d.boards.board import (
    Array,
    Board,
    Integers,
    frozen,
    lattice_points,
    millimetres,
    positive,
    rectangle,
    whole,
)
from vision3d.boards.dictionaries import DICTIONARIES, dictionary_name, opencv_dictionary

__all__ = ["CharucoBoard"]


@final
@dataclass(frozen=True)
class CharucoBoard(Board):
    """Columns by rows of squares, as OpenCV counts them: a 5x7 board has 4 by 6 inner corners.

    The origin is the top left corner of the board, so that corner 0 stands at (square, square).  The
    pattern changed with OpenCV 4.6 for boards with an even number of rows: since then the top left square
    is always dark; the legacy pattern has its bottom left square dark.

    Parameters
    ----------
    columns, rows : squares along x and along y, at least 3 each
    square_m, marker_m : sides of a square and of a marker in metres, marker < square
    dictionary : of the markers, any way of writing it
    legacy : drawn as OpenCV did before 4.6
    """

    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str = "4x4_50"
    legacy: bool = False
    kind: ClassVar[str] = "charuco"

    def __post_init__(self) -> None:
        whole("columns of squares", self.columns, 3)
        whole("rows of squares", self.rows, 3)
        positive("square", self.square_m)
        positive("marker", self.marker_m)
        object.__setattr__(self, "dictionary", dictionary_name(self.dictionary))
        if self.marker_m >= self.square_m:
            raise ModelError(
                f"a marker of {millimetres(self.marker_m)} does not fit into a square of "
                f"{millimetres(self.square_m)}; the marker is the smaller of the two lengths"
            )
        available = DICTIONARIES[self.dictionary].count
        if (wanted := self.columns * self.rows // 2) > available:
            raise ModelError(
                f"a {self.columns}x{self.rows} ChArUco board has {wanted} markers, and {self.dictionary} "
                f"only {available}; take a larger dictionary"
            )

    @property
    def name(self) -> str:
        """Size, squares and markers."""
        pattern = ", legacy pattern" if self.legacy else ""
        return (
            f"{self.columns}x{self.rows} ChArUco board, {millimetres(self.square_m)} squares, "
            f"{millimetres(self.marker_m)} markers of {self.dictionary}{pattern}"
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Inner corners along x and along y: one fewer than squares."""
        return self.columns - 1, self.rows - 1

    @property
    def pitch_m(self) -> float:
        """Side of a square."""
        return self.square_m

    @cached_property
    def points(self) -> Array:
        """Inner corners row by row, ((columns - 1) * (rows - 1), 3) m."""
        s = self.square_m
        return lattice_points(np.arange(1, self.columns) * s, np.arange(1, self.rows) * s)

    @cached_property
    def outline(self) -> Array:
        """The outer edge of the squares, (4, 3) m."""
        return rectangle(0.0, 0.0, self.columns * self.square_m, self.rows * self.square_m)

    def is_dark(self, column: int, row: int) -> bool:
        """Whether a square is dark, and so carries no marker."""
        first = (self.rows + 1) % 2 if self.legacy else 0
        return (column + row) % 2 == first

    @cached_property
    def marker_squares(self) -> Integers:
        """Column and row of the square of marker i, (M, 2); markers count row by row."""
        light = [(c, r) for r in range(self.rows) for c in range(self.columns) if not self.is_dark(c, r)]
        return frozen(np.array(light, dtype=np.int64))

    @cached_property
    def marker_corners(self) -> Array:
        """Corners of every marker from its own top left on, clockwise: (M, 4, 3) m."""
        inset = 0.5 * (self.square_m - self.marker_m)
        step = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * self.marker_m + inset
        corners = np.zeros((len(self.marker_squares), 4, 3))
        corners[..., :2] = self.marker_squares[:, None, :] * self.square_m + step
        corners.flags.writeable = False
        return corners

    def opencv(self) -> Any:
        """The same board as OpenCV's object."""
        import cv2

        board = cv2.aruco.CharucoBoard(
            (self.columns, self.rows), self.square_m, self.marker_m, opencv_dictionary(self.dictionary)
        )
        board.setLegacyPattern(self.legacy)
        return board
