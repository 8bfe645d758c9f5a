"""The moving mean: the least noise that k equal weights can leave, and a plain delay."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.signal.response import REACHED, Response, require_interval, samples_until
from sequential.signal.window import Windowed, WindowState

__all__ = ["MovingMean"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@final
@dataclass(frozen=True, slots=True)
class MovingMean(Windowed):
    """Mean of the numbers in a sliding window; parameters as in `Windowed`.

    O(n) whatever the window.  NaN is skipped; a window without any number gives NaN.

    Notes
    -----
    Sums are taken in blocks of k, forwards and backwards (van Herk 1992 did it for maxima), so that nothing
    is ever subtracted and a large value leaves no rounding behind once it has left the window.
    """

    def filtered(self, t: Array | None, x: Array) -> Array:
        """Filter the columns of x (N, m)."""
        placed = self.place(x)
        missing = np.isnan(placed.x)
        total = window_sums(np.where(missing, 0.0, placed.x), placed.low, placed.high, self.window)
        so_far = np.vstack([np.zeros((1, x.shape[1]), dtype=np.int64), np.cumsum(~missing, axis=0)])
        count = so_far[placed.high] - so_far[placed.low]
        with np.errstate(invalid="ignore"):
            return self.settled(np.where(count > 0, total / np.maximum(count, 1), np.nan), placed)

    def step(self, state: WindowState, x: float, t: float | None = None) -> tuple[float, WindowState]:
        """Take one sample: the mean so far and the next state."""
        after = self.push(state, x)
        if self.is_refused(after):
            return math.nan, after
        return math.fsum(after.ordered) / len(after.ordered), after

    def response(self, interval: float | None = None) -> Response:
        """What it does to a step and to noise; times in samples unless the interval is given."""
        step = require_interval(interval, 1.0, "MovingMean's response")
        late = samples_until(REACHED * self.window) - 1 - self.ahead
        return Response(max(late, 0) * step, 1.0 / math.sqrt(self.window), self.ahead * step)

    def gain(self, hz: ArrayLike, interval: float | None = None) -> Array:
        """Amplitude out over in of a sine, (…); negative where the sine comes out upside down."""
        step = require_interval(interval, 1.0, "MovingMean's gain")
        half = np.pi * np.asarray(hz, dtype=np.float64) * step
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.sin(self.window * half) / (self.window * np.sin(half))
        # at multiples of the sampling rate the sine cannot be told from a constant, but for a sign
        whole = np.round(half / np.pi)
        constant = np.abs(half - whole * np.pi) < 1e-9
        return np.asarray(np.where(constant, (-1.0) ** (whole * (self.window - 1)), ratio))

    def phase_delay(self, hz: ArrayLike = 0.0, interval: float | None = None) -> Array:
        """By how much a sine comes late, s: (k - 1)/2 samples less those of the future, at any frequency."""
        step = require_interval(interval, 1.0, "MovingMean's phase delay")
        return np.full(np.shape(hz), ((self.window - 1) / 2 - self.ahead) * step)

    def group_delay(self, hz: ArrayLike = 0.0, interval: float | None = None) -> Array:
        """The same as the phase delay: the weights are symmetric."""
        return self.phase_delay(hz, interval)


def window_sums(x: Array, low: Ints, high: Ints, block: int) -> Array:
    """Sums (N, m) of x[low:high], none longer than `block`, each inside one block only at its edge or x's."""
    count, columns = x.shape
    blocks = -(-count // block)
    whole = np.zeros((blocks * block, columns))
    whole[:count] = x
    cut = whole.reshape(blocks, block, columns)
    forwards = np.cumsum(cut, axis=1).reshape(-1, columns)
    backwards = np.cumsum(cut[:, ::-1], axis=1)[:, ::-1].reshape(-1, columns)
    first, last = low // block, (high - 1) // block
    from_edge = low % block == 0
    head = np.where(from_edge[:, None], 0.0, backwards[low])
    tail = np.where(((first < last) | from_edge)[:, None], forwards[high - 1], 0.0)
    return np.asarray(head + tail)
