"""The frames that a board sends (firmware/core/frame.h, text.h), in SI units, and their bytes.

A frame is 0xA5, type, length of the payload, sequence number (u16), time (u32, µs), payload, and the
CRC-16/CCITT-FALSE of all that follows the first byte; numbers are little endian.
"""

from __future__ import annotations

import math
import struct
from binascii import crc_hqx
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntFlag

from sequential.errors import DataError

__all__ = [
    "AngleFrame",
    "BootFrame",
    "Frame",
    "QuaternionFrame",
    "RawFrame",
    "Status",
    "encode",
    "parse",
]

START = 0xA5
HEADER = struct.Struct("<BBBHI")  # start, type, length, sequence, time
QUATERNION, ANGLES, RAW, BOOT = 1, 2, 3, 4
PAYLOADS = {
    QUATERNION: struct.Struct("<7hB"),
    ANGLES: struct.Struct("<6hB"),
    RAW: struct.Struct("<7hB"),
    BOOT: struct.Struct("<3B3BHIHB"),
}
TARGETS = ("host", "mps2-an386", "stm32f4", "atmega328p")
FILTERS = {
    0: "none",
    1: "complementary_f32",
    2: "tilt_f32",
    3: "mahony_f32",
    4: "error_state_f32",
    0x81: "complementary_q",
    0x82: "tilt_q",
    0x83: "mahony_q",
}
SENSORS = ("unknown", "MPU-6050")
Vector = tuple[float, float, float]
Q14, Q15, TURN = 2.0**-14, 2.0**-15, 2.0 * math.pi / 65536.0


class Status(IntFlag):
    """What a board says about the sample behind a frame."""

    REST = 1
    ACCEL_REJECTED = 2
    MAG_DISTURBED = 4
    SAMPLE_MISSING = 8
    OVERRUN = 16
    SATURATED = 32


@dataclass(frozen=True, slots=True)
class QuaternionFrame:
    """Attitude and gyro bias.

    Parameters
    ----------
    sequence : 0 … 65535, one counter for all frames of the board
    t_us : the board's clock at the sample, µs modulo 2³²
    world_q_body : (w, x, y, z), Hamilton, in steps of 2⁻¹⁴; unit but for that rounding
    bias : of the gyro, rad/s, in steps of 2⁻¹⁵
    status : of the sample
    """

    sequence: int
    t_us: int
    world_q_body: tuple[float, float, float, float]
    bias: Vector
    status: Status


@dataclass(frozen=True, slots=True)
class AngleFrame:
    """Roll, pitch and yaw, rad, in steps of 2π/65536 (0.01° in a line of text), as `QuaternionFrame` else.

    A line `$ATT,…` has no bias and no status; they are None.
    """

    sequence: int
    t_us: int
    roll_pitch_yaw: Vector
    bias: Vector | None
    status: Status | None


@dataclass(frozen=True, slots=True)
class RawFrame:
    """One sample as the sensor gave it: counts of ax ay az, temperature, gx gy gz."""

    sequence: int
    t_us: int
    counts: tuple[int, int, int, int, int, int, int]
    status: Status


@dataclass(frozen=True, slots=True)
class BootFrame:
    """What a board says of itself when it starts, and when it is asked.

    Parameters
    ----------
    version : of the firmware: major, minor, patch
    target, filter, sensor : names; `unknown …` where this program does not know the number
    rate : samples a second, Hz
    calibration_hash : the first 4 bytes of the SHA-256 of the calibration file built in; 0 for none
    gyro_range : deg/s at 32768 counts
    accel_range : g at 32768 counts, g = 9.80665 m/s²
    """

    sequence: int
    t_us: int
    version: tuple[int, int, int]
    target: str
    filter: str
    sensor: str
    rate: int
    calibration_hash: int
    gyro_range: int
    accel_range: int


Frame = QuaternionFrame | AngleFrame | RawFrame | BootFrame


def parse(kind: int, sequence: int, t_us: int, payload: bytes) -> Frame:
    """Make the frame of a known type from a payload of that type's length."""
    values = PAYLOADS[kind].unpack(payload)
    if kind == RAW:
        return RawFrame(sequence, t_us, values[:7], Status(values[7]))
    if kind == QUATERNION:
        w, x, y, z = (value * Q14 for value in values[:4])
        return QuaternionFrame(sequence, t_us, (w, x, y, z), _bias(values[4:7]), Status(values[7]))
    if kind == ANGLES:
        roll, pitch, yaw = (value * TURN for value in values[:3])
        return AngleFrame(sequence, t_us, (roll, pitch, yaw), _bias(values[3:6]), Status(values[6]))
    target, used, sensor, rate, calibration, gyro, accel = values[3:]
    return BootFrame(
        sequence,
        t_us,
        (values[0], values[1], values[2]),
        _name(target, dict(enumerate(TARGETS))),
        _name(used, FILTERS),
        _name(sensor, dict(enumerate(SENSORS))),
        rate,
        calibration,
        gyro,
        accel,
    )


def encode(frame: Frame) -> bytes:
    """Give the bytes of a frame: what firmware/core/frame.c writes for the same numbers.

    Numbers are rounded to the nearest step, ties upwards, and saturate; a line of text (an `AngleFrame`
    without bias) is not made here.

    Raises
    ------
    DataError
        for a name or a number that has no place in a frame.
    """
    try:
        kind, payload = _payload(frame)
        header = HEADER.pack(START, kind, len(payload), frame.sequence, frame.t_us)
    except (struct.error, ValueError) as fault:
        raise DataError(f"{frame} does not fit: {fault}; firmware/core/frame.h gives the ranges") from None
    body = header[1:] + payload
    return header[:1] + body + crc_hqx(body, 0xFFFF).to_bytes(2, "little")


def _payload(frame: Frame) -> tuple[int, bytes]:
    if isinstance(frame, QuaternionFrame):
        values = [*_steps(frame.world_q_body, Q14), *_steps(frame.bias, Q15)]
        return QUATERNION, PAYLOADS[QUATERNION].pack(*values, frame.status)
    if isinstance(frame, RawFrame):
        return RAW, PAYLOADS[RAW].pack(*frame.counts, frame.status)
    if isinstance(frame, AngleFrame):
        if frame.bias is None or frame.status is None:
            raise ValueError("it has no bias or no status")
        # angles wrap where others saturate: +180° is -180°
        turns = [(step + 32768) % 65536 - 32768 for step in _rounded(frame.roll_pitch_yaw, TURN)]
        return ANGLES, PAYLOADS[ANGLES].pack(*turns, *_steps(frame.bias, Q15), frame.status)
    numbers = {name: key for key, name in FILTERS.items()}
    return BOOT, PAYLOADS[BOOT].pack(
        *frame.version,
        _number(frame.target, {name: key for key, name in enumerate(TARGETS)}),
        _number(frame.filter, numbers),
        _number(frame.sensor, {name: key for key, name in enumerate(SENSORS)}),
        frame.rate,
        frame.calibration_hash,
        frame.gyro_range,
        frame.accel_range,
    )


def _rounded(values: Iterable[float], step: float) -> list[int]:
    return [math.floor(value / step + 0.5) for value in values]


def _steps(values: Iterable[float], step: float) -> list[int]:
    return [min(max(value, -32768), 32767) for value in _rounded(values, step)]


def _bias(values: Iterable[int]) -> Vector:
    x, y, z = (value * Q15 for value in values)
    return x, y, z


def _name(number: int, names: dict[int, str]) -> str:
    return names.get(number, f"unknown {number}")


def _number(name: str, numbers: dict[str, int]) -> int:
    if name.startswith("unknown ") and name != "unknown":
        return int(name.removeprefix("unknown "))
    if name not in numbers:
        raise ValueError(f"{name!r} is none of {', '.join(numbers)}")
    return numbers[name]
