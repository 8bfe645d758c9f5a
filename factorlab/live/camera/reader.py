"""Frames from a source at the pace of the source, in a thread of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from factorlab.live.channel import Newest
from vision3d.frames import Frame, FrameSource, open_frames

__all__ = ["Captured", "FrameReader"]

LATE_NS = 200_000_000  # a file that is read more slowly than it plays plays more slowly


@dataclass(frozen=True)
class Captured:
    """A frame, with the time at which it came by this computer's monotonic clock."""

    frame: Frame
    captured_ns: int


class FrameReader:
    """Puts frames where the worker takes them.

    A file plays at its own speed, and frames for which the worker has no time are passed over, as with a
    camera; with `fast` it plays as quickly as the worker takes every frame.  No photograph is passed over.

    Parameters
    ----------
    source : open; opened again by its name for `again`
    taken : told of every frame, before the worker gets it
    """

    def __init__(
        self, source: FrameSource, *, fast: bool = False, taken: Callable[[Captured], object] = id
    ) -> None:
        self.source, self.frames = source, Newest[Captured]()
        self.ended = threading.Event()
        self.count = 0
        self.laps = 1
        self._fast, self._taken = fast and not source.live, taken
        self._going, self._stop, self._again = threading.Event(), threading.Event(), threading.Event()
        self._going.set()
        self._thread = threading.Thread(target=self._run, name="frames", daemon=True)

    def start(self) -> None:
        """Begin to read."""
        self._thread.start()

    @property
    def paused(self) -> bool:
        """Whether frames are held back."""
        return not self._going.is_set()

    def pause(self, *, on: bool) -> None:
        """Hold frames back: those of a file wait, those of a camera pass."""
        (self._going.clear if on else self._going.set)()

    def again(self) -> None:
        """Open a source that has ended once more, from its beginning.

        Raises
        ------
        DataError
            where it cannot be opened.
        """
        if not self.ended.is_set() or self._stop.is_set():
            return
        old = self.source
        wish = {"size": old.size} if old.live else {"fps": old.fps}
        self.source = open_frames(old.name, loop=old.loop, **wish)
        self.laps += 1
        self.ended.clear()
        self._going.set()
        self._again.set()

    def close(self) -> None:
        """Stop reading; a camera that is being waited for is given up after a while."""
        self._stop.set()
        self._going.set()
        self._again.set()
        self.frames.close()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                self._play()
            except Exception as fault:  # noqa: BLE001 - told as what ended the source, whatever it is
                self.source.fault = f"{self.source.name} broke off: {fault or type(fault).__name__}"
            self.ended.set()
            self._again.wait()
            self._again.clear()

    def _play(self) -> None:
        start_ns = 0  # of this computer's clock, when the source's is at 0
        with self.source as source:
            for frame in source:
                if not source.live:
                    start_ns = self._in_time(frame, start_ns)
                    if not self._going.is_set():
                        self._going.wait()
                        start_ns = 0
                if self._stop.is_set():
                    return
                if self._going.is_set():
                    self._hand_on(frame)

    def _hand_on(self, frame: Frame) -> None:
        captured = Captured(frame, time.monotonic_ns())
        self._taken(captured)
        self.count += 1
        self.frames.put(captured)
        every = self._fast or self.source.stills
        while every and not (self._stop.is_set() or self.frames.wait_taken(0.2)):
            pass

    def _in_time(self, frame: Frame, start_ns: int) -> int:
        """Wait until the frame is due; returns the beginning by this computer's clock."""
        now = time.monotonic_ns()
        if self._fast:
            return start_ns
        if not start_ns or now > start_ns + frame.t_ns + LATE_NS:
            return now - frame.t_ns
        self._stop.wait(max(start_ns + frame.t_ns - now, 0) * 1e-9)
        return start_ns
