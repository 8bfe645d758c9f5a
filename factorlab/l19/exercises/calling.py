"""Calling a student's code: never longer than allowed, and whatever it raises becomes a fault of theirs."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

from factorlab.l19.exercises.fault import Stumble, TooLongError, fault_of

__all__ = ["Caller", "limited"]

SLEEPING = 4.0
AGAIN_S = 0.2  # a bare `except:` swallows one alarm, not those that follow


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise TooLongError in the code inside when its time is over; for the main thread.

    The time is that of the processor, so that a busy machine accuses nobody; what sleeps has four times as
    long by the clock.
    """

    def ring(number: int, frame: FrameType | None) -> None:
        raise TooLongError

    before = {of: signal.signal(of, ring) for of in (signal.SIGPROF, signal.SIGALRM)}
    signal.setitimer(signal.ITIMER_PROF, seconds, AGAIN_S)
    signal.setitimer(signal.ITIMER_REAL, SLEEPING * seconds, AGAIN_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for of, handler in before.items():
            signal.signal(of, handler)


class Caller:
    """Calls functions of one student's file.

    Parameters
    ----------
    path : Path
        The file, absolute: its lines are those that a fault shows.
    limit_s : float
        What one call may take.
    """

    def __init__(self, path: Path | str, limit_s: float = 3.0) -> None:
        self.path = Path(path)
        self.limit_s = limit_s

    def __call__(self, function: Callable[..., Any], *args: Any, limit_s: float | None = None) -> Any:
        """The value of function(*args).

        Raises
        ------
        Stumble
            with the fault, where the call raises, exits, or takes too long.
        """
        limit = self.limit_s if limit_s is None else limit_s
        try:
            with limited(limit):
                return function(*args)
        except (TooLongError, SystemExit, Exception) as error:  # noqa: BLE001 - the code is theirs
            raise Stumble(fault_of(error, self.path, limit)) from None

    def tried(self, function: Callable[..., Any], *args: Any) -> Any:
        """The value, or None where the call stumbles: for asking, not for judging."""
        try:
            return self(function, *args)
        except Stumble:
            return None
