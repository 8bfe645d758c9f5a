"""How quickly frames come and go, over the last seconds."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass

import numpy as np

__all__ = ["Rates", "RatesNow"]

WINDOW_NS = 2_000_000_000
KEPT = 4096


@dataclass(frozen=True)
class RatesNow:
    """What the page shows of the last two seconds.

    Parameters
    ----------
    fps : frames that were worked on, a second
    latency_ms : median from the arrival of a frame to its picture with marks being ready; NaN without frames
    latency_high_ms : the slowest twentieth begins here
    work_ms : median of what the task takes
    skipped : frames in all that were left out because the one before was still being worked on
    """

    fps: float
    latency_ms: float
    latency_high_ms: float
    work_ms: float
    skipped: int


class Rates:
    """Filled by the thread that works, read by those that serve."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._rows: deque[tuple[int, int, int]] = deque(maxlen=KEPT)
        self.frames = self.skipped = 0

    def add(self, captured_ns: int, began_ns: int, ended_ns: int, now_ns: int, skipped: int) -> None:
        """One frame: when it came, when the task began and ended, when its picture was ready."""
        with self._lock:
            self._rows.append((now_ns, now_ns - captured_ns, ended_ns - began_ns))
            self.frames += 1
            self.skipped += skipped

    def now(self, at_ns: int) -> RatesNow:
        """Over the two seconds before `at_ns`."""
        with self._lock:
            rows = [row for row in self._rows if at_ns - row[0] <= WINDOW_NS]
            skipped = self.skipped
        if len(rows) < 2:
            return RatesNow(0.0, float("nan"), float("nan"), float("nan"), skipped)
        times, latency, work = np.array(rows, dtype=np.float64).T * 1e-6
        span = max(times[-1], at_ns * 1e-6 - 200.0) - times[0]  # a pause lets the rate fall
        return RatesNow(
            fps=1e3 * (len(rows) - 1) / max(span, 1e-3),
            latency_ms=float(np.median(latency)),
            latency_high_ms=float(np.percentile(latency, 95)),
            work_ms=float(np.median(work)),
            skipped=skipped,
        )
