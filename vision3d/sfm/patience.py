"""Long calls into COLMAP that a Ctrl-C, or a flag, ends early."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, TypeVar

from vision3d.sfm.library import colmap

__all__ = ["Patience", "Stopped"]

T = TypeVar("T")
TICK_S = 0.05


class Stopped(KeyboardInterrupt):
    """The work was asked to end before there was a result."""


class Patience:
    """Runs calls in a thread beside, so that this one hears a Ctrl-C.

    Parameters
    ----------
    stop : an event whose setting ends the work; None: only a KeyboardInterrupt does
    """

    def __init__(self, stop: threading.Event | None = None) -> None:
        self.stop = stop

    @property
    def over(self) -> bool:
        """Whether the work is to end."""
        return self.stop is not None and self.stop.is_set()

    def check(self) -> None:
        """Raise `Stopped` where the work is to end."""
        if self.over:
            raise Stopped

    def run(self, call: Callable[[Any], T]) -> T:
        """The result of `call(token)`; the token is cancelled when the work is to end.

        Raises
        ------
        Stopped
            where the call gave up because of that.
        """
        token = colmap().CancellationToken()
        outcome: list[T] = []
        faults: list[BaseException] = []

        def work() -> None:
            try:
                outcome.append(call(token))
            except BaseException as fault:  # noqa: BLE001 - handed to the caller below
                faults.append(fault)

        thread = threading.Thread(target=work, daemon=True)
        thread.start()
        try:
            while thread.is_alive():
                thread.join(TICK_S)
                if self.over:
                    token.cancel()
        except KeyboardInterrupt:
            token.cancel()
            thread.join()
            raise
        if faults and token.is_cancelled:
            raise Stopped from faults[0]
        if faults:
            raise faults[0]
        return outcome[0]
