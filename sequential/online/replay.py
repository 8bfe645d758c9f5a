"""Events that come late: the beliefs of the last moments are kept, and what came after is done again.

A late reading is put where it belongs in time, and everything after it is replayed, so the estimate is that
of the sorted log and not an approximation of it.  Memory and work are bounded by the events in `max_delay`.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, NotFiniteError
from sequential.log import LONGEST, NS, nanoseconds
from sequential.model import StateSpace
from sequential.online.belief import Belief, Innovation
from sequential.online.driving import Driving
from sequential.online.online import Online
from sequential.online.ports import Port, ports_of, require_input, unknown_sensor
from sequential.online.tally import Summary, Tally

__all__ = ["Estimate", "Replay"]

Array = NDArray[np.float64]
INPUT = -1  # before the readings of the same moment; it drives what comes after them either way


class Estimate(NamedTuple):
    """What is known after an event."""

    t: int  # of the event, ns; the belief is that of the newest event, which is later where `late`
    belief: Belief
    innovation: Innovation | None  # None for inputs, for readings that wait for one, for what was left out
    late: bool  # something newer had come before it
    name: str  # of its stream
    used: bool  # False where it came more than max_delay late, or lies before the start


@dataclass(slots=True)
class _Event:
    """An event in its place in time; `belief` is what is known after it, None while it waits for an input."""

    t: int
    order: int
    serial: int
    port: Port | None
    z: Array
    context: Array | None = None
    noise: Array | None = None
    belief: Belief | None = None
    innovation: Innovation | None = None

    def __lt__(self, other: _Event) -> bool:
        return (self.t, self.order, self.serial) < (other.t, other.order, other.serial)


def _stamp(event: _Event) -> int:
    return event.t


class Replay:
    """A filter that hears of events in the order of their arrival.

    Parameters
    ----------
    filter, model : as for `Online`
    max_delay : seconds by which an event may come after a newer one; later ones are left out and counted
    covers : which interval a sample of the input stream holds for, `"after"` its stamp or `"before"` it
    max_gap : longest pause of the input stream, s; by default the larger of 1 s and 100 intervals

    Notes
    -----
    With `covers="before"` a reading that is newer than the newest input is estimated with that input, and
    again once the sample comes that covers it.  Without any input yet, readings wait for the first one.
    Events of one moment are taken in the order in which the model declares its sensors, as in `run`.
    """

    def __init__(
        self,
        filter: Any,  # noqa: A002 - the word of the field
        model: StateSpace,
        *,
        max_delay: float = 0.0,
        covers: str = "after",
        max_gap: float | None = None,
    ) -> None:
        if not max_delay >= 0.0:
            msg = f"max_delay is zero or more seconds, got {max_delay}"
            raise DataError(msg)
        self._online, self._model, self._ports = Online(filter, model), model, ports_of(model)
        self._delay = round(min(max_delay, LONGEST) * NS)
        self._driving = None if model.input is None else Driving(model.input, covers, max_gap)
        self._events: list[_Event] = []
        self._fixed = model.start_ns is not None  # else the first event in time is the start
        self._start = 0 if model.start_ns is None else model.start_ns
        self._root = self._now = self._online.start(self._start)
        self._newest: int | None = None
        self._serial = self._began = 0
        self._tally = Tally(max_delay)

    @property
    def belief(self) -> Belief:
        """The newest belief; the prior while nothing is known."""
        return self._now

    @property
    def summary(self) -> Summary:
        """What became of the events so far."""
        return self._tally.summary()

    def push(
        self,
        t: float,
        name: str,
        values: ArrayLike,
        context: ArrayLike | None = None,
        noise_cov: ArrayLike | None = None,
    ) -> Estimate:
        """Take an event in: a reading of a sensor, or a sample of the input stream.

        Parameters
        ----------
        t : when it was taken, float seconds or int nanoseconds; not when it came

        Raises
        ------
        MissingStreamError, ShapeError, DataError, NotFiniteError, GapError
        """
        stamp = t if type(t) is int else int(nanoseconds(t))
        event = self._checked(stamp, name, values, context, noise_cov)
        if self._newest is None:
            self._began = stamp
        newest = stamp if self._newest is None else self._newest
        late = stamp < newest
        if newest - stamp > self._delay:
            self._tally.reject(name, (newest - stamp) * 1e-9)
            return Estimate(stamp, self._now, None, late, name, used=False)
        self._open(stamp)
        self._newest = max(newest, stamp)
        if event.port is not None and stamp < self._start:
            self._tally.early[name] += 1
            return Estimate(stamp, self._now, None, late, name, used=False)
        if self._driving is not None and event.port is not None:
            self._driving.require_soon(self._began, self._newest, self._delay)
        self._insert(event)
        self._tally.used += 1
        self._tally.late += late
        self._forget(self._newest)
        return Estimate(stamp, self._now, event.innovation, late, name, used=True)

    def _checked(
        self, t: int, name: str, values: ArrayLike, context: ArrayLike | None, noise_cov: ArrayLike | None
    ) -> _Event:
        """An event in the shape that the model takes."""
        self._serial += 1
        if self._driving is not None and name == self._driving.name:
            given = require_input(self._model, values)
            if not np.isfinite(given).all():
                msg = f"{name!r} drives the process and is {given} at {t * 1e-9:.6f} s; leave that out"
                raise NotFiniteError(msg)
            return _Event(t, INPUT, self._serial, None, given.copy())
        port = self._ports.get(name)
        if port is None:
            raise unknown_sensor(self._model, name)
        z, known = port.values(values).copy(), port.known(context).copy()  # kept, so they must not change
        if np.isinf(z).any() or not np.isfinite(known).all():
            msg = f"a reading of {name!r} at {t * 1e-9:.6f} s is {z}; it must be finite, or NaN where missing"
            raise NotFiniteError(msg)
        self._tally.missing += bool(np.isnan(z).all())
        noise = None if noise_cov is None else port.noise(noise_cov)
        return _Event(t, port.index, self._serial, port, z, known, noise)

    def _open(self, t: int) -> None:
        """Place the prior at the first event in time, where the model does not say when it holds."""
        if not self._fixed and (self._newest is None or t < self._start):
            self._start = t
            self._root = self._online.start(t)
            self._replay(0)

    def _insert(self, event: _Event) -> None:
        """Put an event in its place and do again what it changes; out of it again where that fails."""
        first = len(self._events)
        if event.port is None and self._driving is not None:
            changed = self._driving.add(event.t, event.z)
            first = bisect_right(self._events, changed, key=_stamp)
        if event.t < self._start:
            self._replay(first)
            return
        at = bisect_left(self._events, event)
        self._events.insert(at, event)
        first = min(first, at)
        try:
            self._replay(first)
        except Exception:
            del self._events[at]
            self._replay(first)
            raise
        self._tally.replayed += len(self._events) - first - 1

    def _replay(self, first: int) -> None:
        """Estimate every event from one on."""
        belief: Belief | None = self._events[first - 1].belief if first else self._root
        for event in self._events[first:]:
            if belief is not None:
                belief = self._after(belief, event)
            event.belief = belief
            self._now = belief or self._now
        if not self._events:
            self._now = self._root

    def _after(self, belief: Belief, event: _Event) -> Belief | None:
        """The belief after an event, from the one before it; None where no input is known to lead there."""
        moved, u = event.t - belief.t, None
        if moved and self._driving is not None:
            if not len(self._driving):
                return None
            self._driving.require_no_gap(self._start, event.t)
            u = self._driving.over(belief.t, event.t)
        dt = moved * 1e-9
        if event.port is None:
            return self._online.predict(belief, dt, u).at(event.t) if moved else belief
        belief, event.innovation = self._online.step(
            belief, dt if moved else None, event.port.name, event.z, u, event.context, event.noise
        )
        return belief.at(event.t)

    def _forget(self, newest: int) -> None:
        """Drop the events that nothing can change any more."""
        horizon = newest - self._delay
        if self._driving is not None:
            horizon = self._driving.settled(horizon)
        done = 0
        for event in self._events:
            if event.t >= horizon or event.belief is None:
                break
            self._root, done = event.belief, done + 1
        if done:
            del self._events[:done]
            self._fixed = True
            if self._driving is not None:
                self._driving.forget(self._root.t)
