"""One verb for a live filter: stream(filter, model, events)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from sequential.model import StateSpace
from sequential.online.arrivals import Arrivals
from sequential.online.belief import Belief
from sequential.online.replay import Estimate, Replay
from sequential.online.tally import Summary

__all__ = ["Estimates", "stream"]


class Estimates(Iterator[Estimate]):
    """The estimates of a stream, one an event, made as they are asked for."""

    def __init__(self, replay: Replay, events: Iterable[Any]) -> None:
        self._replay, self._events = replay, iter(events)

    def __next__(self) -> Estimate:
        return self._replay.push(*next(self._events))

    @property
    def belief(self) -> Belief:
        """The newest belief."""
        return self._replay.belief

    @property
    def summary(self) -> Summary:
        """What became of the events so far; `summary.message` says what was left out."""
        return self._replay.summary


def stream(
    filter: Any,  # noqa: A002 - the word of the field
    model: StateSpace,
    events: Iterable[Any],
    *,
    max_delay: float = 0.0,
    covers: str | None = None,
    max_gap: float | None = None,
) -> Estimates:
    """Estimate while events arrive.

    Parameters
    ----------
    filter : as for `Online`
    events : in the order of their arrival, (t, name, values[, context[, noise_cov]]) with t in float seconds
        or int nanoseconds; `name` is a sensor of the model or its input stream; values may be NaN where a
        component is missing.  `arrivals(log)` makes them from a log
    max_delay : seconds by which an event may come after a newer one; it is then put where it belongs and what
        came after is done again, so that the end is that of the sorted log.  Later ones are left out and
        counted: see `summary` of what is returned
    covers : which interval a sample of the input holds for, `"after"` its stamp (default) or `"before"` it;
        events from `arrivals` know it
    max_gap : longest pause of the input that is bridged, s; by default the larger of 1 s and 100 intervals

    Returns
    -------
    Estimates
        an iterator of `Estimate(t, belief, innovation, late, name, used)`

    Raises
    ------
    DataError, ModelError
        see `sequential.errors`; each says what to do.

    Examples
    --------
    >>> import sequential as sq
    >>> cart = sq.StateSpace(
    ...     sq.Vector(2), sq.Gaussian([0.0, 1.0], [1.0, 1.0]), sq.ConstantVelocity(0.1),
    ...     {"position": sq.LinearSensor([[1.0, 0.0]], 0.25)}, start=0.0,
    ... )
    >>> arriving = [(0.1, "position", 0.12), (0.3, "position", 0.33), (0.2, "position", 0.2)]
    >>> estimates = sq.stream(sq.KalmanFilter(), cart, arriving, max_delay=0.5)
    >>> [(estimate.t, estimate.late) for estimate in estimates]
    [(100000000, False), (300000000, False), (200000000, True)]
    """
    known = events.covers.get(model.input or "", "after") if isinstance(events, Arrivals) else "after"
    replay = Replay(filter, model, max_delay=max_delay, covers=covers or known, max_gap=max_gap)
    return Estimates(replay, events)
