"""Frames out of the bytes of a serial line, whatever else stands between them.

>>> decoder = SerialDecoder()
>>> for data in chunks:
...     for frame in decoder.feed(data):
...         ...

The bytes may be cut anywhere and hold anything: nothing is raised, no frame is made of bytes whose check
contradicts it, and after garbage the next intact frame is found, even where the garbage began like a frame.
"""

from __future__ import annotations

import re
from binascii import crc_hqx

from sequential.readers.serial_frames import (
    HEADER,
    PAYLOADS,
    START,
    AngleFrame,
    BootFrame,
    Frame,
    QuaternionFrame,
    RawFrame,
    Status,
    encode,
    parse,
)
from sequential.readers.serial_text import LARGEST, could_begin, encode_line, parse_line
from sequential.readers.serial_timeline import Timeline

__all__ = [
    "AngleFrame",
    "BootFrame",
    "Frame",
    "QuaternionFrame",
    "RawFrame",
    "SerialDecoder",
    "Status",
    "Timeline",
    "decode",
    "encode",
    "encode_line",
]

FIRST = re.compile(rb"[\xa5$]")
FORMS = {(kind, payload.size) for kind, payload in PAYLOADS.items()}
CHECK = 2  # bytes of the check
_Found = tuple[Frame | None, int]  # with the bytes that it takes; 0 asks for more of them


class SerialDecoder:
    """Turns the bytes of a line into frames, chunk by chunk.

    The frames do not depend on how the bytes are cut: of the places where an intact frame or line begins, the
    first one is taken, and the search goes on behind it.

    Attributes
    ----------
    frames : found so far
    corrupt : whole frames or lines whose check failed
    discarded : bytes that belong to no frame, those of corrupt ones among them
    """

    def __init__(self) -> None:
        self.frames = self.corrupt = self.discarded = 0
        self._rest = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Give the frames that are complete with these bytes."""
        return self._search(self._rest + data, ended=False)

    def finish(self) -> list[Frame]:
        """Give the frames behind an incomplete beginning: no more bytes will come to complete it."""
        return self._search(self._rest, ended=True)

    def _search(self, data: bytes, *, ended: bool) -> list[Frame]:
        found: list[Frame] = []
        at = 0
        while (place := FIRST.search(data, at)) is not None:
            self.discarded += place.start() - at
            at = place.start()
            frame, used = self._binary(data, at) if data[at] == START else self._line(data, at)
            if not used and not ended:
                self._rest = data[at:]
                return found
            if frame is None:
                at += 1
                self.discarded += 1
            else:
                at += used
                self.frames += 1
                found.append(frame)
        self.discarded += len(data) - at
        self._rest = b""
        return found

    def _binary(self, data: bytes, at: int) -> _Found:
        """The frame that begins at the start byte `data[at]`."""
        size = len(data) - at
        if size < 3:
            known = size < 2 or data[at + 1] in PAYLOADS
            return None, int(not known)
        kind, length = data[at + 1], data[at + 2]
        if (kind, length) not in FORMS:
            return None, 1
        end = at + HEADER.size + length
        if len(data) < end + CHECK:
            return None, 0
        if crc_hqx(data[at + 1 : end], 0xFFFF) != int.from_bytes(data[end : end + CHECK], "little"):
            self.corrupt += 1
            return None, 1
        _, _, _, sequence, t_us = HEADER.unpack_from(data, at)
        return parse(kind, sequence, t_us, data[at + HEADER.size : end]), end + CHECK - at

    def _line(self, data: bytes, at: int) -> _Found:
        """The line of text that begins at the dollar sign `data[at]`."""
        end = data.find(b"\n", at, at + LARGEST)
        if end < 0:
            return None, int(not could_begin(data[at : at + LARGEST]))
        frame, contradicted = parse_line(data[at : end + 1])
        self.corrupt += contradicted
        return frame, end + 1 - at


def decode(data: bytes) -> list[Frame]:
    """Give every frame of a whole stream, in order."""
    decoder = SerialDecoder()
    return decoder.feed(data) + decoder.finish()
