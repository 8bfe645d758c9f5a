"""The noise that matched features really have, a core and heavy tails: a Student distribution of residuals.

Where the tails are Gaussian the fit says so (many degrees of freedom) and least squares comes out; real
features have three or four.  Estimates weigh a distance s by 1 / (1 + s² / c²), which is the maximum of that
likelihood for c² = ν scale².  Lange, Little, Taylor 1989, "Robust statistical modeling using the t
distribution".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from vision3d.camera import Array

__all__ = ["Noise", "fit_noise"]

FREEDOMS: Final = (1.0, 2.0, 3.0, 4.0, 6.0, 10.0, 30.0, 100.0)
ROUNDS, SETTLED = 25, 1e-4
LEAST = 1e-9


@dataclass(frozen=True, slots=True)
class Noise:
    """A Student distribution of residuals.

    Parameters
    ----------
    freedom : its degrees of freedom
    scale : of a coordinate; the standard deviation of the core
    """

    freedom: float
    scale: float

    @property
    def cauchy(self) -> float:
        """The parameter of the loss that weighs residuals as this noise asks."""
        return float(np.sqrt(self.freedom) * self.scale)

    def cost(self, squared: Array, limit: float) -> float:
        """Minus twice the log likelihood of squared distances (N,), those beyond `limit` as if at it."""
        share = np.minimum(squared, limit) / self.cauchy**2
        return float((self.freedom + 1.0) * np.sum(np.log1p(share)))


def fit_noise(squared: Array, dims: int = 1) -> Noise:
    """The most likely Student noise of squared distances (N,) of `dims` coordinates each."""
    from scipy.special import gammaln

    if not len(squared) or not float(np.median(squared)) > LEAST**2:
        return Noise(FREEDOMS[-1], max(LEAST, float(np.sqrt(np.mean(squared)))) if len(squared) else LEAST)
    best, found = -np.inf, Noise(FREEDOMS[-1], LEAST)
    for freedom in FREEDOMS:
        variance = float(np.median(squared))
        for _ in range(ROUNDS):
            before = variance
            variance = (freedom + dims) / dims * float(np.mean(squared / (freedom + squared / before)))
            if abs(variance - before) < SETTLED * before:
                break
        norm = gammaln(0.5 * (freedom + dims)) - gammaln(0.5 * freedom)
        norm -= 0.5 * dims * np.log(freedom * np.pi * variance)
        tails = 0.5 * (freedom + dims) * np.log1p(squared / (freedom * variance))
        likelihood = len(squared) * norm - float(tails.sum())
        if likelihood > best:
            best, found = likelihood, Noise(freedom, float(np.sqrt(variance)))
    return found
