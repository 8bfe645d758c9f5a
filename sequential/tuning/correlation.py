"""How many independent samples a correlated series is worth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["autocovariance", "effective_counts"]

Array = NDArray[np.float64]
NOISE = 2.0  # standard errors: the first correlation below this ends the sum


def autocovariance(values: Array) -> Array:
    """(N,) autocorrelation of a series (N,) at lags 0 … N-1 by FFT; NaN entries are left out of the sums."""
    known = np.isfinite(values)
    centred = np.where(known, values - (values[known].mean() if known.any() else 0.0), 0.0)
    size = 1 << int(2 * len(values) - 1).bit_length()
    sums, pairs = (_lagged(row, size, len(values)) for row in (centred, known.astype(np.float64)))
    found = sums / np.maximum(np.round(pairs), 1.0)
    return np.asarray(found / found[0] if found[0] > 0.0 else np.eye(1, len(values))[0])


def _lagged(row: Array, size: int, count: int) -> Array:
    spectrum = np.fft.rfft(row, size)
    return np.asarray(np.fft.irfft(np.abs(spectrum) ** 2, size)[:count])


def effective_counts(values: Array) -> tuple[float, float, float]:
    """Effective number of samples for a mean and for a variance, and the correlation at lag one.

    For a Gaussian series with autocorrelation ρ: n / (1 + 2 Σ ρ) and n / (1 + 2 Σ ρ²) (Priestley 1981,
    Spectral Analysis and Time Series, section 5.3), summed up to the first ρ that is within its noise.
    """
    n = int(np.isfinite(values).sum())
    if n < 4:
        return float(n), float(n), 0.0
    rho = autocovariance(values)[1 : n // 2]
    quiet = np.flatnonzero(np.abs(rho) < NOISE / n**0.5)
    used = rho[: quiet[0]] if len(quiet) else rho
    for_mean = n / max(1.0 + 2.0 * float(used.sum()), 1.0 / n)
    for_variance = n / (1.0 + 2.0 * float((used**2).sum()))
    return float(np.clip(for_mean, 1.0, n)), max(for_variance, 2.0), float(rho[0])
