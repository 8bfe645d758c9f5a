"""Neighbours on a board as one image shows them: spacing, directions of the edges, and how they bend."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Ids", "edge_bends", "grid_of", "lattice_axes", "spacing_px", "turns"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


def grid_of(pixels: Array, ids: Ids, shape: tuple[int, int]) -> Array:
    """Points (N, 2) at their places on the lattice: (rows, columns, 2), NaN where none was seen."""
    columns, rows = shape
    grid = np.full((rows * columns, 2), np.nan)
    grid[ids] = pixels
    return grid.reshape(rows, columns, 2)


def lattice_axes(pixels: Array, ids: Ids, shape: tuple[int, int]) -> Array:
    """Vectors in px from each point to its neighbours along x and along y, (N, 2, 2).

    Central differences where both neighbours were seen, one-sided where one was; a point without neighbours
    in a direction gets the median of the others.
    """
    grid = grid_of(pixels, ids, shape)
    axes = np.stack([_difference(grid, 1), _difference(grid, 0)], axis=2).reshape(-1, 2, 2)[ids]
    for direction in range(2):
        lacking = ~np.isfinite(axes[:, direction]).all(axis=1)
        if lacking.any():
            known = axes[~lacking, direction]
            other = axes[:, 1 - direction]
            turned = np.stack([-other[:, 1], other[:, 0]], axis=1) * (-1.0 if direction == 0 else 1.0)
            fallback = np.median(known, axis=0) if len(known) else np.nan_to_num(turned[lacking], nan=10.0)
            axes[lacking, direction] = fallback
    return np.ascontiguousarray(axes)


def _difference(grid: Array, axis: int) -> Array:
    """Half the difference of the two neighbours, or the difference to the only one."""
    g = np.moveaxis(grid, axis, 0)
    ahead, behind = np.full_like(g, np.nan), np.full_like(g, np.nan)
    ahead[:-1] = g[1:] - g[:-1]
    behind[1:] = g[1:] - g[:-1]
    both = 0.5 * (ahead + behind)
    best = np.where(np.isfinite(both), both, np.where(np.isfinite(ahead), ahead, behind))
    return np.moveaxis(best, 0, axis)


def edge_bends(pixels: Array, ids: Ids, shape: tuple[int, int]) -> Array:
    """Curvature in 1/px of the edges through each point along x and along y, (N, 2).

    The sign is that of `fit_saddles`: positive where the edge bends against its normal, the direction of the
    edge turned by 90° from x to y.  At the rim the neighbour's bend stands for the point's own; where nothing
    is known it is zero.
    """
    grid = grid_of(pixels, ids, shape)
    found = np.stack([_bend(grid, 1), _bend(grid, 0)], axis=2).reshape(-1, 2)[ids]
    return np.ascontiguousarray(np.nan_to_num(found))


def _bend(grid: Array, axis: int) -> Array:
    g = np.moveaxis(grid, axis, 0)
    first = np.moveaxis(_difference(grid, axis), axis, 0)
    second = np.full_like(g, np.nan)
    second[1:-1] = g[2:] - 2.0 * g[1:-1] + g[:-2]
    length = np.linalg.norm(first, axis=-1)
    normal = np.stack([-first[..., 1], first[..., 0]], axis=-1) / length[..., None]
    bend = -np.sum(second * normal, axis=-1) / length**2
    for rim, inner in ((0, 1), (-1, -2)):
        if len(bend) > 2:
            bend[rim] = np.where(np.isfinite(bend[rim]), bend[rim], bend[inner])
    return np.moveaxis(bend, 0, axis)


def spacing_px(pixels: Array) -> Array:
    """Distance in px from each point to its nearest neighbour, (N,)."""
    offsets = pixels[:, None, :] - pixels[None, :, :]
    squared = np.sum(offsets**2, axis=-1)
    np.fill_diagonal(squared, np.inf)
    nearest: Array = np.sqrt(squared.min(axis=1))
    return nearest


def turns(pixels: Array, ids: Ids, shape: tuple[int, int]) -> float:
    """Mean sign of x cross y over the lattice: 1 where the board is seen from its front, -1 mirrored."""
    axes = lattice_axes(pixels, ids, shape)
    cross = axes[:, 0, 0] * axes[:, 1, 1] - axes[:, 0, 1] * axes[:, 1, 0]
    return float(np.mean(np.sign(cross)))
