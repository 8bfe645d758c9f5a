"""Where the frames of a board belong in time, and which of them never came."""

from __future__ import annotations

from sequential.readers.serial_frames import BootFrame, Frame

__all__ = ["Timeline"]

SEQUENCES, CLOCK_US = 2**16, 2**32
SECOND_US = 1_000_000
SLACK = 100  # frames that a gap may hold beyond what its time says, before it is taken for a restart


class Timeline:
    """Counts lost frames and gives each one a stamp that only grows.

    The sequence number wraps after 65 536 frames (10.9 minutes at 100 Hz) and the clock after 2³² µs (71.6
    minutes); both are carried on. A gap longer than a round of sequence numbers is counted whole, because
    the clock says how long it was. A clock that runs backwards, or a boot frame with number 0, is a board
    that has started again: its frames are stamped on from the last one, and nothing counts as lost.

    Attributes
    ----------
    lost : frames whose numbers are missing
    restarts : of the board
    repeated : samples whose time is not later than that of the one before; they get no stamp
    """

    def __init__(self) -> None:
        self.lost = self.restarts = self.repeated = 0
        self._last: Frame | None = None
        self._t_us = 0
        self._arrival_ns: int | None = None
        self._period_us = 0.0
        self._sample_us = -1

    def place(self, frame: Frame, arrival_ns: int | None = None) -> int | None:
        """Give the stamp of a frame, ns of the board's clock, or None for one that came already.

        Parameters
        ----------
        frame : the next one of the line
        arrival_ns : when it came, by a clock that never runs backwards; tells how long a restart took
        """
        last, self._last = self._last, frame
        before, self._arrival_ns = self._arrival_ns, arrival_ns
        if last is None:
            self._t_us = frame.t_us
        else:
            waited = (arrival_ns - before) // 1000 if arrival_ns is not None and before is not None else 0
            self._advance(last, frame, waited)
        if isinstance(frame, BootFrame):
            return self._t_us * 1000
        if self._t_us <= self._sample_us:
            self.repeated += 1
            return None
        self._sample_us = self._t_us
        return self._t_us * 1000

    def _advance(self, last: Frame, frame: Frame, waited_us: int) -> None:
        steps = (frame.sequence - last.sequence) % SEQUENCES
        elapsed = (frame.t_us - last.t_us) % CLOCK_US
        if self._restarted(frame, steps, elapsed):
            self.restarts += 1
            self._t_us += max(waited_us, round(self._period_us), 1)
            return
        self._t_us += elapsed
        if self._period_us:
            steps += SEQUENCES * max(round((elapsed / self._period_us - steps) / SEQUENCES), 0)
        self.lost += max(steps - 1, 0)
        if steps == 1 and elapsed and not isinstance(frame, BootFrame) and not isinstance(last, BootFrame):
            self._period_us += (elapsed - self._period_us) * (0.1 if self._period_us else 1.0)

    def _restarted(self, frame: Frame, steps: int, elapsed: int) -> bool:
        if isinstance(frame, BootFrame) and frame.sequence == 0 and (steps != 1 or elapsed > SECOND_US):
            return True
        if elapsed >= CLOCK_US // 2:
            return True
        return bool(self._period_us) and steps > SLACK + 2.0 * elapsed / self._period_us
