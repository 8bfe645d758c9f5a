"""Features over the whole image instead of a heap on its most textured corner."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ShapeError

__all__ = ["spread_levels", "spread_rows"]

SURE = 0.5  # share that the strongest have, wherever they are
PER_CELL = 20  # features a cell would hold if all cells had as many


def spread_rows(
    pixels: ArrayLike, response: ArrayLike, size: tuple[int, int], count: int
) -> NDArray[np.int64]:
    """Choose half by strength, and half cell by cell: the best of every cell, then the second best.

    Parameters
    ----------
    pixels : (N, 2) px
    response : (N,) strength; larger is better
    size : (width, height) of the image, px
    count : how many to keep

    Returns
    -------
    NDArray[np.int64]
        (min(N, count),) rows, strongest first.
    """
    at, strong = np.asarray(pixels, dtype=np.float64), np.asarray(response, dtype=np.float64)
    if at.ndim != 2 or at.shape[1] != 2 or strong.shape != (len(at),):
        raise ShapeError(f"expected pixels (N, 2) with a response each, got {at.shape} and {strong.shape}")
    order = np.argsort(-strong, kind="stable")
    if len(at) <= count:
        return order
    side = math.sqrt(size[0] * size[1] / max(1.0, count / PER_CELL))
    columns = math.ceil(size[0] / side)
    cell = (at[:, 1] // side).astype(np.int64) * columns + (at[:, 0] // side).astype(np.int64)
    grouped = order[np.argsort(cell[order], kind="stable")]  # cell by cell, strongest first within each
    starts = np.flatnonzero(np.r_[True, np.diff(cell[grouped]) != 0])
    turn = np.arange(len(grouped)) - np.repeat(starts, np.diff(np.r_[starts, len(grouped)]))
    # the strongest are those found again most often
    turn[np.isin(grouped, order[: round(SURE * count)])] = -1
    chosen = grouped[np.lexsort((-strong[grouped], turn))[:count]]
    return np.asarray(chosen[np.argsort(-strong[chosen], kind="stable")], dtype=np.int64)


def spread_levels(
    pixels: ArrayLike, response: ArrayLike, scale: ArrayLike, size: tuple[int, int], count: int
) -> NDArray[np.int64]:
    """The same level by level of a pyramid, each with a share of the features that falls as its side does.

    Scores of different levels cannot be compared; what one level lacks goes to the next finer one.

    Parameters
    ----------
    scale : (N,) how many pixels of the image one of the feature's level is
    """
    at, strong = np.asarray(pixels, dtype=np.float64), np.asarray(response, dtype=np.float64)
    steps = np.asarray(scale, dtype=np.float64)
    levels = np.unique(steps)[::-1]
    chosen: list[NDArray[np.int64]] = []
    left = count
    for k, level in enumerate(levels):
        rows = np.flatnonzero(steps == level)
        quota = math.ceil(left * (1.0 / level) / float((1.0 / levels[k:]).sum()))
        some = rows[spread_rows(at[rows], strong[rows], size, quota)]
        chosen.append(some)
        left -= len(some)
    every = np.concatenate([np.empty(0, np.int64), *chosen])
    return np.asarray(every[np.argsort(-strong[every], kind="stable")], dtype=np.int64)
