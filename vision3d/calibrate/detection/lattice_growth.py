"""Lattices grown over candidate points: each next point is predicted from those before it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Agrees", "Cell", "Grid", "grid_of_cells", "grow", "near"]

Array = NDArray[np.float64]
Cell = tuple[int, int]
Agrees = Callable[[int, Cell, dict[Cell, int]], bool]

CATCH = 0.25
"""How far from its prediction a point is looked for, in spacings."""
STEPS: tuple[Cell, ...] = ((1, 0), (0, 1), (-1, 0), (0, -1))


@dataclass(frozen=True, slots=True)
class Grid:
    """Corners on a lattice: pixels (N, 2), cells (N, 2) column and row counted from 0."""

    pixels: Array
    cells: NDArray[np.int64]

    @property
    def shape(self) -> tuple[int, int]:
        """Columns and rows that the corners span."""
        columns, rows = self.cells.max(axis=0) + 1
        return int(columns), int(rows)

    @property
    def whole(self) -> bool:
        """Whether no place is empty."""
        columns, rows = self.shape
        return len(self.cells) == columns * rows

    def trimmed(self, least: float = 0.5) -> Grid:
        """The grid without the rows and columns at its rim of which less than a share is there."""
        cells, pixels = self.cells, self.pixels
        while len(cells):
            low, high = cells.min(axis=0), cells.max(axis=0)
            ends = [(axis, int(end)) for axis in (0, 1) for end in (low[axis], high[axis])]
            shares = [
                np.sum(cells[:, axis] == end) / (high[1 - axis] - low[1 - axis] + 1.0) for axis, end in ends
            ]
            worst = int(np.argmin(shares))
            if shares[worst] >= least:
                break
            axis, end = ends[worst]
            keep = cells[:, axis] != end
            cells, pixels = cells[keep], pixels[keep]
        return Grid(pixels, cells - cells.min(axis=0)) if len(cells) else self


def grow(pixels: Array, cells: dict[Cell, int], free: NDArray[np.bool_], agrees: Agrees) -> dict[Cell, int]:
    """Grow a lattice in place, and give it back.

    Parameters
    ----------
    pixels : (N, 2) candidates
    cells : the lattice so far, cell to candidate; at least two neighbours
    free : (N,) candidates that may be taken
    agrees : whether a candidate may stand at a cell, given the lattice
    """
    taken = set(cells.values())
    refused: dict[Cell, int] = {}
    growing = True
    while growing:
        growing = False
        rim = {(i + a, j + b) for i, j in cells for a, b in STEPS} - cells.keys()
        for cell in sorted(rim, key=lambda one: (abs(one[0]) + abs(one[1]), one)):
            around = len(near(cells, cell))
            if refused.get(cell) == around:
                continue
            guess = _predict(pixels, cells, cell)
            hit = -1 if guess is None else _catch(pixels, guess[0], guess[1], free, taken)
            if hit >= 0 and agrees(hit, cell, cells):
                cells[cell] = hit
                taken.add(hit)
                growing = True
            else:
                refused[cell] = around
    return cells


def grid_of_cells(pixels: Array, cells: dict[Cell, int]) -> Grid:
    """The grid of a lattice, its cells counted from 0."""
    places = np.array(list(cells), dtype=np.int64)
    return Grid(pixels[list(cells.values())], places - places.min(axis=0))


def near(cells: dict[Cell, int], cell: Cell) -> list[Cell]:
    """Known cells within two steps."""
    i, j = cell
    return [(i + a, j + b) for a in range(-2, 3) for b in range(-2, 3) if (i + a, j + b) in cells]


def _predict(at: Array, cells: dict[Cell, int], cell: Cell) -> tuple[Array, float] | None:
    """Where a cell should be by its neighbours, and the spacing there; None where they say nothing."""
    i, j = cell
    guesses, spacings = [], []
    for a, b in STEPS:
        one, two, three = (i + a, j + b), (i + 2 * a, j + 2 * b), (i + 3 * a, j + 3 * b)
        if one in cells and two in cells:
            step = at[cells[one]] - at[cells[two]]
            if three in cells:
                before = at[cells[two]] - at[cells[three]]
                step = step * min(max(float(np.linalg.norm(step) / np.linalg.norm(before)), 0.7), 1.4)
            guesses.append(at[cells[one]] + step)
            spacings.append(float(np.linalg.norm(step)))
        for p, q in (((b, a)), ((-b, -a))):
            side, corner = (i + p, j + q), (i + a + p, j + b + q)
            if one in cells and side in cells and corner in cells:
                guesses.append(at[cells[one]] + at[cells[side]] - at[cells[corner]])
                spacings.append(
                    min(
                        float(np.linalg.norm(at[cells[one]] - at[cells[corner]])),
                        float(np.linalg.norm(at[cells[side]] - at[cells[corner]])),
                    )
                )
    if not guesses:
        return None
    return np.median(guesses, axis=0), min(spacings)


def _catch(pixels: Array, guess: Array, spacing: float, free: NDArray[np.bool_], taken: set[int]) -> int:
    """The candidate nearest to a prediction, if it is near enough and nobody's; -1 otherwise."""
    distance = np.linalg.norm(pixels - guess, axis=1)
    distance[~free] = np.inf
    best = int(np.argmin(distance))
    return best if distance[best] <= CATCH * spacing + 0.5 and best not in taken else -1
