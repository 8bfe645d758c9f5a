"""The checkerboard: its points are the inner corners, where four squares meet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, final

import numpy as np

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

__all__ = ["Checkerboard"]


@final
@dataclass(frozen=True)
class Checkerboard(Board):
    """Columns by rows of inner corners, as OpenCV counts them: a 9x6 board has 10 by 7 squares.

    Corner 0 is the origin, and the square above and to the left of it, (-1, -1) to (0, 0), is dark.

    Parameters
    ----------
    columns, rows : inner corners along x and along y, at least 2 each
    square_m : side of a square in metres
    """

    columns: int
    rows: int
    square_m: float
    kind: ClassVar[str] = "checkerboard"

    def __post_init__(self) -> None:
        whole("columns of inner corners", self.columns, 2)
        whole("rows of inner corners", self.rows, 2)
        positive("square", self.square_m)

    @property
    def name(self) -> str:
        """Size and squares: `9x6 checkerboard, 25 mm squares`."""
        return f"{self.columns}x{self.rows} checkerboard, {millimetres(self.square_m)} squares"

    @property
    def shape(self) -> tuple[int, int]:
        """Inner corners along x and along y."""
        return self.columns, self.rows

    @property
    def pitch_m(self) -> float:
        """Side of a square."""
        return self.square_m

    @cached_property
    def points(self) -> Array:
        """Inner corners row by row, (columns * rows, 3) m."""
        return lattice_points(np.arange(self.columns) * self.square_m, np.arange(self.rows) * self.square_m)

    @cached_property
    def outline(self) -> Array:
        """The outer edge of the squares, (4, 3) m."""
        s = self.square_m
        return rectangle(-s, -s, self.columns * s, self.rows * s)

    @cached_property
    def half_turn(self) -> Integers | None:
        """All ids backwards where opposite corner squares have one colour: columns + rows even."""
        if (self.columns + self.rows) % 2:
            return None
        return frozen(np.arange(self.columns * self.rows, dtype=np.int64)[::-1].copy())
