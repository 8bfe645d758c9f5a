"""How many knots a second a motion needs: the fewest that predict the IMU's own readings.

Splines are fitted to the six channels with more and more knots; generalised cross-validation (Craven, Wahba
1979) charges for each, so that knots that only follow noise are not bought.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_lsq_spline

__all__ = ["RATES", "knots_per_second"]

Array = NDArray[np.float64]
RATES = (6.0, 9.0, 13.0, 18.0, 25.0, 35.0, 50.0, 70.0, 100.0)
WORTH = 1.01  # of GCV, for which more knots are taken
DENSEST = 0.4  # knots a reading
LONGEST = 4000  # readings that are looked at


def knots_per_second(t: Array, gyro: Array, accel: Array) -> float:
    """Knots a second for readings (N, 3) at times (N,), of `RATES`."""
    rate = 1.0 / float(np.median(np.diff(t)))
    rates = [one for one in RATES if one <= DENSEST * rate] or [min(RATES[0], DENSEST * rate)]
    first = max(0, (len(t) - LONGEST) // 2)
    own = slice(first, first + LONGEST)
    values = np.hstack([gyro, accel])[own]
    scores = np.array([_score(t[own], values, one) for one in rates])
    best = int(np.argmin(scores))
    enough = np.flatnonzero(scores[: best + 1] <= scores[best] + np.log(WORTH))
    return rates[int(enough[0])]


def _score(t: Array, values: Array, rate: float) -> float:
    """Mean logarithm over the channels of the generalised cross-validation, with knots at a rate."""
    gaps = np.flatnonzero(np.diff(t) > 1.5 / rate)
    squares, used = np.zeros(values.shape[1]), 0
    for rows in np.split(np.arange(len(t)), gaps + 1):
        count = int(np.floor((t[rows[-1]] - t[rows[0]]) * rate)) if len(rows) else 0
        if count < 4 or len(rows) < 3 * (count + 4):
            if len(rows) >= 8 and count < 4:
                continue
            if len(rows) < count + 5:
                continue
        inner = np.linspace(t[rows[0]], t[rows[-1]], count + 1)
        knots = np.concatenate([[inner[0]] * 4, inner[1:-1], [inner[-1]] * 4])
        try:
            fit = make_lsq_spline(t[rows], values[rows], knots, k=4 - 1)
        except (ValueError, np.linalg.LinAlgError):
            continue
        squares += np.sum((fit(t[rows]) - values[rows]) ** 2, axis=0)
        used += count + 3
    n = len(t)
    if used == 0 or used >= n:
        return np.inf
    return float(np.mean(np.log(np.maximum(squares, 1e-300) * n / (n - used) ** 2)))
