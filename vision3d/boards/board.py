"""What every board is: numbered points whose places on it are known."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError

__all__ = ["Array", "Board", "lattice_points", "millimetres", "positive", "whole"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Board(ABC):
    """A flat target in its own frame: x along the columns, y along the rows, z into the board; metres.

    Attributes
    ----------
    kind : the word for it on the command line
    name : what it is, with its size, for people
    points : (N, 3) the numbered points, read-only; point i has the id i
    count : N
    shape : (columns, rows) of the lattice that the points form; (0, 0) where they form none
    pitch_m : distance between neighbouring points of the lattice
    outline : (4, 3) the corners of the printed pattern, clockwise as it is looked at from the top left
    half_turn : (N,) which id each point gets when the board is turned by 180° and looks the same; None
        where it does not look the same
    """

    kind: ClassVar[str]

    @property
    @abstractmethod
    def name(self) -> str:
        """What it is, with its size, for people."""

    @cached_property
    @abstractmethod
    def points(self) -> Array:
        """The numbered points, (N, 3) m."""

    @property
    @abstractmethod
    def shape(self) -> tuple[int, int]:
        """Columns and rows of the lattice of points; (0, 0) without one."""

    @property
    @abstractmethod
    def pitch_m(self) -> float:
        """Distance between neighbouring points."""

    @cached_property
    @abstractmethod
    def outline(self) -> Array:
        """Corners of the printed pattern, (4, 3) m."""

    @property
    def count(self) -> int:
        """How many points the board has."""
        return len(self.points)

    @cached_property
    def lattice(self) -> Integers:
        """Column and row of every point, (N, 2)."""
        columns, rows = self.shape
        table = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
        return frozen(table.astype(np.int64))

    @cached_property
    def half_turn(self) -> Integers | None:
        """Ids after a turn by 180° that leaves the board as it was, (N,); None where none does."""
        return None


def frozen(array: NDArray[np.int64]) -> Integers:
    """Give the array, made read-only."""
    array.flags.writeable = False
    return array


def lattice_points(x_m: NDArray[Any], y_m: NDArray[Any]) -> Array:
    """Put points at every pair of the coordinates, row by row, z = 0: (len(y) * len(x), 3), read-only."""
    points = np.zeros((len(y_m), len(x_m), 3))
    points[..., 0], points[..., 1] = x_m[None, :], y_m[:, None]
    points.flags.writeable = False
    return points.reshape(-1, 3)


def rectangle(left_m: float, top_m: float, right_m: float, bottom_m: float) -> Array:
    """Corners of an upright rectangle from its top left on, clockwise: (4, 3), read-only."""
    corners = np.array(
        [[left_m, top_m, 0.0], [right_m, top_m, 0.0], [right_m, bottom_m, 0.0], [left_m, bottom_m, 0.0]]
    )
    corners.flags.writeable = False
    return corners


def whole(what: str, value: object, least: int) -> None:
    """Raise ModelError unless the value is a whole number, at least `least`."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
        raise ModelError(f"a board's {what} is a whole number, at least {least}; got {value!r}")


def positive(what: str, value_m: float) -> None:
    """Raise ModelError unless the length is a positive number of metres."""
    if not np.isfinite(value_m) or value_m <= 0.0:
        raise ModelError(f"a board's {what} is a positive length in metres, got {value_m!r}")


def millimetres(length_m: float) -> str:
    """Write a length for people: 25 mm, 2.5 mm."""
    return f"{length_m * 1e3:.6g} mm"
