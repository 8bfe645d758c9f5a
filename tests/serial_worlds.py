"""Frames of every kind, and streams of bytes that hold them, for Hypothesis."""

import itertools
import math

from hypothesis import strategies as st

from sequential.readers.serial import (
    AngleFrame,
    BootFrame,
    QuaternionFrame,
    RawFrame,
    Status,
    encode,
    encode_line,
)

SEQUENCE, CLOCK = st.integers(0, 0xFFFF), st.integers(0, 2**32 - 1)
STATUS = st.integers(0, 255).map(Status)
COUNT = st.integers(-32768, 32767)
SMALL = COUNT.map(lambda count: count / 32768)


def several(one, count):
    return st.tuples(*[one] * count)


QUATERNIONS = st.builds(
    QuaternionFrame, SEQUENCE, CLOCK, several(COUNT.map(lambda c: c / 16384), 4), several(SMALL, 3), STATUS
)
TURNS = several(COUNT.map(lambda count: count * 2.0 * math.pi / 65536.0), 3)
ANGLES = st.builds(AngleFrame, SEQUENCE, CLOCK, TURNS, several(SMALL, 3), STATUS)
RAWS = st.builds(RawFrame, SEQUENCE, CLOCK, several(COUNT, 7), STATUS)
BYTE, WORD = st.integers(0, 255), st.integers(0, 0xFFFF)
BOOTS = st.builds(
    BootFrame,
    SEQUENCE,
    CLOCK,
    several(BYTE, 3),
    st.sampled_from(["host", "mps2-an386", "stm32f4", "atmega328p", "unknown 77"]),
    st.sampled_from(["none", "mahony_q", "error_state_f32", "unknown 200"]),
    st.sampled_from(["unknown", "MPU-6050"]),
    WORD,
    st.integers(0, 2**32 - 1),
    WORD,
    BYTE,
)
FRAMES = st.one_of(QUATERNIONS, ANGLES, RAWS, BOOTS)

# lines carry hundredths of a degree and whole milliseconds
LINES = st.builds(AngleFrame, SEQUENCE, CLOCK, TURNS, st.none(), st.none())

HEADS = [b"\xa5", b"\xa5\x01\x0f", b"\xa5\x02\x0d", b"\xa5\x04\x0f", b"$", b"$ATT,", b"$ATT,1,2,0.00"]
# a frame cut before a last byte of 0xA5 would be completed by the start of the next one
CUT = BOOTS.map(encode).filter(lambda data: data[-1] != 0xA5).map(lambda data: data[:-1])
GARBAGE = st.one_of(st.binary(max_size=40), st.sampled_from(HEADS), CUT)


def bytes_of(frame):
    return encode_line(frame) if isinstance(frame, AngleFrame) and frame.bias is None else encode(frame)


def pieces(data, cuts):
    """The bytes, cut at these places."""
    places = sorted({0, len(data), *(cut % (len(data) + 1) for cut in cuts)})
    return [data[a:b] for a, b in itertools.pairwise(places)]
