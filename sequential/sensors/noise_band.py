"""Which part of a spectrum is that of a still sensor, and which is a filter's or a vibration's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotConvergedError
from sequential.sensors.noise_likelihood import Fit, maximise
from sequential.sensors.noise_spectrum import CosineSpectrum

__all__ = ["judge", "moves_smoothly", "usable", "without_spikes"]

Array = NDArray[np.float64]
HALF_OCTAVE = 2.0**0.5
SURE, MATTERS = 3.5, 0.005  # standard deviations, and share of the power
MARGIN = 4.0  # below where a filter is noticed it has bent the spectrum too, by less
CLEARLY, BADLY = 6.0, 0.15
ENOUGH = 200.0  # coefficients that a band must keep
SPIKE, RARE = 10.0, 0.01  # standard deviations of the usual noise, and share of the samples
SLOWEST, UNLIKELY = 4, 1e-4  # coefficients of each parity


def usable(spectrum: CosineSpectrum) -> tuple[CosineSpectrum, Fit]:
    """Leave the top away for as long as its highest half octave has not the power that the fit gives it.

    Where that happens two octaves more are left away.

    Raises
    ------
    NotConvergedError
    """
    whole = spectrum
    while True:
        fit = maximise(spectrum)
        if fit is None:
            raise NotConvergedError("the noise fit found no start; are the samples finite and not constant?")
        if not len(spectrum.frequency):
            return spectrum, fit
        end = float(spectrum.frequency[-1]) / HALF_OCTAVE
        share, freedom = _share(spectrum, fit, spectrum.frequency > end)
        ragged = abs(share - 1.0) > max(MATTERS, SURE * np.sqrt(2.0 / max(freedom, 1.0)))
        if not ragged or spectrum.below(end).freedom.sum() < ENOUGH:
            break
        spectrum = spectrum.below(end)
    if spectrum is whole:
        return spectrum, fit
    safe = end * HALF_OCTAVE / MARGIN
    while spectrum.below(safe).freedom.sum() < ENOUGH:
        safe *= HALF_OCTAVE
    spectrum = spectrum.below(safe)
    return spectrum, maximise(spectrum) or fit


def judge(spectrum: CosineSpectrum, fit: Fit) -> tuple[float, float, float] | None:
    """The half octave that is least like the fit: (from, to, power over the fit's), None if all are alike."""
    worst, found = 1.0, None
    if not len(spectrum.frequency):
        return None
    end = float(spectrum.frequency[-1])
    while end > spectrum.frequency[0]:
        inside = (spectrum.frequency > end / HALF_OCTAVE) & (spectrum.frequency <= end)
        share, freedom = _share(spectrum, fit, inside)
        excess = abs(share - 1.0) / max(BADLY, CLEARLY * np.sqrt(2.0 / max(freedom, 1.0)))
        if excess > worst:
            worst, found = excess, (end / HALF_OCTAVE, end, share)
        end /= HALF_OCTAVE
    return found


def _share(spectrum: CosineSpectrum, fit: Fit, bins: NDArray[np.bool_]) -> tuple[float, float]:
    """Power over that of the fit in some bins, and the number of coefficients in them."""
    freedom = float(spectrum.freedom[bins].sum())
    if not freedom:
        return 1.0, 0.0
    ratio = spectrum.power[bins] / (fit.square @ spectrum.weight[:, bins])
    return float(ratio.sum()) / freedom, freedom


def moves_smoothly(spectrum: CosineSpectrum, fit: Fit) -> bool:
    """Whether the slowest motion is greater than the fit allows: a warm-up, not a random walk.

    A walk's power falls as 1/k², a smooth curve's as 1/k⁴, so a walk that is made to fit the whole is too
    small for the first eight coefficients.
    """
    from scipy.special import chdtrc

    first = 0.0
    for low in spectrum.low:
        root = np.linalg.cholesky(fit.square[2] * low.flicker + np.diag(fit.square @ low.weight))
        rest = low.value
        if low.drift is not None:
            along = np.linalg.solve(root, low.drift)
            rest = rest - low.drift * float(along @ np.linalg.solve(root, rest)) / float(along @ along)
        first += float(np.sum(np.linalg.solve(root, rest)[:SLOWEST] ** 2))
    return bool(chdtrc(2 * SLOWEST, first) < UNLIKELY)


def without_spikes(x: Array) -> tuple[Array, int]:
    """Samples (N,) with lone outliers replaced by the median of the five around, and how many there were.

    Where more than a hundredth stands out they are no outliers, and are left in place.
    """
    from scipy.ndimage import median_filter

    around = median_filter(x, 5, mode="nearest")
    away = np.abs(x - around)
    usual = float(np.partition(away, 9 * len(away) // 10)[9 * len(away) // 10]) / 1.645
    out = np.flatnonzero(away > SPIKE * usual)
    if not usual or not 0 < len(out) <= RARE * len(x):
        return x, 0
    mended = x.copy()
    mended[out] = around[out]
    return mended, len(out)
