"""Frames go in, lines of a file and counts come out."""

from __future__ import annotations

import time
from array import array

import numpy as np

from factorlab.live.rows import GrowingFile, Row, rows_of
from factorlab.live.summary import Recorded, timing_of
from sequential.readers.serial import (
    AngleFrame,
    BootFrame,
    Frame,
    QuaternionFrame,
    RawFrame,
    SerialDecoder,
    Status,
    Timeline,
)

__all__ = ["Taker"]

COUNTED = {"missing": Status.SAMPLE_MISSING, "saturated": Status.SATURATED, "dropped": Status.OVERRUN}


class Taker:
    """What is kept of a line that sends frames of several kinds.

    Counting begins with the first frame of the kind wanted: what came before it belongs to another mode, or
    is the end of a frame that had begun before the port was opened.

    Parameters
    ----------
    mode : `raw`, `quaternion`, `angles` or `text`
    wanted_s : seconds to take, by the board's clock; None: all
    file : to write to

    Attributes
    ----------
    unread : bytes, while there was not one frame among them; whoever changes the speed sets it to 0
    """

    def __init__(self, mode: str, wanted_s: float | None, file: GrowingFile) -> None:
        self._mode, self._wanted_s, self._file = mode, wanted_s, file
        self._decoder, self._timeline = SerialDecoder(), Timeline()
        self._boot: BootFrame | None = None
        self._row: Row | None = None
        self._early: list[tuple[int, Frame]] = []  # samples before the boot frame, which gives their scale
        self._stamps, self._arrivals = array("q"), array("q")
        self._before: tuple[int, int] | None = None  # corrupt frames and bytes of none, before the first
        self._counts = dict.fromkeys(COUNTED, 0)
        self._bytes = 0
        self._starting = False  # frames came, but no sample yet
        self.unread = 0
        self._other: Frame | None = None  # of another kind, and no wanted one since

    @property
    def samples(self) -> int:
        """Rows of the file, present and coming."""
        return len(self._stamps)

    @property
    def lost(self) -> int:
        """Frames that never came."""
        return self._timeline.lost

    @property
    def seconds(self) -> float:
        """From the first sample to the last, by the board's clock."""
        return (self._stamps[-1] - self._stamps[0]) * 1e-9 if self._stamps else 0.0

    @property
    def full(self) -> bool:
        """Whether the samples cover the seconds wanted, each standing for the time to the next."""
        if self._wanted_s is None or self.samples < 2 or self._row is None:
            return False
        return self.seconds + 1.5 * self.seconds / (self.samples - 1) >= self._wanted_s

    @property
    def wants(self) -> bool:
        """Whether the board has to be asked, once more or for the first time."""
        return self._boot is None or self._other is not None or self._before is None

    def feed(self, data: bytes, arrival_ns: int) -> None:
        """Take bytes that came at this time of a clock that never runs backwards."""
        self._bytes += len(data)
        frames = self._decoder.feed(data)
        self.unread = 0 if self._decoder.frames else self.unread + len(data)
        for frame in frames:
            self._take(frame, arrival_ns)

    def begin(self) -> None:
        """Write the head of the file and what waited for it; without a boot frame, raw samples are counts."""
        if self._row is None:
            head, self._row = rows_of(self._file.goal, self._mode, self._boot)
            self._file.write(head)
            for stamp, frame in self._early:
                self._file.write(self._row(stamp, frame))
            self._early.clear()

    def close(self) -> None:
        """Take what is complete and give the file its name; without a sample there is no file."""
        for frame in self._decoder.finish():
            self._take(frame, time.monotonic_ns())
        if self.samples:
            self.begin()
        self._file.close()

    def silence(self, tried: str) -> str:
        """What is wrong with a line on which no sample came."""
        if self._starting:
            return "sends frames, but its sensor gives no sample; check VCC, GND, SDA and SCL of the sensor"
        if self._other is not None:
            return (
                f"sends frames, but no {self._mode} frame though it was asked; does the board hear this "
                "computer (its RX pin)?"
            )
        if self._bytes:
            return (
                f"sent {self._bytes} bytes and no frame among them at {tried} bit/s; check --baud, and that "
                "the board runs this firmware"
            )
        return "sent nothing; is the firmware on the board, its TX pin connected, its supply on?"

    def recorded(self, ended: str) -> Recorded:
        """What the recording amounts to."""
        line = self._timeline
        stamps, arrivals = (np.array(values, dtype=np.int64) for values in (self._stamps, self._arrivals))
        corrupt, discarded = self._before or (0, 0)
        return Recorded(
            path=self._file.goal,
            mode=self._mode,
            samples=self.samples,
            duration_s=self.seconds,
            lost=line.lost,
            corrupt=self._decoder.corrupt - corrupt,
            discarded=self._decoder.discarded - discarded,
            **self._counts,
            repeated=line.repeated,
            restarts=line.restarts,
            board=self._boot,
            timing=timing_of(stamps, arrivals, whole=not line.restarts),
            ended=ended,
        )

    def _take(self, frame: Frame, arrival_ns: int) -> None:
        ours = self._is_ours(frame)
        if isinstance(frame, BootFrame):
            self._boot = frame
        else:
            self._other = None if ours else frame
        if ours and self._before is None:
            self._before = self._decoder.corrupt, self._decoder.discarded
        if self._before is None or self.full:
            return
        stamp = self._timeline.place(frame, arrival_ns)
        if ours and stamp is not None and self._is_sample(frame):
            self._keep(stamp, frame, arrival_ns)
        if self._boot is not None and self.samples:
            self.begin()

    def _keep(self, stamp: int, frame: Frame, arrival_ns: int) -> None:
        self._stamps.append(stamp)
        self._arrivals.append(arrival_ns)
        if self._row is None:
            self._early.append((stamp, frame))
        else:
            self._file.write(self._row(stamp, frame))

    def _is_ours(self, frame: Frame) -> bool:
        if self._mode == "raw":
            return isinstance(frame, RawFrame)
        if self._mode == "quaternion":
            return isinstance(frame, QuaternionFrame)
        return isinstance(frame, AngleFrame) and (frame.bias is None) == (self._mode == "text")

    def _is_sample(self, frame: Frame) -> bool:
        """Count what the status says; raw counts of a missing sample are those of an earlier one.

        A sensor that has given none yet is starting, which is no fault unless it never ends.
        """
        assert not isinstance(frame, BootFrame)  # noqa: S101 - those are never ours
        status = frame.status or Status(0)
        if status & Status.SAMPLE_MISSING and not self.samples:
            self._starting = True
            return False
        for name, bit in COUNTED.items():
            self._counts[name] += bool(status & bit)
        return not (self._mode == "raw" and status & Status.SAMPLE_MISSING)
