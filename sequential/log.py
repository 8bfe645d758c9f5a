"""A sensor log: named streams of stamped readings, checked at the door and never changed afterwards."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import (
    DataError,
    MissingStreamError,
    NotFiniteError,
    NotPositiveDefiniteError,
    ShapeError,
    TimeOrderError,
)

__all__ = ["SensorLog", "Stream", "nanoseconds", "seconds"]

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
NS = 1_000_000_000
LONGEST = 9.2e9  # s: int64 nanoseconds end at 292 years


def nanoseconds(t: ArrayLike) -> Stamps:
    """Stamps as int64 nanoseconds: integers are taken as they are, floats are seconds.  Shape is kept.

    Raises
    ------
    NotFiniteError, DataError
        where a stamp is no number, or lies beyond 292 years of either side of zero.
    """
    stamps = np.asarray(t)
    if np.issubdtype(stamps.dtype, np.integer):
        return stamps.astype(np.int64)
    values = numbers(t, "stamps")
    if not np.all(np.isfinite(values)):
        at = int(np.flatnonzero(~np.isfinite(values))[0])
        msg = f"stamp {at} is {values.flat[at]}; every stamp must be a finite number of seconds"
        raise NotFiniteError(msg)
    if len(late := np.flatnonzero(np.abs(values) >= LONGEST)):
        msg = (
            f"stamp {late[0]} is {values.flat[late[0]]:.6g} s, which 64 bits of nanoseconds do not hold; "
            "floats are seconds: give nanoseconds as integers"
        )
        raise DataError(msg)
    whole = np.floor(values)  # in two parts: one product would lose the last digits of Unix seconds
    return whole.astype(np.int64) * NS + np.round((values - whole) * NS).astype(np.int64)


def seconds(t: ArrayLike, origin: int = 0) -> Array:
    """Nanosecond stamps as float seconds since `origin` (ns)."""
    return (np.asarray(t, dtype=np.int64) - origin).astype(np.float64) * 1e-9


def numbers(values: ArrayLike, what: str = "values") -> Array:
    """Own, contiguous array of floats; raises `DataError` where that cannot be made."""
    try:
        return np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError) as fault:
        msg = f"{what} must be an array of numbers, with rows of one length: {fault}"
        raise DataError(msg) from None


def frozen(values: ArrayLike) -> Array:
    """Own, contiguous, read-only copy; raises `DataError` where it does not hold numbers."""
    own = numbers(values)
    own.flags.writeable = False
    return own


def covariances(values: ArrayLike, count: int) -> Array:
    """(N, m, m) read-only covariances from as many, or from (N, m) variances.

    Raises
    ------
    ShapeError, NotPositiveDefiniteError
    """
    given = numbers(values, "noise_cov")
    if given.ndim == 2:
        given = given[:, :, None] * np.eye(given.shape[1])
    if given.ndim != 3 or given.shape[1] != given.shape[2] or len(given) != count:
        msg = f"{count} readings need noise_cov of shape ({count}, m, m), got {np.shape(values)}"
        raise ShapeError(msg)
    sound = np.isfinite(given).all(axis=(1, 2)) & (np.diagonal(given, axis1=1, axis2=2) > 0).all(axis=1)
    if sound.all():
        sound = np.linalg.eigvalsh(given).min(axis=1) > 0
    if not sound.all():
        at = int(np.flatnonzero(~sound)[0])
        raise NotPositiveDefiniteError(f"noise_cov of reading {at} is not a positive definite matrix")
    return frozen(0.5 * (given + np.swapaxes(given, 1, 2)))


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """Readings of one sensor.

    Parameters
    ----------
    t : (N,) int64 nanoseconds, or floats in seconds
    values : (N, m) or (N,), SI units
    context : (N, c), what is known about each reading, such as the index of the landmark that was seen
    covers : for a stream that drives a process: does a sample hold for the interval `"after"` its
        stamp (until the next one) or `"before"` it (since the previous one)?
    noise_cov : (N, m, m) or (N, m) variances, where every reading brings its own; in place of the sensor's

    Notes
    -----
    NaN in `values` says that a component of a reading is missing.
    """

    t: Stamps
    values: Array
    context: Array | None = None
    covers: Literal["after", "before"] = "after"
    noise_cov: Array | None = None

    def __post_init__(self) -> None:
        t = np.atleast_1d(nanoseconds(self.t)).copy()
        t.flags.writeable = False
        values = frozen(self.values)
        values = values[:, None] if values.ndim == 1 else values
        if values.ndim != 2 or len(values) != len(t):
            msg = f"{len(t)} stamps need values of shape ({len(t)}, m), got {np.shape(self.values)}"
            raise ShapeError(msg)
        if self.covers not in {"after", "before"}:
            msg = f"a sample covers the interval 'after' its stamp or 'before' it, got {self.covers!r}"
            raise DataError(msg)
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "values", values)
        if self.context is not None:
            context = frozen(self.context)
            context = context[:, None] if context.ndim == 1 else context
            if context.ndim != 2 or len(context) != len(t):
                msg = f"{len(t)} stamps need a context of shape ({len(t)}, c), got {np.shape(self.context)}"
                raise ShapeError(msg)
            object.__setattr__(self, "context", context)
        if self.noise_cov is not None:
            object.__setattr__(self, "noise_cov", covariances(self.noise_cov, len(t)))

    def __len__(self) -> int:
        return len(self.t)

    def select(self, rows: NDArray[Any]) -> Stream:
        """The readings that a mask or an index array names."""
        context = None if self.context is None else self.context[rows]
        noise = None if self.noise_cov is None else self.noise_cov[rows]
        return Stream(self.t[rows], self.values[rows], context, self.covers, noise)

    def keys(self) -> NDArray[np.float64]:
        """(N, c) what tells readings of equal stamp apart: the context, or nothing."""
        return np.zeros((len(self), 0)) if self.context is None else self.context

    def finite(self) -> NDArray[np.bool_]:
        """(N,) True where values and context are numbers."""
        return np.asarray(np.isfinite(np.hstack([self.values, self.keys()])).all(axis=1))

    def repeated(self) -> NDArray[np.bool_]:
        """(N,) True where stamp and context repeat an earlier reading's."""
        table = np.column_stack([self.t - (self.t[0] if len(self) else 0), self.keys()])
        _, first = np.unique(table, axis=0, return_index=True)
        repeat = np.ones(len(self), dtype=bool)
        repeat[first] = False
        return repeat


@dataclass(frozen=True, slots=True, eq=False)
class SensorLog(Mapping[str, Stream]):
    """Named streams of one recording; `log["gps"].values` is (N, m).

    Building one checks every stream: finite values, stamps that do not go backwards, no reading twice.
    Raises `NotFiniteError`, `TimeOrderError` or `ShapeError`, each naming stream, sample and remedy.
    `SensorLog.unchecked` skips the checks, so that a messy recording can be mended, as in
    `SensorLog.unchecked(streams).finite().sorted().unique().check()`.
    """

    streams: Mapping[str, Stream]
    name: str = "log"
    checked: bool = field(default=True, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "streams", dict(self.streams))
        if wrong := [name for name, stream in self.streams.items() if not isinstance(stream, Stream)]:
            msg = (
                f"log[{wrong[0]!r}] is a {type(self.streams[wrong[0]]).__name__}; "
                "a log is made of streams: Stream(t, values)"
            )
            raise DataError(msg)
        if self.checked:
            for name, stream in self.streams.items():
                check_stream(name, stream)

    @classmethod
    def unchecked(cls, streams: Mapping[str, Stream], name: str = "log") -> SensorLog:
        """A log as it came, to be mended by `sorted()`, `finite()` or `unique()`; `run` checks it."""
        return cls(streams, name, checked=False)

    def check(self) -> SensorLog:
        """The same log, every stream checked: the end of mending."""
        return self if self.checked else SensorLog(self.streams, self.name)

    def __getitem__(self, name: str) -> Stream:
        if name not in self.streams:
            known = ", ".join(sorted(self.streams)) or "none"
            msg = f"log {self.name!r} has no stream {name!r}; it has {known}"
            raise MissingStreamError(msg)
        return self.streams[name]

    def __contains__(self, name: object) -> bool:
        return name in self.streams

    def __iter__(self) -> Iterator[str]:
        return iter(self.streams)

    def __len__(self) -> int:
        return len(self.streams)

    def _each(self, change: Any) -> SensorLog:
        streams = {name: change(stream) for name, stream in self.streams.items()}
        return SensorLog(streams, self.name, self.checked)

    def sorted(self) -> SensorLog:
        """Every stream in the order of its stamps (stable)."""
        return self._each(lambda s: s.select(np.argsort(s.t, kind="stable")))

    def unique(self) -> SensorLog:
        """Without readings whose stamp and context came before."""
        return self._each(lambda s: s.select(~s.repeated()))

    def finite(self) -> SensorLog:
        """Without readings that hold NaN or infinity."""
        return self._each(lambda s: s.select(s.finite()))

    def replaced(self, **streams: Stream) -> SensorLog:
        """The same log with some streams exchanged or added."""
        return SensorLog({**self.streams, **streams}, self.name, self.checked)

    def without(self, *names: str) -> SensorLog:
        """The same log without some streams."""
        return replace(self, streams={k: s for k, s in self.streams.items() if k not in names})

    def between(self, start: int | None = None, stop: int | None = None) -> SensorLog:
        """Readings with start <= t <= stop (ns)."""
        low = np.iinfo(np.int64).min if start is None else start
        high = np.iinfo(np.int64).max if stop is None else stop
        return self._each(lambda s: s.select((s.t >= low) & (s.t <= high)))

    def span(self) -> tuple[int, int]:
        """First and last stamp of all streams, ns."""
        filled = [s.t for s in self.streams.values() if len(s)]
        if not filled:
            msg = f"log {self.name!r} holds no reading at all"
            raise MissingStreamError(msg)
        return min(int(t[0]) for t in filled), max(int(t[-1]) for t in filled)

    def hold_out(self, name: str, every: int) -> tuple[SensorLog, Stream]:
        """Keep one reading in `every` of a stream; return the thinner log and the readings held out.

        The kept readings are number `every`-1, 2·`every`-1 … counted from zero.
        """
        stream = self[name]
        if every < 1:
            msg = f"one reading in {every} cannot be kept; give 1 or more"
            raise ShapeError(msg)
        kept = (np.arange(len(stream)) + 1) % every == 0
        return self.replaced(**{name: stream.select(kept)}), stream.select(~kept)


def check_stream(name: str, stream: Stream) -> None:
    """Raise if a stream holds infinities, runs backwards or says a thing twice; NaN is a missing value."""
    bad = np.isinf(stream.values).any(axis=1) | ~np.isfinite(stream.keys()).all(axis=1)
    if bad.any():
        at = int(np.flatnonzero(bad)[0])
        msg = (
            f"log[{name!r}] holds infinity, or NaN in its context, at sample {at} "
            f"(and {int(bad.sum()) - 1} more); drop such samples with log.finite()"
        )
        raise NotFiniteError(msg)
    back = np.flatnonzero(np.diff(stream.t) < 0)
    if len(back):
        k = int(back[0]) + 1
        before, now = stream.t[k - 1] * 1e-9, stream.t[k] * 1e-9
        msg = (
            f"log[{name!r}] goes backwards at sample {k}: {before:.6f} s then {now:.6f} s; "
            "sort it with log.sorted()"
        )
        raise TimeOrderError(msg)
    if len(stream) and not (np.diff(stream.t) > 0).all() and (repeat := stream.repeated()).any():
        k = int(np.flatnonzero(repeat)[0])
        msg = (
            f"log[{name!r}] repeats the stamp {stream.t[k] * 1e-9:.6f} s at sample {k} "
            f"({int(repeat.sum())} repeats in all); drop repeats with log.unique()"
        )
        raise TimeOrderError(msg)
