"""What a filter is worth on recordings whose truth is known: errors, delay, robustness, honesty."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factorlab.l19.challenge.trials import WARM_UP, Trial

__all__ = ["Filter", "Measures", "Pair", "measure", "measured_filter", "readings_for", "step_pairs"]

Array = NDArray[np.float64]
Filter = Callable[[Array, Array], Array]
Pair = tuple[Array, Array]

STEP_C, STEP_AT, STEP_LENGTH, STEP_BASE_C = 1.0, 100, 200, 20.0
STEP_DRAWS = 8  # the same noise with and without the step; their mean difference is the response
STEP_SIGMA = 0.5
REACHED = 0.9
NEVER_S = float(STEP_LENGTH - STEP_AT)


@dataclass(frozen=True, slots=True)
class Measures:
    """A filter in five numbers.

    Parameters
    ----------
    ramp, plateau : root mean square errors, °C, each trial counting the same
    delay_s : time until a step of 1 °C (two σ) has been made to 90 %; never is `NEVER_S`
    outlier : largest change that the outlier makes in the estimates, °C, mean of the trials
    nees : mean of (error / σ)² where the filter gives its own σ, else None; 1 is expected
    """

    ramp: float
    plateau: float
    delay_s: float
    outlier: float
    nees: float | None = None


def readings_for(trials: Sequence[Trial]) -> list[Pair]:
    """Every (t, z) that a filter is given to be measured, in the order that `measure` wants back."""
    whole = [(trial.t, trial.z) for trial in trials]
    clean = [(trial.t, trial.without_outlier) for trial in trials]
    return [*whole, *clean, *step_pairs()]


def step_pairs() -> list[Pair]:
    """Noise about a constant, then the same noise with a step of 1 °C at STEP_AT: 2 STEP_DRAWS readings."""
    t = np.arange(STEP_LENGTH, dtype=np.float64)
    noise = STEP_SIGMA * np.random.default_rng(7).standard_normal((STEP_DRAWS, STEP_LENGTH))
    still = STEP_BASE_C + noise
    return [(t, z) for z in (*still, *(still + STEP_C * (t >= STEP_AT)))]


def measure(trials: Sequence[Trial], outputs: Sequence[Array]) -> Measures:
    """What the outputs (N,) or (N, 2) for `readings_for(trials)` are worth."""
    values = [one if one.ndim == 1 else one[:, 0] for one in outputs]
    count = len(trials)
    seen = list(zip(trials, values[:count], values[count : 2 * count], strict=True))
    with_sigma = outputs[0].ndim == 2
    return Measures(
        ramp=float(np.mean([_rms((x - trial.truth)[trial.ramp]) for trial, x, _ in seen])),
        plateau=float(np.mean([_rms((x - trial.truth)[trial.plateau]) for trial, x, _ in seen])),
        delay_s=_delay(values[2 * count :]),
        outlier=float(np.mean([np.abs(x - clean).max() for _, x, clean in seen])),
        nees=_nees(trials, outputs[:count]) if with_sigma else None,
    )


def measured_filter(smooth: Filter, trials: Sequence[Trial]) -> Measures:
    """The same for a function of (t, z) that can be called here."""
    return measure(trials, [np.asarray(smooth(t, z)) for t, z in readings_for(trials)])


def _rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))


def _delay(values: Sequence[Array]) -> float:
    """Seconds until the mean response to the step stays above 90 %.

    The difference between the same noise with and without the step is, for a linear filter, the response
    itself; for another one it is so in the mean.
    """
    still, stepped = np.array(values[:STEP_DRAWS]), np.array(values[STEP_DRAWS:])
    response = np.mean(stepped - still, axis=0)[STEP_AT:] / STEP_C
    arrived = np.flatnonzero(response >= REACHED - 1e-9)
    return float(arrived[0]) if len(arrived) else NEVER_S


def _nees(trials: Sequence[Trial], outputs: Sequence[Array]) -> float:
    """Mean of (error / σ)² once the filter has begun."""
    each = [
        ((x[:, 0] - trial.truth) / x[:, 1])[WARM_UP:] ** 2 for trial, x in zip(trials, outputs, strict=True)
    ]
    return float(np.mean(each))
