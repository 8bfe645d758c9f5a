"""Readings that do not belong to the noise: how often, how far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.sensors.estimate import Estimate
from sequential.signal import SIGMA_PER_MAD, SlidingMedian

__all__ = ["Outliers", "outliers_of"]

Array = NDArray[np.float64]
WINDOW = 51
THRESHOLD = 6.0  # σ; less than one normal reading in a million is flagged
SAMPLED, CHUNK = 2000, 20_000
QUIETEST = 0.9  # of the usual σ that a window's is taken to have at least


@dataclass(frozen=True, slots=True, eq=False)
class Outliers:
    """Readings far from the median of their neighbours.

    Parameters
    ----------
    where : (N,) True for an outlier
    share : of the readings, with an exact binomial interval
    per_hour : how many come in an hour
    typical, largest : median and maximum of their distance from the local median; NaN where there are none
    typical_sigmas : the same median in local standard deviations
    """

    where: NDArray[np.bool_]
    share: Estimate
    per_hour: float
    typical: float
    largest: float
    typical_sigmas: float

    @property
    def count(self) -> int:
        """How many there are."""
        return int(self.where.sum())


def outliers_of(t: Array, x: Array, lsb: float = 0.0) -> Outliers:
    """Find outliers of readings (N,) at t (N,) s by Hampel's identifier: six σ from the median of 51.

    Parameters
    ----------
    lsb : resolution, below which no local σ is taken to lie

    Notes
    -----
    Median and MAD of a window bear half of it being outliers, and a step of the signal is none.
    """
    known = np.flatnonzero(np.isfinite(x))
    y = x[known]
    window = min(WINDOW, max(3, (len(y) // 2) | 1))
    distance = np.abs(y - SlidingMedian(window)(y))
    # 51 readings know their σ to a sixth only: where it came out small by chance, the usual one counts
    some = np.unique(np.linspace(0, len(y) - 1, min(len(y), SAMPLED)).astype(np.int64))
    least = max(QUIETEST * float(np.median(_local_sigma(y, some, window))), lsb)
    rows = np.flatnonzero(distance > THRESHOLD * least)
    sigma = np.maximum(_local_sigma(y, rows, window), least)
    out = distance[rows] > THRESHOLD * sigma
    rows, sigma = rows[out], sigma[out]
    where = np.zeros(len(x), dtype=bool)
    where[known[rows]] = True
    n, k, far = len(y), len(rows), distance[rows]
    hours = float(t[-1] - t[0]) / 3600.0 if len(t) > 1 else 0.0
    return Outliers(
        where,
        Estimate(k / max(n, 1), *_clopper_pearson(k, max(n, 1))),
        k / hours if hours > 0.0 else 0.0,
        float(np.median(far)) if k else float("nan"),
        float(far.max()) if k else float("nan"),
        float(np.median(far / np.maximum(sigma, 1e-300))) if k else float("nan"),
    )


def _local_sigma(y: Array, rows: NDArray[np.int64], window: int) -> Array:
    """1.4826 MAD of the window about each of some rows (R,); at the ends, of the nearest whole one."""
    found = np.empty(len(rows))
    first = np.clip(rows - window // 2, 0, max(len(y) - window, 0))
    for start in range(0, len(rows), CHUNK):
        part = slice(start, start + CHUNK)
        near = y[first[part, None] + np.arange(min(window, len(y)))]
        middle = np.median(near, axis=1, keepdims=True)
        found[part] = SIGMA_PER_MAD * np.median(np.abs(near - middle), axis=1)
    return found


def _clopper_pearson(k: int, n: int) -> tuple[float, float]:
    """95 % interval of a share, exact (Clopper and Pearson 1934)."""
    from scipy.special import betaincinv

    low = float(betaincinv(k, n - k + 1, 0.025)) if k else 0.0
    high = float(betaincinv(k + 1, n - k, 0.975)) if k < n else 1.0
    return low, high
