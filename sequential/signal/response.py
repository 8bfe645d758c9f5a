"""What a filter costs and what it brings: delay of a step, noise let through.  Stated, or measured."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sequential.errors import ModelError

__all__ = ["REACHED", "Response", "measure_noise_gain", "measure_step_delay", "require_interval"]

REACHED = 0.9  # of a step: where its delay is read
ROUNDING = 1e-9
LONGEST = 1 << 20  # samples after which a filter is taken never to arrive


@dataclass(frozen=True, slots=True)
class Response:
    """A filter in three numbers.

    Parameters
    ----------
    delay_90 : time from the first sample after a step until the output has made 90 % of it, s
    noise_gain : standard deviation of the output over that of the input, for white Gaussian noise
    lookahead : how much of the future an output needs, s; zero for a causal filter.  On line, an output is
        `delay_90 + lookahead` late.
    """

    delay_90: float
    noise_gain: float
    lookahead: float = 0.0


def require_interval(interval: float | None, default: float | None, who: str) -> float:
    """The interval between samples as given, or a filter's own; raises `ModelError` where there is none."""
    chosen = default if interval is None else interval
    if chosen is None or not (chosen > 0 and math.isfinite(chosen)):
        raise ModelError(f"{who} needs the interval between samples, a positive number of s; got {chosen}")
    return float(chosen)


def samples_until(share: float) -> int:
    """Whole samples that cover a number of them, forgiving rounding."""
    return max(0, math.ceil(share - ROUNDING))


def measure_step_delay(
    filtered: Callable[..., Any], interval: float = 1.0, *, settle: int = 64, reached: float = REACHED
) -> float:
    """Delay to 90 % of a step, from the output itself: for any function of (t, x), linear or not.

    Parameters
    ----------
    filtered : f(t (N,) s, x (N,)) -> (N,); every filter of this room is one
    interval : between samples, s
    settle : samples at rest before the step, at least; a filter with a long start needs more

    Raises
    ------
    ModelError
        where the output does not get there within a million samples.
    """
    length = settle
    while length <= LONGEST:
        x = np.repeat([0.0, 1.0], length)
        y = np.asarray(filtered(np.arange(2 * length) * interval, x))[length:]
        arrived = np.flatnonzero(y >= reached - ROUNDING)
        if len(arrived):
            return float(arrived[0]) * interval
        length *= 4
    raise ModelError(f"the output had not reached {reached:g} of a step after {LONGEST} samples")


def measure_noise_gain(
    filtered: Callable[..., Any],
    rng: np.random.Generator,
    interval: float = 1.0,
    *,
    samples: int = 100_000,
    settle: int = 2_000,
) -> float:
    """Standard deviation out over in, for white Gaussian noise, from the output itself.

    Parameters
    ----------
    filtered, interval : as in `measure_step_delay`
    samples : of noise; the relative error is about the square root of (correlated samples / 2 samples)
    settle : samples dropped at both ends
    """
    x = rng.standard_normal(samples + 2 * settle)
    y = np.asarray(filtered(np.arange(len(x)) * interval, x))
    inner = slice(settle, settle + samples)
    return float(np.std(y[inner]) / np.std(x[inner]))
