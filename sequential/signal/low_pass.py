"""The exponential low-pass: one number of memory, one of settings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, ModelError
from sequential.signal.response import REACHED, Response, require_interval, samples_until
from sequential.signal.samples import SignalFilter

__all__ = ["LowPass", "LowPassState", "held"]

Array = NDArray[np.float64]
SMALL = 1e-4  # of the step in time constants: below, the series is exact to 1e-13


class LowPassState(NamedTuple):
    """Output, last sample, its stamp and the stamp of the last call (s); NaN before the first sample."""

    y: float
    x: float
    t: float
    now: float


@final
@dataclass(frozen=True, slots=True)
class LowPass(SignalFilter):
    """First-order low-pass: y += a (x - y) with a = 1 - exp(-Δt/τ), exact at irregular stamps.

    Give one of the first three.

    Parameters
    ----------
    time_constant : τ, s: after it, 63 % of a step are made
    cutoff_hz : 1 / (2πτ), where the gain is 0.71
    coefficient : a, in ]0, 1].  With `interval`, a holds for samples that far apart, and other intervals get
        the a of the same τ; alone, it is applied to every sample whatever the stamps
    interval : between samples, s, for signals that come without stamps
    between : what the signal does between samples: `"hold"`, a sample holds since the one before (the
        textbook's recursion), or `"line"`, straight lines (then a ramp is late by τ exactly)

    Raises
    ------
    ModelError
        where not exactly one is given, or one is out of range.

    Notes
    -----
    It starts at the first sample.  A missing sample leaves the output where it was, and the next one counts
    for the whole pause.  For a small, τ ≈ interval / a.  `"line"` is equation 17 of Eckner 2012, Algorithms
    for unevenly-spaced time series.
    """

    time_constant: float | None = None
    cutoff_hz: float | None = None
    coefficient: float | None = None
    interval: float | None = None
    between: Literal["hold", "line"] = "hold"

    def __post_init__(self) -> None:
        given = [v for v in (self.time_constant, self.cutoff_hz, self.coefficient) if v is not None]
        if len(given) != 1 or not (given[0] > 0 and math.isfinite(given[0])):
            raise ModelError(
                "LowPass takes one of time_constant (s), cutoff_hz and coefficient, positive and finite; "
                f"got {self}"
            )
        if self.coefficient is not None and self.coefficient > 1:
            raise ModelError(f"LowPass's coefficient lies in ]0, 1], got {self.coefficient}")
        if self.interval is not None:
            require_interval(self.interval, None, "LowPass(interval=…)")
        if self.between not in {"hold", "line"}:
            raise ModelError(f"between samples a signal may 'hold' or run in a 'line', got {self.between!r}")

    @property
    def tau(self) -> float | None:
        """Time constant, s; None for a coefficient without an interval."""
        if self.cutoff_hz is not None:
            return 1.0 / (2.0 * math.pi * self.cutoff_hz)
        if self.coefficient is None:
            return self.time_constant
        return None if self.interval is None else self.interval / self._per_sample()

    def _per_sample(self) -> float:
        """Time constants that a sample counts for, where the coefficient says so."""
        a = float(self.coefficient or 0.0)
        return math.inf if a == 1.0 else -math.log1p(-a)

    def elapsed(self, dt: Array) -> Array:
        """Intervals (N,), s, in time constants."""
        if self.coefficient is not None and self.interval is None:
            return np.full(np.shape(dt), self._per_sample())
        tau = self.tau or 0.0  # zero where a = 1
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(np.asarray(dt) > 0, np.asarray(dt) / tau, 0.0))

    def _elapsed_once(self, dt: float) -> float:
        """The same for one interval, without NumPy's overhead."""
        tau = self.tau
        if tau is None:
            return self._per_sample()
        if dt <= 0.0:
            return 0.0
        return dt / tau if tau > 0.0 else math.inf

    def filtered(self, t: Array | None, x: Array) -> Array:
        """Filter the columns of x (N, m)."""
        if t is None:
            default = self.interval if self.coefficient is None else self.interval or 1.0
            step = require_interval(None, default, "LowPass on a signal without stamps")
            t = np.arange(len(x), dtype=np.float64) * step
        return np.column_stack([self._column(t, column) for column in x.T])

    def _column(self, t: Array, x: Array) -> Array:
        known = np.flatnonzero(~np.isnan(x))
        if not len(known):
            return x
        seen, q = x[known], self.elapsed(np.diff(t[known]))
        aim = seen[1:] + lag(q) * (seen[:-1] - seen[1:]) if self.between == "line" else seen[1:]
        return held(follow(float(seen[0]), aim.tolist(), (-np.expm1(-q)).tolist()), known, len(x))

    def start(self) -> LowPassState:
        """State before the first sample."""
        return LowPassState(math.nan, math.nan, math.nan, math.nan)

    def step(self, state: LowPassState, x: float, t: float | None = None) -> tuple[float, LowPassState]:
        """Take one sample; without t, it comes one `interval` after the sample before."""
        if t is None:
            if self.coefficient is None and self.interval is None:
                raise DataError(
                    "LowPass needs the stamp of a sample: step(state, x, t), or LowPass(interval=…)"
                )
            t = 0.0 if math.isnan(state.now) else state.now + (self.interval or 1.0)
        if math.isnan(x):
            return state.y, state._replace(now=t)
        if math.isnan(state.y):
            return x, LowPassState(x, x, t, t)
        q = self._elapsed_once(t - state.t)
        aim = x + float(lag(np.asarray(q))) * (state.x - x) if self.between == "line" else x
        y = state.y - math.expm1(-q) * (aim - state.y)
        return y, LowPassState(y, x, t, t)

    def response(self, interval: float | None = None) -> Response:
        """What it does to a step and to noise; `interval` is the filter's own unless given."""
        w, near, far = self._taps(interval)
        step = self._interval(interval)
        k = 0 if near >= REACHED else samples_until(math.log((1 - REACHED) / (1 - near)) / math.log(w))
        gain = math.sqrt(near**2 + (far + w * near) ** 2 / (1.0 - w * w))
        return Response(k * step, gain)

    def gain(self, hz: ArrayLike, interval: float | None = None) -> Array:
        """Amplitude out over in of a sine, (…)."""
        return np.abs(self._transfer(hz, interval))

    def phase_delay(self, hz: ArrayLike, interval: float | None = None) -> Array:
        """By how much the crests of a sine come late, s; arctan(2πfτ) / (2πf) for samples close together."""
        turn = 2.0 * np.pi * np.asarray(hz, dtype=np.float64)
        late = -np.angle(self._transfer(hz, interval))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(turn == 0, self.group_delay(hz, interval), late / turn))

    def group_delay(self, hz: ArrayLike, interval: float | None = None) -> Array:
        """By how much the envelope of a narrow band, or a slow ramp at 0 Hz, comes late, s."""
        w, near, far = self._taps(interval)
        step = self._interval(interval)
        back = np.exp(-2j * np.pi * np.asarray(hz, dtype=np.float64) * step)
        slopes = far * back / (near + far * back) + w * back / (1.0 - w * back)
        return np.asarray(slopes.real * step)

    def _transfer(self, hz: ArrayLike, interval: float | None) -> NDArray[np.complex128]:
        w, near, far = self._taps(interval)
        back = np.exp(-2j * np.pi * np.asarray(hz, dtype=np.float64) * self._interval(interval))
        return np.asarray((near + far * back) / (1.0 - w * back))

    def _interval(self, interval: float | None) -> float:
        counts = self.coefficient is not None and self.interval is None
        return require_interval(interval, 1.0 if counts else self.interval, "LowPass's response")

    def _taps(self, interval: float | None) -> tuple[float, float, float]:
        """(w, near, far) of y[k] = w y[k-1] + near x[k] + far x[k-1] at a steady interval."""
        q = self.elapsed(np.array([self._interval(interval)]))
        a = -math.expm1(-float(q[0]))
        far = a * float(lag(q)[0]) if self.between == "line" else 0.0
        return 1.0 - a, a - far, far


def lag(q: Array) -> Array:
    """1/q - 1/(e^q - 1): the weight of the earlier end of a straight line in what the filter follows."""
    small = np.abs(q) < SMALL
    safe = np.where(small, 1.0, q)
    with np.errstate(over="ignore"):
        return np.asarray(np.where(small, 0.5 - q / 12.0, 1.0 / safe - 1.0 / np.expm1(safe)))


def follow(y: float, aims: Sequence[float], weights: Sequence[float]) -> Array:
    """The recursion y += a (aim - y), from y on: (1 + len(aims),)."""
    path = [y]
    for aim, a in zip(aims, weights, strict=True):
        y += a * (aim - y)
        path.append(y)
    return np.array(path)


def held(values: Array, rows: NDArray[np.int64], count: int) -> Array:
    """(count,) values put at rows, each held until the next; NaN before the first."""
    last = np.searchsorted(rows, np.arange(count), side="right") - 1
    return np.where(last >= 0, values[np.maximum(last, 0)], np.nan)
