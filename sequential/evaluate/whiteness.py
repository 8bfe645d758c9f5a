"""Innovations of a filter that fits are white: nothing in one of them predicts the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ShapeError
from sequential.history import Innovations

__all__ = ["Whiteness", "autocorrelation", "whiteness"]

Array = NDArray[np.float64]
Z = 1.959963984540054  # two-sided 95 % of the normal distribution


@dataclass(frozen=True, slots=True, eq=False)
class Whiteness:
    """Autocorrelation and mean of whitened innovations, and what they say.

    `correlation` (L, m) at lags 1 … L of each component, which for white innovations stays inside ± `bound`
    95 % of the time; `statistic` is Ljung and Box's, χ² with L·m degrees of freedom; `mean` (m,) in standard
    deviations, with a standard error of 1/√count.
    """

    correlation: Array
    bound: float
    share_outside: float
    statistic: float
    p_value: float
    mean: Array
    mean_p_value: float
    count: int
    white: bool
    unbiased: bool

    @property
    def verdict(self) -> str:
        """`white`, `correlated`, `biased` or `correlated and biased`."""
        faults = [word for word, fine in (("correlated", self.white), ("biased", self.unbiased)) if not fine]
        return " and ".join(faults) or "white"


def autocorrelation(values: Array, lags: int) -> Array:
    """(lags, m) autocorrelation of each column of (N, m) at lags 1 … `lags`, mean removed, NaN left out."""
    centred = np.nan_to_num(values - np.nanmean(values, axis=0))
    energy = np.sum(centred**2, axis=0)
    energy = np.where(energy > 0.0, energy, 1.0)
    return np.stack([np.sum(centred[k:] * centred[:-k], axis=0) / energy for k in range(1, lags + 1)])


def whiteness(innovations: Innovations, lags: int | None = None, level: float = 0.05) -> Whiteness:
    """Test the accepted innovations of a filter for whiteness and for a mean of zero.

    Parameters
    ----------
    lags : how many; by default a fifth of the readings, 20 at most
    level : probability below which a p-value counts as a fault

    Notes
    -----
    Q = N (N+2) Σ r_k² / (N-k) over lags and components (Ljung and Box 1978, eq. 1.3).  Leave-one-out
    residuals of a smoother are correlated by construction; only a filter's are expected to be white.

    Raises
    ------
    ShapeError
        if there are fewer than ten accepted readings, or more lags than they allow.
    """
    white = innovations.whitened()[innovations.accepted] if len(innovations.t) else np.zeros((0, 1))
    n, m = white.shape
    lags = min(20, n // 5) if lags is None else lags
    if n < 10 or not 1 <= lags < n:
        raise ShapeError(f"whiteness needs ten readings or more and 1 <= lags < readings; got {n} and {lags}")
    from scipy.special import chdtrc

    r = autocorrelation(white, lags)
    statistic = float(n * (n + 2.0) * np.sum(r**2 / (n - np.arange(1, lags + 1.0))[:, None]))
    p_value = float(chdtrc(lags * m, statistic))
    mean = np.nanmean(white, axis=0)
    mean_p_value = float(chdtrc(m, float(np.isfinite(white).sum(axis=0) @ mean**2)))
    bound = Z / n**0.5
    return Whiteness(
        correlation=r,
        bound=bound,
        share_outside=float(np.mean(np.abs(r) > bound)),
        statistic=statistic,
        p_value=p_value,
        mean=mean,
        mean_p_value=mean_p_value,
        count=n,
        white=p_value >= level,
        unbiased=mean_p_value >= level,
    )
