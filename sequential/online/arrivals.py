"""A log as its events would arrive, with delays to measure what lateness costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, MissingStreamError, ShapeError
from sequential.log import NS, SensorLog

__all__ = ["Arrivals", "Event", "arrivals"]

Array = NDArray[np.float64]
Delay = ArrayLike | Callable[[np.random.Generator, int], ArrayLike]


class Event(NamedTuple):
    """A reading, or a sample of the input stream."""

    t: int  # when it was taken, ns
    name: str  # of its stream
    values: ArrayLike
    context: ArrayLike | None = None
    noise_cov: ArrayLike | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Arrivals(Sequence[Event]):
    """Events in the order of their arrival; `at` (N,) ns is when each comes."""

    events: tuple[Event, ...]
    at: NDArray[np.int64]
    covers: Mapping[str, str]  # which interval a sample of each stream holds for

    def __len__(self) -> int:
        return len(self.events)

    @overload
    def __getitem__(self, index: int) -> Event: ...
    @overload
    def __getitem__(self, index: slice) -> Arrivals: ...
    def __getitem__(self, index: int | slice) -> Event | Arrivals:
        if isinstance(index, slice):
            return Arrivals(self.events[index], self.at[index], self.covers)
        return self.events[index]

    def __iter__(self) -> Iterator[Event]:
        return iter(self.events)

    @property
    def lateness(self) -> float:
        """The least `max_delay` in seconds with which no event is left out."""
        t = np.array([event.t for event in self.events], dtype=np.int64)
        return float((np.maximum.accumulate(t) - t).max(initial=0)) * 1e-9


def arrivals(
    log: SensorLog, delays: Mapping[str, Delay] | None = None, rng: np.random.Generator | None = None
) -> Arrivals:
    """The events of a log in the order in which they arrive.

    Parameters
    ----------
    delays : seconds from the stamp of a reading to its arrival, by stream: a number, (N,) one for each
        reading, or a function of (rng, N) that draws them; streams without one arrive at once
    rng : for delays that are drawn

    Raises
    ------
    MissingStreamError, ShapeError, DataError

    Examples
    --------
    >>> import numpy as np
    >>> import sequential as sq
    >>> log = sq.SensorLog({"gps": sq.Stream([0.0, 1.0], [5.0, 6.0]), "wheel": sq.Stream([0.1], [1.0])})
    >>> [event.name for event in sq.arrivals(log, {"gps": 0.2})]
    ['wheel', 'gps', 'gps']
    """
    log = log.check()
    given = {} if delays is None else delays
    if unknown := [name for name in given if name not in log]:
        msg = f"log {log.name!r} has no stream {unknown[0]!r} to delay; it has {', '.join(log)}"
        raise MissingStreamError(msg)
    events: list[Event] = []
    at = [np.zeros(0, dtype=np.int64)]
    for name, stream in log.streams.items():
        at.append(stream.t + _delays(name, given.get(name, 0.0), len(stream), rng))
        context = [None] * len(stream) if stream.context is None else list(stream.context)
        noise: Any = [None] * len(stream) if stream.noise_cov is None else list(stream.noise_cov)
        rows = zip(stream.t.tolist(), stream.values, context, noise, strict=True)
        events += [Event(t, name, values, known, cov) for t, values, known, cov in rows]
    when = np.concatenate(at)
    order = np.lexsort((np.array([event.t for event in events], dtype=np.int64), when))
    covers = {name: stream.covers for name, stream in log.streams.items()}
    when = when[order]
    when.flags.writeable = False
    return Arrivals(tuple(events[k] for k in order), when, covers)


def _delays(name: str, delay: Delay, count: int, rng: np.random.Generator | None) -> NDArray[np.int64]:
    """(N,) whole nanoseconds from stamp to arrival."""
    if callable(delay):
        if rng is None:
            msg = (
                f"the delays of {name!r} are drawn; give arrivals a rng, such as numpy.random.default_rng(1)"
            )
            raise DataError(msg)
        delay = delay(rng, count)
    drawn = np.asarray(delay, dtype=np.float64)
    if drawn.shape not in {(), (count,)}:
        msg = f"the delays of {name!r} must be one number or {count}, one for each reading, got {drawn.shape}"
        raise ShapeError(msg)
    if not (np.isfinite(drawn) & (drawn >= 0)).all():
        msg = f"the delays of {name!r} must be zero or more seconds, and finite"
        raise DataError(msg)
    return np.round(np.broadcast_to(drawn, count) * NS).astype(np.int64)
