"""What an emulated board said, and when; and recordings as the sensor of that board would have read them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.readers.serial import (
    AngleFrame,
    BootFrame,
    Frame,
    QuaternionFrame,
    SerialDecoder,
    Status,
    encode,
)
from sequential.sensors import ImuRecording

__all__ = ["COMMANDS", "Emulation", "frames_of_samples", "mpu6050_counts"]

Floats = NDArray[np.float64]
Counts = NDArray[np.int16]
GRAVITY = 9.80665  # m/s², the g of data sheets
RATE = 100.0
PERIOD_US = 10_000
COMMANDS = {"q": "quaternion", "a": "angles", "r": "raw", "t": "text"}
PAUSE = 1e-3  # s without a byte on the line
TWO_FRAMES = 48  # bytes: the least that two of them take


@dataclass(frozen=True, slots=True, eq=False)
class Emulation:
    """An image run on N samples.

    Attributes
    ----------
    target, filter : as the boot frame names them
    mode : `q` quaternion, `a` angles, `r` raw or `t` text frames
    data : every byte that came over the serial line
    byte_s : (B,) when each one left, s
    frames : N, the frame of each sample; None where it was lost
    boot : the boot frame, None where none came
    update_cycles : (N,) cycles of calibration and filter (Cortex-M4: instructions); NaN where there was none
    sample_s : (N,) when each sample stood in memory, s; NaN where the sensor gave none
    first_byte_s : (N,) when the first byte of its frame left, s; NaN where it was lost
    corrupt : frames whose check failed
    asleep : share of the time that the processor slept, None where unknown
    stack : bytes of stack used at most, None where unknown
    """

    target: str
    filter: str
    mode: str
    data: bytes
    byte_s: Floats
    frames: tuple[Frame | None, ...]
    boot: BootFrame | None
    update_cycles: Floats
    sample_s: Floats
    first_byte_s: Floats
    corrupt: int = 0
    asleep: float | None = None
    stack: int | None = None

    @property
    def latency(self) -> Floats:
        """(N,) from the sample in memory to the first byte of its frame, s; NaN where there is none."""
        return self.first_byte_s - self.sample_s

    @property
    def jitter(self) -> Floats:
        """(N-1,) period between first bytes minus the nominal one, s; NaN beside a loss."""
        return np.diff(self.first_byte_s) - 1.0 / RATE

    @property
    def lost(self) -> int:
        """Samples without a frame."""
        return sum(frame is None for frame in self.frames)

    @property
    def missing(self) -> NDArray[np.bool_]:
        """(N,) where the board said that it had no sample."""
        return self.has(Status.SAMPLE_MISSING)

    def has(self, bit: Status) -> NDArray[np.bool_]:
        """(N,) where a frame's status holds a bit; False for lost frames and for text, which has none."""
        status = (getattr(frame, "status", None) for frame in self.frames)
        return np.array([one is not None and bit in one for one in status], dtype=np.bool_)

    @property
    def world_q_body(self) -> Floats:
        """(N, 4) the quaternions (w, x, y, z) of mode `q`; NaN where a frame was lost."""
        return self._column(QuaternionFrame, "world_q_body", 4)

    @property
    def roll_pitch_yaw(self) -> Floats:
        """(N, 3) rad, of modes `a` and `t`; NaN where a frame was lost."""
        return self._column(AngleFrame, "roll_pitch_yaw", 3)

    def _column(self, kind: type, name: str, width: int) -> Floats:
        rows = np.full((len(self.frames), width), np.nan)
        for row, frame in zip(rows, self.frames, strict=True):
            if isinstance(frame, kind):
                row[:] = getattr(frame, name)
        return rows


def mpu6050_counts(
    recording: ImuRecording,
    *,
    rate: float = RATE,
    gyro_range_deg_s: float = 2000.0,
    accel_range_g: float = 8.0,
) -> Counts:
    """Give (N, 7) counts ax ay az temperature gx gy gz: what an MPU-6050 would have read.

    Interpolated linearly to `rate`, rounded and saturated; without a temperature, 25 °C.

    Parameters
    ----------
    recording : gyro in rad/s, accelerometer in m/s²
    rate : samples a second, Hz
    gyro_range_deg_s, accel_range_g : what 32 768 counts stand for

    Raises
    ------
    MissingStreamError, DataError
        without gyro or accelerometer in SI; for a recording shorter than two samples.
    """
    recording.require("gyro", "accel")
    seconds = recording.seconds
    count = int(np.floor(seconds[-1] * rate + 1e-6)) + 1
    if count < 2:
        raise DataError(
            f"recording {recording.name!r} lasts {seconds[-1]:.3f} s, which is less than two samples at "
            f"{rate:g} Hz; give a longer one"
        )
    at = np.arange(count) / rate
    columns = [recording.accel, recording.gyro]
    scales = [32768.0 / (accel_range_g * GRAVITY), 32768.0 / np.deg2rad(gyro_range_deg_s)]
    accel, gyro = (
        np.column_stack([np.interp(at, seconds, axis) for axis in np.asarray(values).T]) * scale
        for values, scale in zip(columns, scales, strict=True)
    )
    celsius = np.full(count, 25.0)
    if recording.temperature is not None and (known := np.isfinite(recording.temperature)).any():
        celsius = np.interp(at, seconds[known], recording.temperature[known])
    # register map of the MPU-6050, 4.18: T = counts / 340 + 36.53
    rows = np.column_stack([accel, (celsius - 36.53) * 340.0, gyro])
    return np.asarray(np.clip(np.rint(rows), -32768, 32767), dtype=np.int16)


def frames_of_samples(
    data: bytes, byte_s: Floats, start_us: int, count: int
) -> tuple[tuple[Frame | None, ...], Floats, BootFrame | None, int]:
    """Find the frame of each sample in the bytes of a board.

    The board's clock says to which sample a frame belongs; what is older than sample 0 belongs to none.

    Parameters
    ----------
    data, byte_s : bytes and (B,) times
    start_us : time of sample 0 by the board's clock, as its frame says, µs
    count : of samples

    Returns
    -------
    frames, (N,) times of their first bytes, the boot frame, frames whose check failed
    """
    frames: list[Frame | None] = [None] * count
    first_byte_s = np.full(count, np.nan)
    boot: BootFrame | None = None
    decoder = SerialDecoder()
    for begin, frame in _located(decoder, data, byte_s):
        if isinstance(frame, BootFrame):
            boot = boot or frame
            continue
        sample = round(((frame.t_us - start_us) % 2**32) / PERIOD_US)
        if sample < count:
            frames[sample], first_byte_s[sample] = frame, byte_s[begin]
    return tuple(frames), first_byte_s, boot, decoder.corrupt


def _located(decoder: SerialDecoder, data: bytes, byte_s: Floats) -> Iterator[tuple[int, Frame]]:
    """Give each frame with the place of its first byte.

    Frames are apart on the line, so the bytes go in by what stands between two pauses, or one by one where
    that is long enough to hold two frames: the last byte of what goes in is then the last of a frame.
    """
    edges = [0, *(np.flatnonzero(np.diff(byte_s) > PAUSE) + 1).tolist(), len(data)]
    for begin, end in itertools.pairwise(edges):
        pieces = [(begin, end)] if end - begin < TWO_FRAMES else [(k, k + 1) for k in range(begin, end)]
        for first, last in pieces:
            for frame in decoder.feed(data[first:last]):
                text = isinstance(frame, AngleFrame) and frame.status is None
                yield data.rfind(b"$", 0, last) if text else last - len(encode(frame)), frame
