"""Which corner is corner 0: grids are turned until they are seen from the front, dark square first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision3d.calibrate.detection.lattice import Array, Ids, turns

__all__ = ["Cells", "dark_first", "laid_out", "parity_sign", "turned_towards"]


@dataclass(frozen=True, slots=True)
class Cells:
    """Points (N, 2) px at cells (N, 2) of a lattice of (columns, rows)."""

    pixels: Array
    cells: Ids
    shape: tuple[int, int]

    @property
    def ids(self) -> Ids:
        """Numbers of the points, row by row."""
        ids: Ids = self.cells @ np.array([1, self.shape[0]], dtype=np.int64)
        return ids

    def quarter_turn(self) -> Cells:
        """The same points on a lattice turned by 90°: the x axis takes the place of the y axis."""
        columns, rows = self.shape
        turned = np.stack([self.cells[:, 1], columns - 1 - self.cells[:, 0]], axis=1)
        return Cells(self.pixels, turned, (rows, columns))

    def half_turn(self) -> Cells:
        """The same points on a lattice turned by 180°."""
        return Cells(self.pixels, np.array(self.shape) - 1 - self.cells, self.shape)

    def flipped(self) -> Cells:
        """The same points with the columns counted from the other side."""
        flipped = self.cells.copy()
        flipped[:, 0] = self.shape[0] - 1 - flipped[:, 0]
        return Cells(self.pixels, flipped, self.shape)


def laid_out(found: Cells, shape: tuple[int, int]) -> tuple[Cells, ...]:
    """Every way to lay the points on a lattice of this shape with its front towards the camera."""
    if turns(found.pixels, found.ids, found.shape) < 0.0:
        found = found.flipped()
    ways = [found, found.half_turn()]
    ways += [way.quarter_turn() for way in ways]
    return tuple(way for way in ways if way.shape == shape)


def parity_sign(cells: Ids, contrast: Array) -> float:
    """1 where the squares at the top left are dark in all corners' opinion, -1 light, 0 undecided.

    `contrast` is that of `Refined`: positive where the quadrants beside the diagonal are light.
    """
    signs = np.sign(contrast) * (1.0 - 2.0 * (cells.sum(axis=1) % 2))
    return float(np.mean(signs))


def dark_first(ways: tuple[Cells, ...], first: Cells, sign: float) -> tuple[tuple[Cells, ...], bool]:
    """Those ways whose top left square is dark, and whether there was one; all ways where there was none.

    Parameters
    ----------
    ways : from `laid_out`
    first : the way in which the colour was seen
    sign : from `parity_sign`, in that way
    """
    dark = tuple(way for way in ways if sign * _colour_change(first, way) > 0.0)
    return (dark, True) if dark else (ways, False)


def _colour_change(a: Cells, b: Cells) -> float:
    """1 where the top left square of b has the colour of that of a, -1 where the other.

    The colour of a square is the parity of its cell; a quarter turn also swaps the pairs of quadrants.
    """
    x = a.cells.sum(axis=1) - b.cells.sum(axis=1)
    turned = _axes_swapped(a, b)
    return float((1 - 2 * (int(x[0]) % 2)) * (-1 if turned else 1))


def _axes_swapped(a: Cells, b: Cells) -> bool:
    """Whether the x axis of a is along the y axis of b."""
    da, db = a.cells - a.cells[0], b.cells - b.cells[0]
    along_x = np.flatnonzero((da[:, 1] == 0) & (da[:, 0] != 0))
    return bool(len(along_x)) and bool(db[along_x[0], 0] == 0)


def turned_towards(ways: tuple[Cells, ...]) -> Cells:
    """The way whose corner 0 is nearest the top left of the image."""

    def score(way: Cells) -> float:
        centred = way.cells - way.cells.mean(axis=0)
        directions = centred.T @ (way.pixels - way.pixels.mean(axis=0))
        return float(np.sum(directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-9)))

    return max(ways, key=score)
