"""What corners err by besides what their detection states.

A detector knows the noise of the pixels; a board, a lens and light add what it cannot know.  The more certain
a corner claims to be, the more of its error is of that kind.  So the variance of a corner is taken for
scale² (sigma² + floor²), and the floor is what makes the residuals most likely: under Student's t, which
wrong corners do not sway (Lange, Little, Taylor 1989, "Robust statistical modeling using the t
distribution").
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["floor_of"]

Array = NDArray[np.float64]

FREEDOM = 4.0
"""Degrees of freedom of Student's t."""
FLOORS = np.concatenate([[0.0], np.geomspace(0.2, 20.0, 14)])
"""Floors that are tried, in units of the median sigma."""
BELIEVED = 4.0
"""Gain of log likelihood from which a floor is believed."""
ROUNDS = 8


def floor_of(residuals: Array, sigma_px: Array) -> float:
    """Standard deviation, px, before scaling, that corners have besides their sigma; 0 where none shows.

    Parameters
    ----------
    residuals : Array
        (M, 2) px; NaN rows are passed over.
    sigma_px : Array
        (M,), as stated.
    """
    seen = np.isfinite(residuals[:, 0])
    squares, sigma = np.sum(residuals[seen] ** 2, axis=1), sigma_px[seen]
    middle = float(np.median(sigma))
    if not squares.any() or np.ptp(sigma) <= 1e-9 * middle:
        return 0.0
    gains = [_log_likelihood(squares, sigma**2 + (floor * middle) ** 2) for floor in FLOORS]
    best = int(np.argmax(gains))
    return float(FLOORS[best] * middle) if gains[best] > gains[0] + BELIEVED else 0.0


def _log_likelihood(squares: Array, variance: Array) -> float:
    """Of squared distances in the plane, at the scale that makes them most likely."""
    scale = max(float(np.median(squares / variance)), 1e-300)
    for _ in range(ROUNDS):
        weight = (FREEDOM + 2.0) / (FREEDOM + squares / (variance * scale))
        scale = float(np.mean(weight * squares / variance)) / 2.0
    spread = variance * scale
    return -float(np.sum(np.log(spread) + 0.5 * (FREEDOM + 2.0) * np.log1p(squares / (FREEDOM * spread))))
