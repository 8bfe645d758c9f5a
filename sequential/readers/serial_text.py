"""Lines `$ATT,sequence,t_ms,roll,pitch,yaw*hh`: attitude in degrees, as a person reads it in a terminal."""

from __future__ import annotations

import math
import re
from functools import reduce
from operator import xor

from sequential.readers.serial_frames import AngleFrame

__all__ = ["LARGEST", "could_begin", "encode_line", "parse_line"]

LARGEST = 48  # characters of a line, its end included
BEGIN = b"$ATT,"
NUMBER = rb"(0|[1-9]\d{0,%d})"
DEGREES = rb"(-?(?:\d|[1-9]\d|1[0-7]\d)\.\d\d|-180\.00|180\.00)"
LINE = re.compile(
    rb"\$ATT," + NUMBER % 4 + b"," + NUMBER % 6 + b"," + b",".join([DEGREES] * 3) + rb"\*([0-9A-F]{2})\r\n"
)
INSIDE = re.compile(rb"[-0-9.,]*(?:\*[0-9A-F]{0,2})?\r?")
CLOCK_MS = 2**32 // 1000  # the last whole millisecond before the board's clock wraps


def could_begin(data: bytes) -> bool:
    """Whether a line may begin with these bytes, which hold no line feed."""
    if len(data) < len(BEGIN):
        return BEGIN.startswith(data)
    return len(data) < LARGEST and data.startswith(BEGIN) and INSIDE.fullmatch(data, len(BEGIN)) is not None


def parse_line(line: bytes) -> tuple[AngleFrame | None, bool]:
    """Read a whole line, line feed included.

    Returns
    -------
    The frame, or None; and whether it is a line in form but its checksum contradicts it.
    """
    found = LINE.fullmatch(line)
    if found is None:
        return None, False
    sequence, t_ms = int(found[1]), int(found[2])
    if sequence > 0xFFFF or t_ms > CLOCK_MS:
        return None, False
    if int(found[6], 16) != _checksum(line[1 : found.end(5)]):
        return None, True
    roll, pitch, yaw = (math.radians(float(found[k])) for k in (3, 4, 5))
    return AngleFrame(sequence, t_ms * 1000, (roll, pitch, yaw), None, None), False


def encode_line(frame: AngleFrame) -> bytes:
    """Give the line that firmware/core/text.c writes: angles rounded to 2π/65536 first, then to 0.01°."""
    degrees = []
    for angle in frame.roll_pitch_yaw:
        turn = (math.floor(angle * 32768.0 / math.pi + 0.5) + 32768) % 65536 - 32768
        hundredths = (abs(turn) * 1125 + 1024) >> 11
        sign = "-" if turn < 0 and hundredths else ""
        degrees.append(f"{sign}{hundredths // 100}.{hundredths % 100:02d}")
    inside = f"ATT,{frame.sequence},{frame.t_us // 1000},{','.join(degrees)}".encode()
    return b"$" + inside + f"*{_checksum(inside):02X}\r\n".encode()


def _checksum(data: bytes) -> int:
    return reduce(xor, data, 0)
