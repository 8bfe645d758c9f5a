"""Grids of circles, symmetric and asymmetric."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, final

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

__all__ = ["CircleGrid"]

DIAMETER = 0.5
"""Diameter of a circle in spacings of the symmetric grid, where none is given."""


@final
@dataclass(frozen=True)
class CircleGrid(Board):
    """Columns by rows of circles; the points are their centres.

    The asymmetric grid is OpenCV's: a row has `columns` circles at twice the spacing, every second row is
    moved by one spacing, and rows are one spacing apart, so that neighbours lie on diagonals.

    Parameters
    ----------
    columns, rows : circles in a row, and rows; at least 2 each
    spacing_m : between neighbours of the symmetric grid; between rows of the asymmetric one
    asymmetric : every second row is moved
    diameter_m : of a circle; by default half the spacing (asymmetric: 0.7 of it)
    """

    columns: int
    rows: int
    spacing_m: float
    asymmetric: bool = False
    diameter_m: float = 0.0
    kind: ClassVar[str] = "circles"

    def __post_init__(self) -> None:
        whole("columns of circles", self.columns, 2)
        whole("rows of circles", self.rows, 2)
        positive("spacing", self.spacing_m)
        if self.diameter_m == 0.0:
            share = 0.7 if self.asymmetric else DIAMETER
            object.__setattr__(self, "diameter_m", share * self.spacing_m)
        positive("diameter", self.diameter_m)
        if self.diameter_m >= self.pitch_m:
            raise ModelError(
                f"circles of {millimetres(self.diameter_m)} touch: their centres are "
                f"{millimetres(self.pitch_m)} apart; take smaller circles or a wider spacing"
            )

    @property
    def name(self) -> str:
        """Size and spacing: `4x11 asymmetric circle grid, 20 mm spacing`."""
        word = "asymmetric circle grid" if self.asymmetric else "circle grid"
        return f"{self.columns}x{self.rows} {word}, {millimetres(self.spacing_m)} spacing"

    @property
    def shape(self) -> tuple[int, int]:
        """Circles in a row, and rows."""
        return self.columns, self.rows

    @property
    def pitch_m(self) -> float:
        """Distance between neighbouring centres."""
        return self.spacing_m * (float(np.sqrt(2.0)) if self.asymmetric else 1.0)

    @cached_property
    def points(self) -> Array:
        """Centres row by row, (columns * rows, 3) m."""
        s, columns = self.spacing_m, np.arange(self.columns)
        y = np.arange(self.rows) * s
        if not self.asymmetric:
            return lattice_points(columns * s, y)
        points = np.array(lattice_points(2.0 * s * columns, y)).reshape(self.rows, self.columns, 3)
        points[1::2, :, 0] += s
        points.flags.writeable = False
        return points.reshape(-1, 3)

    @cached_property
    def outline(self) -> Array:
        """A rectangle half a spacing outside the outermost centres, (4, 3) m."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        margin = 0.5 * self.spacing_m + 0.5 * max(0.0, self.diameter_m - self.spacing_m)
        return rectangle(low[0] - margin, low[1] - margin, high[0] + margin, high[1] + margin)

    @cached_property
    def half_turn(self) -> Integers | None:
        """All ids backwards, but for an asymmetric grid with an odd number of rows, which shows its side."""
        if self.asymmetric and self.rows % 2:
            return None
        return frozen(np.arange(self.columns * self.rows, dtype=np.int64)[::-1].copy())
