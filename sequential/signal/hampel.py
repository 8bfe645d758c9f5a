"""Hampel's identifier: a sample far from the local median, in units of the local spread, is an outlier."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from sequential.signal.order_statistics import deviations, medians, pieces
from sequential.signal.response import Response, measure_noise_gain, require_interval
from sequential.signal.samples import read_samples
from sequential.signal.sliding_median import median_of_sorted
from sequential.signal.window import Windowed, WindowState

__all__ = ["SIGMA_PER_MAD", "Hampel", "LocalSpread"]

Array = NDArray[np.float64]
SIGMA_PER_MAD = 1.482602218505602  # 1 / Φ⁻¹(3/4): the MAD of Gaussian noise is 0.6745 σ


class LocalSpread(NamedTuple):
    """What each sample is held against; shapes as the signal's."""

    median: Array
    sigma: Array  # 1.4826 times the median absolute deviation from that median, or the floor
    outlier: NDArray[np.bool_]


@final
@dataclass(frozen=True, slots=True)
class Hampel(Windowed):
    """Replace outliers by the local median, and leave every other sample as it is.

    A sample is an outlier where |x - median| > threshold · σ, with the median and σ = 1.4826 · MAD of its own
    window: one burst far away does not widen the gate here, as a global MAD would.  O(n log² k).

    Parameters
    ----------
    window, centred, edges : as in `Windowed`
    threshold : in standard deviations; 3 rejects 0.3 % of Gaussian noise, and more in a short window,
        whose σ is uncertain
    floor : the least σ that is believed, in the signal's unit: the resolution of a sensor that rounds

    Notes
    -----
    Where more than half of a window is one and the same value, its MAD is zero.  Then, with `floor=0`, every
    sample that differs from that value is an outlier: a spike on a constant is found, and a constant has
    none.  On a sensor that rounds, that would reject steps of one bit: give its resolution as the floor.
    Causal (centred=False), a true step is rejected until it fills half of the window; so is the beginning of
    a ramp steeper than the threshold.  NaN is neither judged nor replaced.
    Hampel 1974, The influence curve and its role in robust estimation; Davies and Gather 1993.
    """

    threshold: float = 3.0
    floor: float = 0.0

    def __post_init__(self) -> None:
        Windowed.__post_init__(self)
        if not (0 <= self.threshold < math.inf and 0 <= self.floor < math.inf):
            raise ModelError(
                "Hampel's threshold and floor are finite numbers, zero or more; "
                f"got {self.threshold} and {self.floor}"
            )

    def filtered(self, t: Array | None, x: Array) -> Array:
        """Filter the columns of x (N, m)."""
        spread = self._spread(x)
        return np.where(spread.outlier, spread.median, x)

    def outliers(self, *given: Any) -> NDArray[np.bool_]:
        """True where a sample is an outlier, in the shape of the values; takes x, (t, x) or a `Stream`."""
        return self.spread(*given).outlier

    def spread(self, *given: Any) -> LocalSpread:
        """Local median, σ and verdict at every sample; takes x, (t, x) or a `Stream`."""
        came = read_samples("Hampel", *given)
        flat = np.asarray(given[-1].values if hasattr(given[-1], "values") else given[-1]).ndim == 1
        found = self._spread(came.x)
        return LocalSpread(found.median[:, 0], found.sigma[:, 0], found.outlier[:, 0]) if flat else found

    def _spread(self, x: Array) -> LocalSpread:
        placed = self.place(x)
        middle, sigma = np.empty(x.shape), np.empty(x.shape)
        for c in range(x.shape[1]):
            for rows, series, low, high in pieces(placed.x[:, c], placed.low, placed.high):
                middle[rows, c] = medians(series, low, high)
                sigma[rows, c] = SIGMA_PER_MAD * deviations(series, low, high, middle[rows, c])
        middle, sigma = self.settled(middle, placed), self.settled(np.maximum(sigma, self.floor), placed)
        # a comparison with NaN is False: what is missing, or has no window, is no outlier
        return LocalSpread(middle, sigma, np.abs(x - middle) > self.threshold * sigma)

    def step(self, state: WindowState, x: float, t: float | None = None) -> tuple[float, WindowState]:
        """Take one sample: the sample, or the local median in its place, and the next state."""
        after = self.push(state, x)
        if math.isnan(x) or self.is_refused(after):
            return x, after
        middle = median_of_sorted(after.ordered)
        sigma = SIGMA_PER_MAD * spread_of_sorted(after.ordered, middle)
        return (middle if abs(x - middle) > self.threshold * max(sigma, self.floor) else x), after

    def response(self, interval: float | None = None, rng: np.random.Generator | None = None) -> Response:
        """What it does to a clean step (as a median) and to noise (measured: it has no closed form).

        Parameters
        ----------
        rng : draws 100 000 normal numbers; without it, always the same ones
        """
        step = require_interval(interval, 1.0, "Hampel's response")
        noise = measure_noise_gain(self, np.random.default_rng(0) if rng is None else rng)
        # half a window of ones has the median 0.5 and the MAD 0.5: a gate wide enough lets the one through
        half = self.window % 2 == 0 and self.threshold * SIGMA_PER_MAD >= 1.0
        return Response((self.window // 2 - half - self.ahead) * step, noise, self.ahead * step)


def spread_of_sorted(ordered: Sequence[float], centre: float) -> float:
    """Median of |x - centre| of numbers in order of size, O(k)."""
    return median_of_sorted(sorted(abs(x - centre) for x in ordered))
