"""What a rig makes of its own corners: how far apart rectified rows are, and how large squares are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision3d.stereo.rectification import Rectification
from vision3d.stereo.view_pairs import ViewPair
from vision3d.views import View

__all__ = ["Measured", "measured", "points_of", "row_errors_of"]

Array = NDArray[np.float64]
NEIGHBOUR = 1.001
"""Corners at most this many times the smallest distance of any two on the board are neighbours."""


@dataclass(frozen=True, slots=True)
class Measured:
    """The board measured by a rig.

    Parameters
    ----------
    row_px : root mean square difference of rows over all corners that both cameras saw
    pair_row_px : (V,) the same for every pair; NaN where one camera did not see the board
    side_m : mean distance of neighbouring corners, triangulated
    side_std_m : its scatter over all neighbours
    true_side_m : the distance that the board has
    count : distances
    """

    row_px: float
    pair_row_px: Array
    side_m: float
    side_std_m: float
    true_side_m: float
    count: int


def row_errors_of(pair: Rectification, views: ViewPair, weights: tuple[Array, Array] | None = None) -> Array:
    """Row differences (N,), px, of the corners that both cameras saw; those without weight are left out."""
    left, right = _kept(views, weights)
    return pair.row_errors(left.pixels, right.pixels) if len(left) else np.zeros(0)


def points_of(pair: Rectification, left: View, right: View) -> Array:
    """(N, 3) corners in the rectified left camera's frame, m, from their disparities."""
    a, b = pair.points(left.pixels, right.pixels)
    across = 1 - pair.axis
    # a row of its own in each image: the truth lies between
    a[:, across] = 0.5 * (a[:, across] + b[:, across])
    depth = pair.focal_px * pair.baseline_m / ((a - b)[:, pair.axis] + pair.doffs_px)
    flat = (a - pair.left.intrinsics[2:]) / pair.left.intrinsics[:2]
    points: Array = np.column_stack([flat, np.ones(len(a))]) * depth[:, None]
    return points


def measured(
    pair: Rectification,
    views: Sequence[ViewPair],
    weights: Sequence[tuple[Array, Array] | None] | None = None,
) -> Measured:
    """Rows and sides of squares of every pair of views that both cameras saw.

    Parameters
    ----------
    pair : the rig's rectification
    views : of the board
    weights : of the corners of either view, by pair; those without weight are left out
    """
    squares, sides = [np.full(0, np.nan)] * len(views), [np.zeros(0)]
    true = np.inf
    for v, one in enumerate(views):
        if not one.is_whole:
            continue
        own = None if weights is None else weights[v]
        squares[v] = row_errors_of(pair, one, own) ** 2
        left, right = _kept(one, own)
        if len(left) < 2:
            continue
        apart = np.linalg.norm(left.points[:, None] - left.points[None], axis=2)
        apart[np.tril_indices(len(left))] = np.inf
        true = min(true, float(apart.min()))
        i, j = np.nonzero(apart <= NEIGHBOUR * apart.min())
        points = points_of(pair, left, right)
        sides.append(np.linalg.norm(points[i] - points[j], axis=1))
    whole, length = np.concatenate(squares), np.concatenate(sides)
    rms = np.array([np.sqrt(np.mean(one)) if len(one) else np.nan for one in squares])
    return Measured(
        float(np.sqrt(np.mean(whole))) if len(whole) else float("nan"),
        rms,
        float(length.mean()) if len(length) else float("nan"),
        float(length.std()) if len(length) else float("nan"),
        true,
        len(length),
    )


def _kept(views: ViewPair, weights: tuple[Array, Array] | None) -> tuple[View, View]:
    if weights is None:
        return views.common()
    assert views.left is not None  # noqa: S101 - the caller has looked
    assert views.right is not None  # noqa: S101 - the caller has looked
    return ViewPair(
        views.name, views.left.subset(weights[0] > 0.0), views.right.subset(weights[1] > 0.0)
    ).common()
