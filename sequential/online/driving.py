"""Samples of the stream that drives a process, as they become known; the rules are those of `prepare`."""

from __future__ import annotations

from bisect import bisect_left, bisect_right

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, GapError, MissingStreamError
from sequential.timeline import GAP_FACTOR, MIN_GAP_S

__all__ = ["Driving"]

Array = NDArray[np.float64]
ALWAYS = -(1 << 63)


class Driving:
    """Input samples in the order of their stamps, and which of them drives a step.

    Parameters
    ----------
    name : of the stream
    covers : does a sample hold `"after"` its stamp, until the next one, or `"before"` it, since the last one?
    max_gap : longest pause in seconds; None is the larger of 1 s and 100 intervals, infinity allows any
    """

    def __init__(self, name: str, covers: str, max_gap: float | None) -> None:
        if covers not in {"after", "before"}:
            msg = f"a sample covers the interval 'after' its stamp or 'before' it, got {covers!r}"
            raise DataError(msg)
        self.name, self.covers, self.max_gap = name, covers, max_gap
        self.stamps: list[int] = []
        self.values: list[Array] = []
        self.seen, self.earliest, self.latest = 0, 0, 0

    def __len__(self) -> int:
        return len(self.stamps)

    def add(self, t: int, u: Array) -> int:
        """Take a sample in; returns the time after which moves are no longer what they were."""
        at = bisect_right(self.stamps, t)
        self.stamps.insert(at, t)
        self.values.insert(at, u)
        self.earliest = min(t, self.earliest) if self.seen else t
        self.latest = max(t, self.latest) if self.seen else t
        self.seen += 1
        if at == 0:
            return ALWAYS  # the first sample also drives what came before it
        return self.stamps[at - 1] if self.covers == "before" else t

    def over(self, begin: int, end: int) -> Array:
        """What drives the step from `begin` to `end`, between which no sample lies."""
        if self.covers == "after":
            row = bisect_right(self.stamps, begin) - 1
        else:
            row = bisect_left(self.stamps, end)
        return self.values[min(max(row, 0), len(self.stamps) - 1)]

    def require_soon(self, began: int, now: int, delay: int) -> None:
        """Raise `MissingStreamError` where readings have waited for a first sample for too long."""
        limit = MIN_GAP_S if self.max_gap is None else self.max_gap
        if not self.seen and (now - began - delay) * 1e-9 > limit:
            msg = (
                f"{self.name!r} drives the process, but no sample of it has come in the first "
                f"{(now - began) * 1e-9:.3f} s; name it so in the events, or wait longer with max_gap=…"
            )
            raise MissingStreamError(msg)

    def require_no_gap(self, start: int, end: int) -> None:
        """Raise `GapError` where the samples before `end` pause for too long; `start` is the first node's."""
        if self.seen < 2:
            return
        row = bisect_left(self.stamps, end) - 1
        since = max(self.stamps[row], start) if row >= 0 else start
        pause, usual = (end - since) * 1e-9, (self.latest - self.earliest) * 1e-9 / (self.seen - 1)
        limit = max(MIN_GAP_S, GAP_FACTOR * usual) if self.max_gap is None else self.max_gap
        if pause > limit:
            msg = (
                f"{self.name!r} drives the process but pauses for {pause:.3f} s after {since * 1e-9:.3f} s "
                f"(usual interval {usual:.4f} s, limit {limit:.3f} s); start anew after it, or allow it with "
                "max_gap=…"
            )
            raise GapError(msg)

    def settled(self, horizon: int) -> int:
        """Until when the moves are final, given that no event before `horizon` is still taken."""
        known = bisect_right(self.stamps, horizon)
        if not known:
            return ALWAYS  # a sample may still come that is the first
        # a sample at the horizon may still come, and covers the time since the last one before it
        return horizon if self.covers == "after" else self.stamps[known - 1]

    def forget(self, t: int) -> None:
        """Drop the samples that drive nothing after `t`."""
        keep = bisect_right(self.stamps, t) - 1
        if keep > 0:
            del self.stamps[:keep], self.values[:keep]
