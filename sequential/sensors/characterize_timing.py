"""When readings came: rate, jitter, gaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError

__all__ = ["Timing", "timing_of"]

Array = NDArray[np.float64]
GAP = 1.5  # intervals
SAME = 1e-4  # of an interval: stamps that vary less were computed, not measured


@dataclass(frozen=True, slots=True, eq=False)
class Timing:
    """Intervals between readings.

    Parameters
    ----------
    rate : Hz, inverse of the median interval
    mean_rate : Hz, readings over duration, gaps included
    duration : s
    jitter : s, standard deviation of the intervals, gaps left out
    worst : s, largest distance of an interval from the median, gaps left out
    gaps : (G, 2) beginning and length of each interval of more than 1.5 usual ones, s
    missing : readings that would fill the gaps
    repeated : stamps that are not later than the one before
    """

    rate: float
    mean_rate: float
    duration: float
    jitter: float
    worst: float
    gaps: Array
    missing: int
    repeated: int

    @property
    def computed(self) -> bool:
        """Whether the stamps look computed from a rate: then nothing is known about jitter."""
        return self.worst < SAME / self.rate and not len(self.gaps)


def timing_of(t: NDArray[np.int64]) -> Timing:
    """Rate, jitter and gaps of stamps (N,), int64 ns.

    Raises
    ------
    DataError
        for fewer than three stamps, or where none is later than the one before.
    """
    steps = np.diff(t) * 1e-9
    forward = steps[steps > 0.0]
    if len(forward) < 2:
        raise DataError(f"timing needs three stamps that move forward, got {len(t)} stamps")
    usual = float(np.median(forward))
    gap = steps > GAP * usual
    near = steps[(steps > 0.0) & ~gap]
    gaps = np.column_stack([(t[:-1][gap] - t[0]) * 1e-9, steps[gap]])
    duration = float(t[-1] - t[0]) * 1e-9
    return Timing(
        1.0 / usual,
        (len(t) - 1) / duration,
        duration,
        float(near.std().round(12)),  # stamps are whole nanoseconds
        float(np.abs(near - usual).max().round(12)),
        gaps,
        int(np.sum(np.round(steps[gap] / usual) - 1.0)),
        int((steps <= 0.0).sum()),
    )
