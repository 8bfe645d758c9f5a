"""When, and by how few readings, a sum of squares was made: spans, tails, silences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Pauses", "Span", "Tail", "pauses", "tail", "worst_span"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

NARROW = 0.25  # of the time: an excess inside less than this has a when
MOST = 0.6  # of the excess: what a worst span holds
HEAVY = 0.75  # of the sum: what the few readings of a tail carry
FEW = 0.2  # of the readings: at most so many are few
SILENT = 10.0  # usual intervals: a longer one is a pause


@dataclass(frozen=True, slots=True)
class Span:
    """Part of a run, in seconds since its start, that holds a share of an excess."""

    start: float
    stop: float
    share: float
    readings: int

    def __str__(self) -> str:
        if self.readings == 1:
            return f"t = {self.start:.0f} s ({self.share:.0%} of the excess in one reading)"
        return f"t = {self.start:.0f}-{self.stop:.0f} s ({self.share:.0%} of the excess)"


def worst_span(t: Array, excess: Array, whole: float) -> Span | None:
    """Shortest span with 60 % of the positive excess (N,), if under a quarter of `whole` seconds.

    Parameters
    ----------
    t : (N,) seconds, sorted
    excess : (N,) squares minus what is expected of them; negative ones count as zero
    """
    positive = np.maximum(excess, 0.0)
    total = float(positive.sum())
    if total <= 0.0 or whole <= 0.0:
        return None
    heap = np.concatenate([[0.0], np.cumsum(positive)])
    # For every start, the first reading with which the span is heavy enough.
    last = np.searchsorted(heap, heap[:-1] + MOST * total * (1.0 - 1e-12), side="left")
    starts = np.flatnonzero(last <= len(t))
    lengths = t[last[starts] - 1] - t[starts]
    best = int(starts[np.argmin(lengths)])
    end = int(last[best]) - 1
    if t[end] - t[best] > NARROW * whole:
        return None
    share = float(heap[end + 1] - heap[best]) / total
    return Span(float(t[best]), float(t[end]), share, end - best + 1)


@dataclass(frozen=True, slots=True)
class Tail:
    """The `few` largest of `count` values carry `share` of the sum; `burst` is where, if close together."""

    few: int
    count: int
    share: float
    burst: tuple[float, float] | None


def tail(t: Array, values: Array, whole: float) -> Tail | None:
    """The few values (N,) that carry three quarters of the sum, or None where they are not few."""
    total = float(values.sum())
    if len(values) < 10 or total <= 0.0:
        return None
    order = np.argsort(values)[::-1]
    carried = np.cumsum(values[order])
    few = int(np.searchsorted(carried, HEAVY * total)) + 1
    if few > FEW * len(values):
        return None
    when = t[order[:few]]
    close = few > 1 and float(np.ptp(when)) <= NARROW * whole
    burst = (float(when.min()), float(when.max())) if close else None
    return Tail(few, len(values), float(carried[few - 1]) / total, burst)


@dataclass(frozen=True, slots=True)
class Pauses:
    """Silences of a stream: how many, the longest (s), where it begins (s), the usual interval (s)."""

    count: int
    longest: float
    begins: float
    usual: float


def pauses(t: Array, stop: float) -> Pauses | None:
    """Silences of more than ten usual intervals in stamps (N,) s, up to `stop`; None where there is none."""
    if len(t) < 3:
        return None
    usual = float(np.median(np.diff(t)))
    gaps = np.diff(np.append(t, stop))
    long = np.flatnonzero(gaps > SILENT * usual)
    if usual <= 0.0 or not len(long):
        return None
    worst = int(long[np.argmax(gaps[long])])
    return Pauses(len(long), float(gaps[worst]), float(t[worst]), usual)
