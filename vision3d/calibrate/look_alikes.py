"""Views that show the board where another shows it: frames of a video, a board that was not moved.

Their corners err alike, so they are no new evidence: where views are counted or left out, such a group is
one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vision3d.views import View

__all__ = ["folds_of", "groups_of"]

ALIKE = 0.02
"""Root mean square distance of corners, as a share of the image's diagonal, under which views are alike."""

FEWEST_GROUPS = 4


def groups_of(views: Sequence[View]) -> NDArray[np.int64]:
    """Number of the group of every view, (V,); groups are numbered in the order of their first views."""
    distance = _distances(views)
    reach = ALIKE * float(np.hypot(*views[0].size))
    leaders: list[int] = []
    groups = np.empty(len(views), dtype=np.int64)
    for v in range(len(views)):
        alike = [g for g, leader in enumerate(leaders) if distance[v, leader] < reach]
        if alike:
            groups[v] = alike[0]
        else:
            groups[v] = len(leaders)
            leaders.append(v)
    return groups


def folds_of(views: Sequence[View], most: int | None = None) -> list[list[int]]:
    """Views to leave out together: each group, or as many at a time as make at most `most` folds.

    Where there are too few groups to leave one out, every view is a fold of its own.
    """
    groups = groups_of(views)
    count = int(groups.max()) + 1
    if count < FEWEST_GROUPS:
        groups, count = np.arange(len(views)), len(views)
    parts = np.array_split(np.arange(count), min(count, most or count))
    return [np.flatnonzero(np.isin(groups, part)).tolist() for part in parts]


def _distances(views: Sequence[View]) -> NDArray[np.float64]:
    """Root mean square distance of the corners that two views share, (V, V); infinite where none."""
    count = 1 + max(int(view.ids.max()) for view in views)
    seen, at = np.zeros((len(views), count)), np.zeros((len(views), count, 2))
    for v, view in enumerate(views):
        seen[v, view.ids] = 1.0
        at[v, view.ids] = view.pixels - 0.5 * np.array(view.size)
    squares = np.sum(at**2, axis=2)
    flat = at.reshape(len(views), -1)
    # Σ (a - b)² over shared corners, by three products of matrices
    total = squares @ seen.T + seen @ squares.T - 2.0 * flat @ flat.T
    shared = seen @ seen.T
    with np.errstate(divide="ignore", invalid="ignore"):
        distances: NDArray[np.float64] = np.sqrt(np.maximum(total, 0.0) / shared)
    return np.where(shared > 0.0, distances, np.inf)
