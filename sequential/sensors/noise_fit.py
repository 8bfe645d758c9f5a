"""Noise coefficients of a still sensor: N, B and K with 95 % intervals, and what could not be seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ShapeError
from sequential.sensors.allan import read_series
from sequential.sensors.noise_band import judge, moves_smoothly, usable, without_spikes
from sequential.sensors.noise_likelihood import drift, profile
from sequential.sensors.noise_spectrum import COMPONENTS, cosine_spectrum

__all__ = ["Coefficient", "NoiseFit", "fit_noise"]

Array = NDArray[np.float64]
Term = Literal["N", "B", "K", "Q", "R"]
TERMS: tuple[Term, ...] = ("N", "B", "K", "Q", "R")
NAMES: dict[Term, str] = {
    "N": "white noise",
    "B": "bias instability",
    "K": "random walk",
    "Q": "quantisation noise",
    "R": "drift",
}
FEWEST = 64
STRAIGHT = 1e-12
# Records of 100 N²/B² seconds show flicker, of 80 N/K and 50 B²/K² a random walk, nine times in ten, by Monte
# Carlo.
FLICKER_IN_WHITE, WALK_IN_WHITE, WALK_IN_FLICKER = 100.0, 80.0, 50.0


@dataclass(frozen=True, slots=True)
class Coefficient:
    """One coefficient with its 95 % interval.

    Parameters
    ----------
    value : most likely value; NaN where it is not visible
    low, high : 95 % interval; `high` is the upper bound of what is not visible
    visible : whether the interval excludes zero
    """

    value: float
    low: float
    high: float
    visible: bool


@dataclass(frozen=True, slots=True)
class NoiseFit:
    """Coefficients of IEEE Std 952-1997, annex C, for a sensor of unit u.

    Parameters
    ----------
    N : white noise (angle or velocity random walk), u/√Hz; deviation N/√τ, read at τ = 1 s
    B : bias instability (flicker), u; the deviation's flat part is sqrt(2 ln 2/π) B = 0.664 B
    K : random walk of the bias (rate random walk), u/s/√Hz; K √(τ/3), read at τ = 3 s
    Q : quantisation of the integral, u·s; √3 Q/τ, read at τ = √3 s
    R : drift, u/s, with its sign; |R| τ/√2, read at τ = √2 s
    rate, duration : of the record, Hz and s
    top : frequency below which the spectrum was used, Hz
    lines : periodic disturbances that were left out, each (frequency Hz, rms u)
    misfit : (from Hz, to Hz, power over that of the fit) where the spectrum is unlike these noises, or None
    smooth : whether the slowest motion is smoother than a random walk, as in a warm-up
    spikes : lone outliers that were replaced
    repeats : share of samples that repeat the one before
    unit : u, for texts
    """

    N: Coefficient
    B: Coefficient
    K: Coefficient
    Q: Coefficient
    R: Coefficient
    rate: float
    duration: float
    top: float
    lines: tuple[tuple[float, float], ...]
    misfit: tuple[float, float, float] | None
    smooth: bool
    spikes: int
    repeats: float
    unit: str = ""

    def __getitem__(self, term: Term) -> Coefficient:
        found: Coefficient = getattr(self, term)
        return found

    def deviation(self, tau: ArrayLike) -> Array:
        """Allan deviation (T,) of the terms that are visible, at averaging times τ in seconds."""
        t = np.asarray(tau, dtype=np.float64)
        shares = (curve(term, self[term].value, t) for term in TERMS if self[term].visible)
        return np.sqrt(sum((share**2 for share in shares), np.zeros_like(t)))

    def seconds_needed(self, term: Literal["B", "K"], value: float) -> float:
        """Length of a still record that would show a coefficient of this value nine times in ten, s."""
        white = self.N.value if self.N.visible else self.N.high
        if term == "B":
            return FLICKER_IN_WHITE * (white / value) ** 2
        flicker = self.B.value if self.B.visible else 0.0
        return max(WALK_IN_WHITE * white / value, WALK_IN_FLICKER * (flicker / value) ** 2)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader should know besides the numbers, one sentence each."""
        from sequential.sensors.noise_words import notes

        return notes(self)


def curve(term: Term, value: float, tau: Array) -> Array:
    """Allan deviation of one term at averaging times τ."""
    factors = {
        "N": tau**-0.5,
        "B": np.full_like(tau, np.sqrt(2.0 * np.log(2.0) / np.pi)),
        "K": np.sqrt(tau / 3.0),
        "Q": np.sqrt(3.0) / tau,
        "R": tau / np.sqrt(2.0),
    }
    return np.asarray(abs(value) * factors[term])


def fit_noise(x: ArrayLike, rate: float, *, unit: str = "") -> NoiseFit:
    """Read the noise coefficients of one axis of a sensor at rest.

    Parameters
    ----------
    x : (N,) samples at equal intervals, N >= 64
    rate : Hz
    unit : of the samples, for texts

    Raises
    ------
    ShapeError, NotFiniteError, DataError
        also for a constant axis.
    NotConvergedError

    Notes
    -----
    Restricted maximum likelihood on the cosine transform of the samples, all five terms at once: the mean
    and a linear drift are projected out, so that a warm-up does not pass for a random walk.  Intervals are
    those of the profile likelihood.  The top of the spectrum is left out where a low-pass filter has bent it,
    and lines are left out wherever they stand.
    """
    series = read_series(x, rate, "noise fit")
    if np.ndim(x) != 1:
        raise ShapeError(
            f"fit_noise takes one axis of shape (N,), got {np.shape(x)}; call it for each column"
        )
    if len(series) < FEWEST:
        raise DataError(
            f"the noise fit needs {FEWEST} samples at least, got {len(series)}: record for "
            f"{FEWEST / rate:.3g} s or more"
        )
    if np.ptp(series) == 0.0:
        raise DataError(
            f"all {len(series)} samples are {series[0, 0]:g}: the axis is stuck, or its noise is below its "
            "resolution"
        )
    axis, spikes = without_spikes(np.ascontiguousarray(series[:, 0]))
    whole = cosine_spectrum(axis)
    if not whole.scale > STRAIGHT * np.ptp(axis):
        raise DataError(
            f"the {len(axis)} samples lie on a straight line; a sensor at rest has noise: is it one?"
        )
    spectrum, fit = usable(whole)
    scale = spectrum.scale
    units = scale * np.array([1 / rate, rate**-0.5, 1.0, rate**0.5])
    found: dict[str, Coefficient] = {}
    likely = fit.square.copy()
    for place, name in enumerate(COMPONENTS):
        low, high = profile(spectrum, fit, place)
        found[name] = _coefficient(np.array([fit.square[place] ** 0.5, low, high]) * units[place])
        likely[place] = high**2 if name == "K" else likely[place]
    found["R"] = _coefficient(np.array(drift(spectrum, likely)) * scale * rate)
    wrong = judge(spectrum, fit)
    top = 0.5 if spectrum.frequency[-1] == whole.frequency[-1] else float(spectrum.frequency[-1])
    return NoiseFit(
        **found,
        rate=rate,
        duration=len(axis) / rate,
        top=top * rate,
        lines=tuple((f * rate, rms * scale) for f, rms in spectrum.lines),
        misfit=None if wrong is None else (wrong[0] * rate, wrong[1] * rate, wrong[2]),
        smooth=moves_smoothly(spectrum, fit),
        spikes=spikes,
        repeats=float(np.mean(np.diff(axis) == 0.0)),
        unit=unit,
    )


def _coefficient(numbers: Array) -> Coefficient:
    """From the value and the ends of its interval."""
    value, low, high = (float(number) for number in numbers)
    visible = low > 0.0 or high < 0.0
    return Coefficient(value if visible else np.nan, low, high, visible)
