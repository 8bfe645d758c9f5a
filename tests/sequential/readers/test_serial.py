"""The decoder of a serial line: laws over every frame, any bytes and any cuts."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from serial_worlds import FRAMES, GARBAGE, LINES, bytes_of, pieces

from sequential.errors import DataError
from sequential.readers.serial import QuaternionFrame, SerialDecoder, Status, decode, encode, encode_line

CUTS = st.lists(st.integers(0, 10_000), max_size=12)
STREAM = st.lists(st.one_of(FRAMES.map(bytes_of), LINES.map(bytes_of), GARBAGE), max_size=8).map(b"".join)


def every_frame(data):
    """What a stream holds, by trying every place in it: the slow definition of `decode`."""
    found, at = [], 0
    while at < len(data):
        for end in range(at + 1, min(at + 48, len(data)) + 1):
            frames = decode(data[at:end])
            if len(frames) == 1 and len(bytes_of(frames[0])) == end - at:
                found += frames
                at = end
                break
        else:
            at += 1
    return found


@given(FRAMES)
def test_a_frame_survives_the_line(frame):
    assert decode(encode(frame)) == [frame]


@given(LINES)
def test_a_line_survives_to_its_last_digit(frame):
    (read,) = decode(encode_line(frame))
    assert (read.sequence, read.t_us) == (frame.sequence, frame.t_us // 1000 * 1000)
    assert all(
        math.isclose(a, b, abs_tol=math.radians(0.005) + 1e-9)
        for a, b in zip(read.roll_pitch_yaw, frame.roll_pitch_yaw, strict=True)
    )
    assert encode_line(replace(read, t_us=read.t_us)).startswith(b"$ATT,")


@given(STREAM, CUTS)
def test_cuts_change_nothing(data, cuts):
    whole, cut = SerialDecoder(), SerialDecoder()
    expected = whole.feed(data) + whole.finish()
    found = [frame for piece in pieces(data, cuts) for frame in cut.feed(piece)] + cut.finish()
    assert found == expected
    assert (cut.frames, cut.corrupt, cut.discarded) == (whole.frames, whole.corrupt, whole.discarded)


@given(st.binary(max_size=400), CUTS)
def test_any_bytes_are_survived_and_each_is_accounted_for(data, cuts):
    decoder = SerialDecoder()
    found = [frame for piece in pieces(data, cuts) for frame in decoder.feed(piece)] + decoder.finish()
    assert decoder.frames == len(found)
    assert decoder.discarded + sum(len(bytes_of(frame)) for frame in found) == len(data)


@given(st.lists(st.tuples(GARBAGE, FRAMES), min_size=1, max_size=5), GARBAGE)
def test_every_intact_frame_is_found_behind_garbage(parts, tail):
    data = b"".join(garbage + encode(frame) for garbage, frame in parts) + tail
    assert [f for f in decode(data) if f in [frame for _, frame in parts]] == [frame for _, frame in parts]


@given(STREAM)
def test_frames_are_those_of_the_slow_definition(data):
    assert decode(data) == every_frame(data)


@given(FRAMES, st.data())
def test_no_frame_is_made_of_changed_bytes(frame, data):
    """Bursts of up to 16 bits and up to three single bits anywhere behind the first byte are always found."""
    sent = bytearray(encode(frame))
    bits = 8 * len(sent)
    if data.draw(st.booleans(), label="burst"):
        first, pattern = data.draw(st.integers(8, bits - 16)), data.draw(st.integers(1, 0xFFFF))
        flips = [first + k for k in range(16) if pattern >> k & 1]
    else:
        flips = data.draw(st.lists(st.integers(8, bits - 1), min_size=1, max_size=3, unique=True))
    for bit in flips:
        sent[bit // 8] ^= 0x80 >> bit % 8
    decoder = SerialDecoder()
    assert decoder.feed(bytes(sent)) + decoder.finish() == []
    assert decoder.discarded == len(sent)


def test_a_changed_frame_is_counted_as_corrupt_and_the_next_one_is_read():
    frame = QuaternionFrame(7, 70_000, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), Status.REST)
    sent = bytearray(encode(frame))
    sent[12] ^= 4
    decoder = SerialDecoder()
    assert decoder.feed(bytes(sent) + encode(frame)) == [frame]
    assert (decoder.frames, decoder.corrupt, decoder.discarded) == (1, 1, len(sent))


def test_a_wrong_checksum_of_a_line_is_counted_as_corrupt():
    decoder = SerialDecoder()
    assert decoder.feed(b"$ATT,41,410,-0.35,12.07,179.99*00\r\n") == []
    assert decoder.corrupt == 1


@pytest.mark.parametrize(
    "line",
    [
        b"$ATT,65536,1,0.00,0.00,0.00*",  # no such number
        b"$ATT,1,4294968,0.00,0.00,0.00*",  # beyond the clock
        b"$ATT,1,1,180.01,0.00,0.00*",
        b"$ATT,1,1,0.0,0.00,0.00*",
        b"$ATT,01,1,0.00,0.00,0.00*",
        b"$ATT,1,1,0.00,0.00*",
        b"$ATT,1,1,nan,0.00,0.00*",
    ],
)
def test_lines_that_no_board_writes_are_no_frames(line):
    checksum = 0
    for byte in line[1:-1]:
        checksum ^= byte
    assert decode(line + f"{checksum:02X}\r\n".encode()) == []


@pytest.mark.parametrize(
    "change",
    [{"sequence": 65536}, {"t_us": -1}, {"bias": (math.nan,) * 3}],
)
def test_what_does_not_fit_in_a_frame_is_said(change):
    frame = QuaternionFrame(7, 70_000, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), Status.REST)
    with pytest.raises(DataError, match=r"firmware/core/frame\.h"):
        encode(replace(frame, **change))
