"""The frames of firmware/core, against their description written out with struct and a bitwise check."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np
import pytest

CORE = Path(__file__).parents[2] / "firmware" / "core"
FLAGS = [
    *("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror"),
    *("-ffp-contract=off", "-O2"),
]


@pytest.fixture(scope="module")
def core(c_compiler, tmp_path_factory) -> ctypes.CDLL:
    library = tmp_path_factory.mktemp("core") / "frames.so"
    sources = [CORE / name for name in ("crc16.c", "frame.c", "text.c")]
    subprocess.run([c_compiler, *FLAGS, "-shared", "-fPIC", *sources, "-o", library], check=True)
    functions = ctypes.CDLL(str(library))
    functions.crc16.restype = ctypes.c_uint16
    for name in ("frame_quaternion", "frame_angles", "frame_raw", "frame_boot", "text_attitude"):
        getattr(functions, name).restype = ctypes.c_uint8
    return functions


def bitwise_check(data: bytes) -> int:
    """CRC-16/CCITT-FALSE by its definition, one bit at a time."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = ((crc << 1) ^ 0x1021) & 0xFFFF if crc & 0x8000 else crc << 1
    return crc


def test_the_check_of_the_nine_digits_is_that_of_the_catalogue(core):
    assert core.crc16(0xFFFF, b"123456789", 9) == 0x29B1 == bitwise_check(b"123456789")


def test_the_check_equals_its_definition(core, rng):
    for length in range(64):
        data = rng.bytes(length)
        assert core.crc16(0xFFFF, data, length) == bitwise_check(data)


def test_a_quaternion_frame_is_as_described(core):
    out = (ctypes.c_uint8 * 32)()
    q = (ctypes.c_int32 * 4)(1 << 30, -(1 << 30), 0x7FFFFFFF, 0x8000)
    bias = (ctypes.c_int32 * 3)(256, -(1 << 30), 1 << 30)
    length = core.frame_quaternion(out, 0x1234, 0x89ABCDEF, q, bias, 3)
    body = np.array([16384, -16384, 32767, 1, 1, -32768, 32767], "<i2").tobytes() + b"\x03"
    expected = b"\x01\x0f\x34\x12\xef\xcd\xab\x89" + body
    assert bytes(out[:length]) == b"\xa5" + expected + bitwise_check(expected).to_bytes(2, "little")


def test_a_line_is_as_described(core):
    out = (ctypes.c_uint8 * 48)()
    length = core.text_attitude(out, 41, 410_999, (ctypes.c_int16 * 3)(-64, 2197, -32768))
    assert bytes(out[:length]).startswith(b"$ATT,41,410,-0.35,12.07,-180.00*")
    assert int(bytes(out[length - 4 : length - 2]), 16) == np.bitwise_xor.reduce(out[1 : length - 5])
    assert bytes(out[length - 2 : length]) == b"\r\n"
