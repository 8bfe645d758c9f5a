"""The frames and lines of firmware/core, byte for byte those of the decoder's own encoder."""

import ctypes
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from serial_board import BootFacts, encoders, written
from serial_worlds import BOOTS, CLOCK, COUNT, SEQUENCE, several

from sequential.readers.serial import (
    AngleFrame,
    QuaternionFrame,
    RawFrame,
    Status,
    decode,
    encode,
    encode_line,
)
from sequential.readers.serial_frames import FILTERS, SENSORS, TARGETS

LONG = st.integers(-(2**31), 2**31 - 1)
BYTE = st.integers(0, 255)
TURN = 2.0 * math.pi / 65536.0


@pytest.fixture(scope="module")
def core(c_compiler, tmp_path_factory) -> ctypes.CDLL:
    return encoders(c_compiler, tmp_path_factory.mktemp("core"))


def bitwise_check(data: bytes) -> int:
    """CRC-16/CCITT-FALSE by its definition, one bit at a time."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = ((crc << 1) ^ 0x1021) & 0xFFFF if crc & 0x8000 else crc << 1
    return crc


def test_the_check_of_the_nine_digits_is_that_of_the_catalogue(core):
    assert core.crc16(0xFFFF, b"123456789", 9) == 0x29B1


@given(data=st.binary(max_size=255), cut=st.integers(0, 255))
def test_the_check_equals_its_definition_in_one_piece_or_two(core, data, cut):
    expected = bitwise_check(data)
    assert core.crc16(0xFFFF, data, len(data)) == expected
    first, second = data[:cut], data[cut:]
    assert core.crc16(core.crc16(0xFFFF, first, len(first)), second, len(second)) == expected


@given(sequence=SEQUENCE, t_us=CLOCK, q=several(LONG, 4), bias=several(LONG, 3), status=BYTE)
def test_quaternion_frames_are_equal(core, sequence, t_us, q, bias, status):
    frame = QuaternionFrame(
        sequence, t_us, tuple(k / 2**30 for k in q), tuple(k / 2**24 for k in bias), Status(status)
    )
    sent = written(
        core.frame_quaternion,
        *(sequence, ctypes.c_uint32(t_us), (ctypes.c_int32 * 4)(*q), (ctypes.c_int32 * 3)(*bias), status),
    )
    assert sent == encode(frame)
    (back,) = decode(sent)
    assert max(abs(a - b) for a, b in zip(back.world_q_body, frame.world_q_body, strict=True)) <= 2**-14


@given(sequence=SEQUENCE, t_us=CLOCK, angles=several(COUNT, 3), bias=several(LONG, 3), status=BYTE)
def test_angle_frames_and_lines_are_equal(core, sequence, t_us, angles, bias, status):
    radians = tuple(angle * TURN for angle in angles)
    frame = AngleFrame(sequence, t_us, radians, tuple(k / 2**24 for k in bias), Status(status))
    given_angles = (ctypes.c_int16 * 3)(*angles)
    sent = written(
        core.frame_angles,
        *(sequence, ctypes.c_uint32(t_us), given_angles, (ctypes.c_int32 * 3)(*bias), status),
    )
    assert sent == encode(frame)
    line = written(core.text_attitude, sequence, ctypes.c_uint32(t_us), given_angles)
    assert len(line) < 48
    assert line == encode_line(frame)


@given(sequence=SEQUENCE, t_us=CLOCK, counts=several(COUNT, 7), status=BYTE)
def test_raw_frames_are_equal(core, sequence, t_us, counts, status):
    sent = written(core.frame_raw, sequence, ctypes.c_uint32(t_us), (ctypes.c_int16 * 7)(*counts), status)
    assert sent == encode(RawFrame(sequence, t_us, counts, Status(status)))


@given(frame=BOOTS)
def test_boot_frames_are_equal(core, frame):
    def number(name, names):
        found = {known: k for k, known in names.items()}
        return found[name] if name in found else int(name.split()[1])

    facts = BootFacts(
        (ctypes.c_uint8 * 3)(*frame.version),
        number(frame.target, dict(enumerate(TARGETS))),
        number(frame.filter, FILTERS),
        number(frame.sensor, dict(enumerate(SENSORS))),
        *(frame.rate, frame.calibration_hash, frame.gyro_range, frame.accel_range),
    )
    sent = written(core.frame_boot, frame.sequence, ctypes.c_uint32(frame.t_us), ctypes.byref(facts))
    assert sent == encode(frame)


def test_a_frame_is_as_described(core):
    """One frame written out by hand, so that both encoders cannot be wrong together."""
    q, bias = (1 << 30, -(1 << 30), 0x7FFFFFFF, 0x8000), (256, -(1 << 30), 1 << 30)
    sent = written(
        core.frame_quaternion,
        *(0x1234, ctypes.c_uint32(0x89ABCDEF), (ctypes.c_int32 * 4)(*q), (ctypes.c_int32 * 3)(*bias), 3),
    )
    body = bytes.fromhex("01 0f 3412 efcdab89 0040 00c0 ff7f 0100 0100 0080 ff7f 03")
    assert sent == b"\xa5" + body + bitwise_check(body).to_bytes(2, "little")


def test_a_line_is_as_described(core):
    line = written(core.text_attitude, 41, 410_999, (ctypes.c_int16 * 3)(-64, 2197, -32768))
    assert line == b"$ATT,41,410,-0.35,12.07,-180.00*78\r\n"
