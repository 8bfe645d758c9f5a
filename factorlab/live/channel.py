"""The newest of a thing, handed from one thread to others."""

from __future__ import annotations

import threading
from typing import Generic, TypeVar

__all__ = ["Newest"]

Thing = TypeVar("Thing")


class Newest(Generic[Thing]):
    """A place for one thing: who puts never waits for who takes, and who takes gets the newest.

    Things are numbered from 1, so that each of many takers can ask for one that it has not seen.
    """

    def __init__(self) -> None:
        self._change = threading.Condition()
        self._thing: Thing | None = None
        self._number = 0
        self._taken = 0
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether nothing more comes."""
        return self._closed

    @property
    def number(self) -> int:
        """How many things were put here."""
        return self._number

    def put(self, thing: Thing) -> None:
        """Replace what is here."""
        with self._change:
            self._thing, self._number = thing, self._number + 1
            self._change.notify_all()

    def take(self, after: int, timeout_s: float) -> tuple[int, Thing] | None:
        """The newest thing and its number, which is larger than `after`; None when none came in time."""
        with self._change:
            self._change.wait_for(lambda: self._number > after or self._closed, timeout_s)
            if self._number <= after or self._thing is None:
                return None
            self._taken = self._number
            self._change.notify_all()
            return self._number, self._thing

    def wait_taken(self, timeout_s: float) -> bool:
        """Wait until somebody has taken the newest thing; False when nobody did in time."""
        with self._change:
            return self._change.wait_for(lambda: self._taken == self._number or self._closed, timeout_s)

    def close(self) -> None:
        """Wake everybody: nothing more comes."""
        with self._change:
            self._closed = True
            self._change.notify_all()
