"""The r-th smallest value of any range of a series, for all ranges at once, without sorting each.

A wavelet matrix (Claude and Navarro 2012) holds the ranks of the values, one bit a level.  A query walks down
the levels: it counts the zeros in its range, and goes on with the zeros or the ones.  NumPy takes a level for
all queries together.  Cut into pieces a few windows long, n windows of k samples cost O(n log k).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

__all__ = ["OrderStatistics", "deviations", "medians", "pieces"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
PIECE = 8192  # queries taken together, at least: their tables fit a cache


class OrderStatistics:
    """Any order statistic of any range of x (N,), which holds numbers only, N >= 1."""

    def __init__(self, x: Array) -> None:
        order = np.argsort(x, kind="stable")
        ranks = np.empty(len(x), dtype=np.int32)
        ranks[order] = np.arange(len(x))
        self.ordered = x[order]
        self.levels = []
        for bit in range(max(len(x) - 1, 1).bit_length() - 1, -1, -1):
            ones = (ranks >> bit) & 1 == 1
            zeros = np.zeros(len(x) + 1, dtype=np.int32)
            np.cumsum(~ones, out=zeros[1:])
            self.levels.append(zeros)
            ranks = np.concatenate([ranks[~ones], ranks[ones]])

    def select(self, low: Ints, high: Ints, rank: Ints) -> Array:
        """The value of x[low:high] that has `rank` values below it, (Q,); 0 <= rank < high - low."""
        first, last, left = (np.asarray(v, dtype=np.int32) for v in (low, high, rank))
        found = np.zeros(len(low), dtype=np.int32)
        for zeros in self.levels:
            below, above = zeros[first], zeros[last]
            fewer = above - below
            right = left >= fewer
            left = np.where(right, left - fewer, left)
            first = np.where(right, zeros[-1] + first - below, below)
            last = np.where(right, zeros[-1] + last - above, above)
            found = 2 * found + right
        return np.asarray(self.ordered[found])


def medians(series: OrderStatistics, low: Ints, high: Ints) -> Array:
    """Medians (Q,) of x[low:high], the mean of the middle two where they are two; NaN of nothing."""
    return _middle(low, high, lambda rows, rank: series.select(low[rows], high[rows], rank))


def deviations(series: OrderStatistics, low: Ints, high: Ints, centre: Array) -> Array:
    """Medians (Q,) of |x[low:high] - centre|, for centres inside the range of the values; NaN of nothing."""

    def nearest(rows: Ints, rank: Ints) -> Array:
        """The deviation that has `rank` smaller ones.

        The rank + 1 values nearest to the centre stand side by side in order of size: of all such runs,
        theirs has the smallest larger end.  As the run's start moves up, one end's deviation shrinks and the
        other's grows; bisection finds where they cross.
        """
        first, last, c = low[rows], high[rows], centre[rows]
        below, above = np.zeros(len(rows), dtype=np.int64), last - first - 1 - rank
        while (below < above).any():
            middle = (below + above) // 2
            left = c - series.select(first, last, middle)
            right = series.select(first, last, middle + rank) - c
            crossed = right >= left
            above = np.where(crossed, middle, above)
            below = np.where(crossed, below, np.minimum(middle + 1, above))
        best = _larger_end(series, first, last, below, rank, c)
        before = _larger_end(series, first, last, np.maximum(below - 1, 0), rank, c)
        return np.minimum(best, before)

    return _middle(low, high, nearest)


def _larger_end(
    series: OrderStatistics, low: Ints, high: Ints, start: Ints, rank: Ints, centre: Array
) -> Array:
    """Largest deviation in the run of rank + 1 ordered values that begins at `start`."""
    left, right = series.select(low, high, start), series.select(low, high, start + rank)
    return np.maximum(np.abs(left - centre), np.abs(right - centre))


def _middle(low: Ints, high: Ints, value: Callable[[Ints, Ints], Array]) -> Array:
    """Mean of the two middle values of each range, by a function of rows and ranks."""
    count = high - low
    rows = np.flatnonzero(count > 0)
    out = np.full(len(low), np.nan)
    out[rows] = value(rows, (count[rows] - 1) // 2)
    even = rows[count[rows] % 2 == 0]
    out[even] = 0.5 * (out[even] + value(even, count[even] // 2))
    return out


def pieces(x: Array, low: Ints, high: Ints) -> Iterator[tuple[slice, OrderStatistics, Ints, Ints]]:
    """Cut ascending ranges of x (N,) into pieces: rows, their numbers (no NaN), and their ranges in them."""
    known = ~np.isnan(x)
    so_far = np.concatenate([[0], np.cumsum(known)])
    values, low, high = x[known], so_far[low], so_far[high]
    longest = int((high - low).max(initial=0))
    length = max(PIECE, 4 * longest)
    for first in range(0, len(low), length):
        rows = slice(first, min(first + length, len(low)))
        base, top = int(low[rows].min()), int(high[rows].max())
        part = values[base:top] if top > base else np.zeros(1)
        yield rows, OrderStatistics(part), low[rows] - base, high[rows] - base
