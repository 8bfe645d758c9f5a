"""Power spectral density of a still sensor: how white, and which lines stand out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError

__all__ = ["Spectrum", "spectrum_of"]

Array = NDArray[np.float64]
SEGMENTS = 16  # at least so many half-overlapping segments
LONGEST = 1 << 14
FEWEST = 32
LINE = 1e-4  # chance of any false line in a spectrum of white noise
SPREAD = 2  # bins to either side into which a Hann window spreads a line
NEIGHBOURS = 41  # bins whose median a line stands out from


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """One-sided power spectral density.

    Parameters
    ----------
    frequency : (F,) Hz, above zero
    density : (F,) unit²/Hz
    interval : factors on the density that make its 95 % interval
    white : density of white noise with the same median from a tenth of the Nyquist frequency up, one-sided
    lines : (frequency, σ of that line) of narrow peaks, the strongest first
    """

    frequency: Array
    density: Array
    interval: tuple[float, float]
    white: float
    lines: tuple[tuple[float, float], ...]

    @property
    def noise_density(self) -> float:
        """Unit/√Hz as `ImuNoise` and Allan's N mean it: σ of a reading is this over √dt; √(white / 2)."""
        return float(np.sqrt(0.5 * self.white))


def spectrum_of(residual: Array, rate: float) -> Spectrum:
    """Welch's spectrum of evenly sampled residuals (N,), NaN taken for zero.

    Half-overlapping Hann windows without their means, each as long as sixteen of them allow, 2^14 at most.

    Raises
    ------
    DataError
        for fewer than 32 readings.

    Notes
    -----
    Welch 1967, The use of fast Fourier transform for the estimation of power spectra.
    """
    from scipy.special import chdtri

    x = np.where(np.isfinite(residual), residual, 0.0)
    if len(x) < FEWEST:
        raise DataError(f"a spectrum needs {FEWEST} readings, got {len(x)}")
    length = int(np.clip(2 * len(x) // (SEGMENTS + 1), FEWEST // 2, LONGEST))
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)
    starts = np.arange(0, len(x) - length + 1, length // 2)
    total = np.zeros(length // 2 + 1)
    for start in starts:
        part = x[start : start + length]
        total += np.abs(np.fft.rfft(window * (part - part.mean()))) ** 2
    density = total * 2.0 / (len(starts) * rate * float(window @ window))
    if length % 2 == 0:
        density[-1] /= 2.0
    frequency = np.arange(len(density)) * rate / length
    freedom = _freedom(len(starts))
    high, low = (freedom / float(chdtri(freedom, p)) for p in (0.975, 0.025))
    band = frequency > 0.05 * rate
    # the median of χ² is below its mean
    white = float(np.median(density[band])) * freedom / float(chdtri(freedom, 0.5))
    lines = _lines(frequency[1:], density[1:], freedom)
    return Spectrum(frequency[1:], density[1:], (low, high), white, lines)


def _freedom(segments: int) -> float:
    """Degrees of freedom of the mean of half-overlapping Hann segments (neighbours correlate by 1/36)."""
    return 2.0 * segments / (1.0 + 2.0 / 36.0 * (segments - 1) / segments)


def _lines(frequency: Array, density: Array, freedom: float) -> tuple[tuple[float, float], ...]:
    """Bins that stand out from the median of their neighbourhood beyond chance, joined where they touch."""
    from scipy.special import chdtri

    from sequential.signal import SlidingMedian

    if len(density) < NEIGHBOURS:
        return ()
    floor = SlidingMedian(NEIGHBOURS)(density) * freedom / float(chdtri(freedom, 0.5))
    limit = float(chdtri(freedom, LINE / len(density))) / freedom
    inside = density > 2.0 * limit * floor
    step = frequency[1] - frequency[0]
    found = []
    for rows in np.split(np.flatnonzero(inside), np.flatnonzero(np.diff(np.flatnonzero(inside)) > 2) + 1):
        if len(rows):
            wide = slice(max(int(rows[0]) - SPREAD, 0), int(rows[-1]) + SPREAD + 1)
            power = float(np.sum((density - floor)[wide])) * step
            peak = rows[np.argmax(density[rows])]
            found.append((float(frequency[peak]), float(max(power, 0.0) ** 0.5)))
    return tuple(sorted(found, key=lambda line: -line[1]))
