"""Which part of a spectrum is that of a still sensor, and which is a filter's or a vibration's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.errors import NotConvergedError
from sequential.sensors.noise_likelihood import Fit, maximise
from sequential.sensors.noise_spectrum import CosineSpectrum

__all__ = ["judge", "usable"]

Array = NDArray[np.float64]
HALF_OCTAVE = 2.0**0.5
SURE, MATTERS = 4.5, 0.03  # standard deviations, and share of the power
CLEARLY, BADLY = 6.0, 0.15
ENOUGH = 200.0  # coefficients that a band must keep


def usable(spectrum: CosineSpectrum) -> tuple[CosineSpectrum, Fit]:
    """Leave the top away for as long as its highest half octave has not the power that the fit gives it.

    Raises
    ------
    NotConvergedError
    """
    while True:
        fit = maximise(spectrum)
        if fit is None:
            raise NotConvergedError("the noise fit found no start; are the samples finite and not constant?")
        if not len(spectrum.frequency):
            return spectrum, fit
        end = spectrum.frequency[-1] / HALF_OCTAVE
        top = spectrum.frequency > end
        share, freedom = _share(spectrum, fit, top)
        ragged = abs(share - 1.0) > max(MATTERS, SURE * np.sqrt(2.0 / max(freedom, 1.0)))
        if not ragged or spectrum.freedom[~top].sum() < ENOUGH:
            return spectrum, fit
        spectrum = spectrum.below(float(end))


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
