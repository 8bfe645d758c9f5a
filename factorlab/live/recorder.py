"""A recording from a board: ask for a kind of frame, write what comes, count what does not."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from factorlab.live.rows import GrowingFile
from factorlab.live.serial_port import PortLostError, SerialPort
from factorlab.live.summary import Recorded
from factorlab.live.taker import Taker
from sequential.errors import DataError, ModelError

__all__ = ["MODES", "RecordSettings", "record_serial"]

MODES = {"raw": b"r", "quaternion": b"q", "angles": b"a", "text": b"t"}
BOOT = b"b"
SPEED_S = 0.6  # for a first frame at one speed, where bytes come
UNREAD = 100  # of them at least: a board that is being reset sends a few that mean nothing
ASK_S = 0.3  # between two requests: a board that is starting does not hear the first


@dataclass(frozen=True, slots=True)
class RecordSettings:
    """What to record, and for how long.

    Parameters
    ----------
    mode : `raw`, `quaternion`, `angles` or `text`: what the board is asked to send
    seconds : by the board's clock; None: until stopped
    wait : how long to wait for a first frame, and for the boot frame behind it, s
    """

    mode: str = "raw"
    seconds: float | None = None
    wait: float = 3.0

    def __post_init__(self) -> None:
        if self.mode not in MODES:
            raise ModelError(f"there is no mode {self.mode!r} of frames, only {', '.join(MODES)}")


def silent(seconds: float, samples: int, lost: int) -> None:
    """Tell nobody."""


def record_serial(
    port: SerialPort,
    path: Path,
    settings: RecordSettings | None = None,
    *,
    force: bool = False,
    stopped: Callable[[], bool] = lambda: False,
    tell: Callable[[float, int, int], None] = silent,
) -> Recorded:
    """Record what a board sends until it is enough, `stopped` says so, or the port goes away.

    Parameters
    ----------
    port : open
    path : of the file; `.tum` gives attitudes in the TUM format
    settings : by default raw samples without end
    force : replace a file that is there
    stopped : asked some twenty times a second
    tell : called with seconds, samples and losses so far, as often

    Raises
    ------
    DataError
        where no frame came in time, saying what came instead; or the file cannot be written.
    """
    settings = settings or RecordSettings()
    taker = Taker(settings.mode, settings.seconds, GrowingFile(path, force=force))
    try:
        ended = _listen(port, taker, settings, stopped, tell)
    except PortLostError as fault:
        ended = str(fault)
    finally:
        taker.close()
    if not taker.samples:
        raise DataError(ended or f"stopped before {port.name} sent a {settings.mode} frame")
    return taker.recorded(ended)


def _listen(
    port: SerialPort,
    taker: Taker,
    settings: RecordSettings,
    stopped: Callable[[], bool],
    tell: Callable[[float, int, int], None],
) -> str:
    """Take frames; returns what went wrong, empty where nothing did."""
    began, asked, heard = time.monotonic(), -math.inf, 0.0
    trial, patience = 0.0, min(SPEED_S, 0.5 * settings.wait)  # since the speed of the line was changed
    while not (stopped() or taker.full):
        elapsed = time.monotonic() - began
        if taker.wants and elapsed - asked >= ASK_S:
            asked = elapsed
            port.send(MODES[settings.mode] + BOOT)
        if data := port.receive():
            taker.feed(data, time.monotonic_ns())
            heard = elapsed
        if taker.unread > UNREAD and elapsed - trial > patience and port.next_speed():
            taker.unread, trial, asked = 0, elapsed, -math.inf
        if elapsed - trial > settings.wait:
            if not taker.samples:
                return f"{port.name} {taker.silence(port.tried)} (waited {elapsed:.1f} s)"
            taker.begin()
        if settings.seconds is not None and elapsed - heard > max(settings.wait, 1.0):
            return f"{port.name} has sent nothing for {elapsed - heard:.1f} s"
        tell(taker.seconds, taker.samples, taker.lost)
    return ""
