"""The complementary filter: the short term of one sensor, the long term of another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import ModelError, NotFiniteError, ShapeError
from sequential.log import Stream
from sequential.manifold.so2 import wrap_angle
from sequential.signal.low_pass import held
from sequential.signal.response import REACHED, Response, require_interval, samples_until
from sequential.signal.samples import read_samples

__all__ = ["Complementary", "ComplementaryState"]

Array = NDArray[np.float64]


class ComplementaryState(NamedTuple):
    """Output, last rate, stamp of the last call and of the last slow reading (s)."""

    y: float
    rate: float
    now: float
    t: float


@final
@dataclass(frozen=True, slots=True)
class Complementary:
    """Low-pass one signal, high-pass another of the same quantity, and add: the two filters make one.

    Called with a rate, such as a gyro's, the fast signal is its integral (trapezoidal), and the recursion is
    the textbook's angle = (1 - a) (angle + ω Δt) + a · accelerometer, with a = 1 - exp(-Δt/τ) at irregular
    stamps.

    Parameters
    ----------
    time_constant : τ, s: quicker changes come from the fast signal, slower ones from the slow signal
    angle : signals are angles, rad: differences take the short way round, and the output lies in ]-π, π]

    Raises
    ------
    ModelError
        where the time constant is not a positive number.

    Notes
    -----
    A motion that both sensors see is neither late nor damped.  A bias b of the rate stays in the output as
    b·τ (see `bias_error`); it does not grow.
    """

    time_constant: float
    angle: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.time_constant < math.inf:
            raise ModelError(
                f"Complementary's time constant is a positive number of s, got {self.time_constant}"
            )

    def __call__(self, *slow: Any, rate: Any = None, fast: Any = None) -> Any:
        """Blend whole signals.

        Parameters
        ----------
        slow : t (N,) and x (N,) or (N, m); or a `Stream`.  NaN where the slow sensor did not read
        rate : the derivative of the fast signal: an array of the same shape, or a `Stream` of the same stamps
        fast : the fast signal itself, instead of its rate

        Returns
        -------
        (N,) or (N, m), or a `Stream`; NaN before the first slow reading

        Raises
        ------
        ShapeError, NotFiniteError
            where the signals do not fit together, or the fast one has gaps.
        """
        came = read_samples("Complementary", *slow)
        if came.t is None:
            raise ShapeError("Complementary needs stamps: call it on t and x, or on a Stream")
        if (rate is None) == (fast is None):
            raise ShapeError("Complementary needs the fast signal as rate=… or as fast=…, one of the two")
        quick = self._beside(came.t, came.x, slow[0], rate if fast is None else fast)
        if fast is None:
            steps = 0.5 * (quick[1:] + quick[:-1]) * np.diff(came.t)[:, None]
            quick = np.vstack([np.zeros((1, quick.shape[1])), np.cumsum(steps, axis=0)])
        columns = [self._column(came.t, s, f) for s, f in zip(came.x.T, quick.T, strict=True)]
        return came.give(np.column_stack(columns))

    def _beside(self, t: Array, x: Array, slow: Any, given: Any) -> Array:
        """The fast signal in the shape of the slow one."""
        if isinstance(given, Stream):
            if not (isinstance(slow, Stream) and np.array_equal(slow.t, given.t)):
                raise ShapeError(
                    "Complementary blends streams of the same stamps; put the slow one on the stamps of the "
                    "fast one, with NaN where it did not read"
                )
            given = given.values
        quick = np.asarray(given, dtype=np.float64)
        quick = quick[:, None] if quick.ndim == 1 else quick
        if quick.shape != x.shape:
            raise ShapeError(f"the slow signal has shape {x.shape}, the fast one {quick.shape}")
        if not np.isfinite(quick).all():
            at = int(np.argwhere(~np.isfinite(quick))[0, 0])
            raise NotFiniteError(
                f"the fast signal holds NaN or infinity at sample {at}; it must have no gaps"
            )
        return quick

    def _column(self, t: Array, slow: Array, fast: Array) -> Array:
        """What the slow signal has over the fast one, low-passed, on top of the fast one."""
        known = np.flatnonzero(~np.isnan(slow))
        if not len(known):
            return slow
        weights = -np.expm1(-np.diff(t[known], prepend=t[known[0]]) / self.time_constant)
        over = (slow - fast)[known]
        path, y = [], float(over[0])
        for aim, a in zip(over.tolist(), weights.tolist(), strict=True):
            y += a * self._difference(aim, y)
            path.append(y)
        blended = fast + held(np.array(path), known, len(slow))
        return wrap_angle(blended) if self.angle else blended

    def _difference(self, aim: float, y: float) -> float:
        return math.remainder(aim - y, math.tau) if self.angle else aim - y

    def start(self) -> ComplementaryState:
        """State before the first sample."""
        return ComplementaryState(math.nan, math.nan, math.nan, math.nan)

    def step(
        self, state: ComplementaryState, t: float, slow: float, rate: float
    ) -> tuple[float, ComplementaryState]:
        """Take a slow reading (NaN: none) and a rate, both at t (s): the output and the next state."""
        y, last, gain = state.y, state.t, 1.0
        if not math.isnan(y):
            y += 0.5 * (state.rate + rate) * (t - state.now)
            gain = -math.expm1(-(t - last) / self.time_constant)
        if not math.isnan(slow):
            y, last = slow if math.isnan(y) else y + gain * self._difference(slow, y), t
        if self.angle:
            y = float(wrap_angle(np.asarray(y)))
        return y, ComplementaryState(y, rate, t, last)

    def response(self, interval: float) -> Response:
        """What it does to a step and to noise of the slow signal alone, as a low-pass."""
        keep = self._keep(interval)
        late = samples_until(math.log(1 - REACHED) / math.log(keep)) - 1 if keep > 0 else 0
        return Response(max(late, 0) * interval, math.sqrt((1 - keep) / (1 + keep)))

    def rate_noise_gain(self, interval: float) -> float:
        """Standard deviation of the output over that of white noise in the rate, s."""
        keep = self._keep(interval)
        return keep * interval / math.sqrt(2.0 * (1.0 - keep))

    def bias_error(self, bias: ArrayLike, interval: float) -> Array:
        """What a constant bias of the rate leaves in the output: bias · τ for samples close together."""
        keep = self._keep(interval)
        return np.asarray(np.asarray(bias, dtype=np.float64) * interval * keep / (1.0 - keep))

    def _keep(self, interval: float) -> float:
        return math.exp(-require_interval(interval, None, "Complementary") / self.time_constant)
