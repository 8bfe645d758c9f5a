"""The sliding median: outliers leave no trace, noise hardly less than the mean lets through."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import final

import numpy as np
from numpy.typing import NDArray

from sequential.signal.order_statistics import medians, pieces
from sequential.signal.response import Response, require_interval
from sequential.signal.window import Windowed, WindowState

__all__ = ["SlidingMedian", "median_of_sorted", "median_sigma"]

Array = NDArray[np.float64]
REACH, NODES = 12.0, 6001  # standard deviations on either side, and nodes between them
EVEN = 100


@final
@dataclass(frozen=True, slots=True)
class SlidingMedian(Windowed):
    """Median of the numbers in a sliding window; parameters as in `Windowed`.

    O(n log k).  A window of an even count gives the mean of its two middle values (`scipy.ndimage` gives the
    larger); NaN is skipped, and a window without any number gives NaN.  Up to (k - 1) // 2 outliers in a
    window cannot move the output beyond the other samples.

    Notes
    -----
    Not linear, so it has no phase delay: a signal that only rises or falls is late by (k - 1)/2 samples (by
    half a sample or none when centred), but a sine of a period below 2k samples is bent, or wiped out.
    """

    def filtered(self, t: Array | None, x: Array) -> Array:
        """Filter the columns of x (N, m)."""
        placed = self.place(x)
        y = np.empty(x.shape)
        for c in range(x.shape[1]):
            for rows, series, low, high in pieces(placed.x[:, c], placed.low, placed.high):
                y[rows, c] = medians(series, low, high)
        return self.settled(y, placed)

    def step(self, state: WindowState, x: float, t: float | None = None) -> tuple[float, WindowState]:
        """Take one sample: the median so far and the next state."""
        after = self.push(state, x)
        return math.nan if self.is_refused(after) else median_of_sorted(after.ordered), after

    def response(self, interval: float | None = None) -> Response:
        """What it does to a step and to noise; times in samples unless the interval is given."""
        step = require_interval(interval, 1.0, "SlidingMedian's response")
        late = self.window // 2 - self.ahead
        return Response(late * step, median_sigma(self.window), self.ahead * step)


def median_of_sorted(ordered: Sequence[float]) -> float:
    """Median of one number or more, in order of size."""
    half = len(ordered) // 2
    return ordered[half] if len(ordered) % 2 else 0.5 * (ordered[half - 1] + ordered[half])


@lru_cache(maxsize=64)
def median_sigma(k: int) -> float:
    """Standard deviation of the median of k standard normals; towards sqrt(π / 2k) for many.

    The densities of one and of two neighbouring order statistics (David and Nagaraja 2003, Order statistics,
    eqs. 2.1.6 and 2.2.1), integrated by the trapezoidal rule.
    """
    from scipy.special import gammaln, log_ndtr

    if k % 2 == 0 and k > EVEN:
        k += 1  # to one part in 5000 the same, and neighbours stand too close for the nodes
    z = np.linspace(-REACH, REACH, NODES) * min(1.0, math.sqrt(30.0 / k))
    width = z[1] - z[0]
    normal = -0.5 * z**2 - 0.5 * math.log(2.0 * math.pi)
    half = (k - 1) // 2
    if k % 2:
        weight = gammaln(k + 1) - 2 * gammaln(half + 1)
        density = np.exp(weight + half * (log_ndtr(z) + log_ndtr(-z)) + normal)
        return float(math.sqrt(np.sum(z**2 * density) * width))
    weight = 0.5 * (gammaln(k + 1) - 2 * gammaln(half + 1))
    lower = np.exp(weight + half * log_ndtr(z) + normal)  # the k/2-th, and by symmetry the next one above it
    upper = np.exp(weight + half * log_ndtr(-z) + normal)
    sums = [np.cumsum(z**power * lower) - 0.5 * z**power * lower for power in range(3)]
    square = 0.25 * (sums[2] + 2.0 * z * sums[1] + z**2 * sums[0])
    return float(math.sqrt(np.sum(upper * square) * width**2))
