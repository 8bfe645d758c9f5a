"""How a signal comes in and goes out: an array, stamps and an array, or a `Stream`."""

from __future__ import annotations

import abc
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import NotFiniteError, ShapeError, TimeOrderError
from sequential.log import Stream, numbers, seconds
from sequential.signal.response import Response

__all__ = ["Samples", "SignalFilter", "read_samples"]

Array = NDArray[np.float64]


class Samples(NamedTuple):
    """A signal as filters see it, and the way back to the form in which it came."""

    t: Array | None  # (N,) s; None where no stamps were given
    x: Array  # (N, m), NaN where a sample is missing
    give: Callable[[Array], Any]


def read_samples(who: str, *given: Any) -> Samples:
    """Take (x), (t, x) or (stream) apart.

    Parameters
    ----------
    who : name of the filter, for messages
    given : x (N,) or (N, m); or t (N,), float seconds or int nanoseconds, and x; or a `Stream`

    Raises
    ------
    ShapeError, TimeOrderError, NotFiniteError
        where lengths differ, stamps go backwards, or something is infinite (NaN is a missing sample).
    """
    if len(given) == 1 and isinstance(given[0], Stream):
        stream = given[0]
        own = _stamps(stream.t, who)
        return Samples(
            own, _values(stream.values, who), lambda y: Stream(stream.t, y, stream.context, stream.covers)
        )
    if len(given) not in {1, 2}:
        raise ShapeError(f"{who} is called on x, on t and x, or on a Stream; got {len(given)} arguments")
    x = _values(given[-1], who)
    flat = x.ndim == 1
    x = x[:, None] if flat else x
    stamps = _stamps(given[0], who) if len(given) == 2 else None
    if stamps is not None and len(stamps) != len(x):
        raise ShapeError(f"{who} was given {len(stamps)} stamps for {len(x)} samples; give one for each")
    return Samples(stamps, x, lambda y: y[:, 0] if flat else y)


def _values(given: ArrayLike, who: str) -> Array:
    x = numbers(given, f"the signal of {who}")
    if x.ndim not in {1, 2}:
        raise ShapeError(f"{who} takes a signal of shape (N,) or (N, m), got {x.shape}")
    if np.isinf(x).any():
        at = int(np.argwhere(np.isinf(x))[0, 0])
        raise NotFiniteError(f"{who} met infinity at sample {at}; write NaN where a sample is missing")
    return x


def _stamps(given: ArrayLike, who: str) -> Array:
    stamps = np.asarray(given)
    whole = np.issubdtype(stamps.dtype, np.integer)
    t = seconds(stamps, int(stamps[0]) if len(stamps) else 0) if whole else numbers(given, f"stamps of {who}")
    if t.ndim != 1:
        raise ShapeError(f"{who} takes stamps of shape (N,), got {t.shape}")
    if not np.isfinite(t).all():
        at = int(np.flatnonzero(~np.isfinite(t))[0])
        raise NotFiniteError(f"{who} met the stamp {t[at]} at sample {at}; stamps must be finite")
    if len(back := np.flatnonzero(np.diff(t) < 0)):
        k = int(back[0]) + 1
        raise TimeOrderError(
            f"{who} met stamps that go backwards at sample {k}: {t[k - 1]:.6f} s then {t[k]:.6f} s; sort them"
        )
    return t


class SignalFilter(abc.ABC):
    """A filter of one signal: frozen settings, called on a whole signal or stepped through sample by sample.

    `f(x)`, `f(t, x)` and `f(stream)` return what they were given, filtered; columns are filtered one by one.
    NaN is a missing sample: it is skipped, and the filter says there what it knows from the others.
    """

    @overload
    def __call__(self, stream: Stream, /) -> Stream: ...
    @overload
    def __call__(self, x: ArrayLike, /) -> Array: ...
    @overload
    def __call__(self, t: ArrayLike, x: ArrayLike, /) -> Array: ...

    def __call__(self, *given: Any) -> Any:
        """Filter a whole signal."""
        came = read_samples(type(self).__name__, *given)
        return came.give(self.filtered(came.t, came.x) if came.x.size else came.x)

    @abc.abstractmethod
    def filtered(self, t: Array | None, x: Array) -> Array:
        """Filter the columns of x (N, m), N >= 1."""

    @abc.abstractmethod
    def response(self, interval: float | None = None) -> Response:
        """What the filter does to a step and to noise.

        Parameters
        ----------
        interval : between samples, s; without it, filters that count samples answer in samples
        """

    @abc.abstractmethod
    def start(self) -> Any:
        """State before the first sample."""

    @abc.abstractmethod
    def step(self, state: Any, x: float, t: float | None = None) -> tuple[float, Any]:
        """Take one sample (and its stamp, s): the output and the next state.  States are never changed."""

    def online(self, samples: Iterable[float] | Iterable[tuple[float, float]]) -> Iterator[float]:
        """Filter samples as they come, numbers x or pairs (t, x): one output for each."""
        state = self.start()
        for sample in samples:
            t, x = sample if isinstance(sample, tuple) else (None, sample)
            y, state = self.step(state, x, t)
            yield y
