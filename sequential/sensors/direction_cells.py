"""The sphere in 24 cells of equal area: where readings lie, and how even a norm is over directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["BANDS", "CELLS", "SECTORS", "CellMeans", "cell_means", "cell_of", "cell_words"]

Array = NDArray[np.float64]
BANDS, SECTORS = 4, 6  # in z, of equal height and so of equal area (Archimedes), and in azimuth
CELLS = BANDS * SECTORS


def cell_of(vectors: Array) -> NDArray[np.int64]:
    """Cell 0..23 of each vector (N, 3): band from the lowest z upwards, then azimuth from -180° on."""
    unit = vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)[:, None]
    band = np.clip(((unit[:, 2] + 1) / 2 * BANDS).astype(np.int64), 0, BANDS - 1)
    turn = (np.arctan2(unit[:, 1], unit[:, 0]) + np.pi) / (2 * np.pi)
    return np.asarray(band * SECTORS + np.clip((turn * SECTORS).astype(np.int64), 0, SECTORS - 1))


def cell_words(cell: int) -> str:
    """Name a cell by the ranges of its directions."""
    band, sector = divmod(cell, SECTORS)
    low, high = (np.degrees(np.arcsin(-1 + 2 * k / BANDS)) for k in (band, band + 1))
    return f"elevation {low:.0f}° to {high:.0f}°, azimuth {-180 + 60 * sector}° to {-120 + 60 * sector}°"


@dataclass(frozen=True, slots=True, eq=False)
class CellMeans:
    """Mean norm (24,) of each cell, NaN where it holds fewer than `fewest` readings, and counts (24,)."""

    mean: Array
    count: NDArray[np.int64]
    fewest: int

    @property
    def spread(self) -> float:
        """Standard deviation over mean of the filled cells' means, each cell with equal weight."""
        filled = self.mean[np.isfinite(self.mean)]
        return float(filled.std() / filled.mean()) if len(filled) > 1 else float("nan")

    @property
    def covered(self) -> int:
        """How many cells are filled."""
        return int(np.isfinite(self.mean).sum())


def cell_means(vectors: Array, norms: Array | None = None, fewest: int = 20) -> CellMeans:
    """Mean norm over the directions.

    Parameters
    ----------
    vectors : (N, 3) calibrated readings, whose directions decide about the cell
    norms : (N,) what is averaged; None: the vectors' own norms
    fewest : readings of a cell that is counted
    """
    values = np.linalg.norm(vectors, axis=1) if norms is None else norms
    cells = cell_of(vectors)
    count = np.bincount(cells, minlength=CELLS)
    total = np.bincount(cells, weights=values, minlength=CELLS)
    mean = np.where(count >= fewest, total / np.maximum(count, 1), np.nan)
    return CellMeans(mean, count, fewest)
