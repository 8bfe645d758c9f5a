"""The edges of a stripe at a fraction of a pixel: where brightness is half-way between both sides of an edge.

A threshold on the difference from the ground puts an edge wrong where the ground is not known well; the
levels just inside and just outside of it are always at hand.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vision3d.lines.stripes import Stripe

__all__ = ["sharpened"]

Array = NDArray[np.float64]
REACH = 4.0  # px from the edge, at which a side's own level is taken; less in a narrow stripe
ROUNDS = 2
KEPT = 0.5  # of the rows, that must show both edges
FARTHEST = 2.5  # px that an edge may move


def sharpened(small: NDArray[np.uint8], stripe: Stripe) -> Stripe:
    """The stripe with edges that do not depend on a threshold; rows in which that fails are left out."""
    import cv2

    smooth = cv2.GaussianBlur(small.astype(np.float32), (7, 1), 1.0).astype(np.float64)
    y = np.flatnonzero(np.isfinite(stripe.left) & ~stripe.cut_off)
    left, right = stripe.left.copy(), stripe.right.copy()
    reach = np.clip((right[y] - left[y]) / 3.0, 1.5, REACH)
    for edges, outward in ((left, -1.0), (right, 1.0)):
        moved = edges[y]
        for _ in range(ROUNDS):
            moved = _half_way(smooth, y, moved, outward * reach)
        moved[np.abs(moved - edges[y]) > FARTHEST] = np.nan
        edges[y] = moved
    if not np.isfinite(left[y] + right[y]).sum() > KEPT * len(y):
        return stripe  # no edge stands where the threshold saw one: a faint stripe on a rough ground
    lost = np.isnan(left) | np.isnan(right)
    left[lost] = right[lost] = np.nan
    return replace(stripe, left=left, right=right)


def _half_way(smooth: Array, y: NDArray[np.int64], edge: Array, reach: Array) -> Array:
    """Where each row passes half-way between the levels at `reach` inside and outside of an edge."""
    steps = np.linspace(-1.0, 1.0, 9)
    profile = _at(smooth, y[:, None], edge[:, None] + reach[:, None] * steps)
    half = 0.5 * (profile[:, :2].mean(axis=1) + profile[:, -2:].mean(axis=1))
    rise = (profile[:, -1] - profile[:, 0])[:, None]
    above = (profile - half[:, None]) * np.sign(rise)
    crosses = (above[:, :-1] < 0) & (above[:, 1:] >= 0)
    middle = 0.5 * (steps[:-1] + steps[1:])
    nearest = np.argmin(np.where(crosses, np.abs(middle), np.inf), axis=1)
    rows = np.arange(len(y))
    low, high = above[rows, nearest], above[rows, nearest + 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = steps[nearest] - low / (high - low) * (steps[1] - steps[0])
    found = edge + reach * share
    found[~crosses.any(axis=1)] = np.nan
    return np.asarray(found)


def _at(smooth: Array, rows: NDArray[np.int64], x: Array) -> Array:
    """Linear interpolation along rows; NaN outside of the image."""
    first = np.floor(np.nan_to_num(x, nan=-9.0)).astype(np.int64)
    inside = (first >= 0) & (first + 1 < smooth.shape[1])
    safe = np.clip(first, 0, smooth.shape[1] - 2)
    share = x - first
    values = (1.0 - share) * smooth[rows, safe] + share * smooth[rows, safe + 1]
    return np.where(inside, values, np.nan)
