"""Frames as lines of a file that grows while it is recorded, and is never half a line."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO

from sequential.errors import DataError
from sequential.readers.serial import AngleFrame, BootFrame, Frame, QuaternionFrame, RawFrame
from sequential.readers.stamps import decimal_seconds

__all__ = ["GrowingFile", "Row", "rows_of"]

GRAVITY = 9.80665  # m/s² in a g
FULL = 32768.0  # counts at the end of a range
FLUSH_S = 0.5
RAW = ("ax", "ay", "az"), ("gx", "gy", "gz")
Row = Callable[[int, Frame], str]


class GrowingFile:
    """Lines go to `<name>.part`, which becomes the file when it is closed.

    Whole lines are handed to the system twice a second, so that a program or a computer that stops leaves
    a `.part` with every line up to then.

    Raises
    ------
    DataError
        where the file, or a `.part` of a recording that was cut off, is there already.
    """

    def __init__(self, goal: Path, *, force: bool = False) -> None:
        self.goal, self.part = goal, goal.with_name(goal.name + ".part")
        if not goal.parent.is_dir():
            raise DataError(f"{goal} cannot be written: there is no folder {goal.parent}; create it first")
        if not force and goal.exists():
            raise DataError(f"{goal} is there already; name another file, or give --force to replace it")
        if not force and self.part.exists():
            raise DataError(
                f"{self.part} holds a recording that was cut off; rename it to keep it, or give --force"
            )
        self._file: IO[str] | None = None
        self._waiting: list[str] = []
        self._flushed = 0.0
        self._whole = 0  # bytes of whole lines in the file

    def write(self, lines: str) -> None:
        """Add whole lines."""
        if self._file is None:
            self._file = self.part.open("w", encoding="utf-8", newline="\n")
        self._waiting.append(lines)
        if (now := time.monotonic()) - self._flushed >= FLUSH_S:
            self._flushed = now
            self._flush()

    def close(self) -> None:
        """Give the file its name; without a line there is no file."""
        self._flush()
        if self._file is not None:
            os.fsync(self._file.fileno())
            self._file.close()
            self.part.replace(self.goal)

    def _flush(self) -> None:
        if self._file is None:
            return
        try:
            self._file.write("".join(self._waiting))
            self._file.flush()
            self._whole = self._file.tell()
        except OSError as fault:
            self._file = None  # nothing more goes in
            os.truncate(self.part, self._whole)
            raise DataError(f"{self.part} holds what came before: {fault.strerror}") from fault
        self._waiting.clear()


def rows_of(goal: Path, mode: str, boot: BootFrame | None) -> tuple[str, Row]:
    """Head of a file, and the function that makes a line of a stamp (ns) and a frame.

    Raw samples are written in SI by the full scales of the boot frame, and as counts without one; attitudes
    as a table, or in the TUM format where the file is called `.tum`.
    """
    if mode == "raw":
        head, row = _raw(boot)
    elif goal.suffix == ".tum":
        head, row = "# t x y z qx qy qz qw\n", _tum_row
    else:
        names = ["t_s", "qw", "qx", "qy", "qz", "roll_deg", "pitch_deg", "yaw_deg"]
        if mode != "text":
            names += ["bias_x_rad_s", "bias_y_rad_s", "bias_z_rad_s", "rest", "status"]
        head, row = ",".join(names) + "\n", _attitude_row
    return f"# {described(boot)}\n{head}", row


def described(boot: BootFrame | None) -> str:
    """What a board said of itself, on one line."""
    if boot is None:
        return "a board that did not say what it is"
    hashed = f"calibration {boot.calibration_hash:08x}" if boot.calibration_hash else "no calibration"
    version = ".".join(map(str, boot.version))
    return (
        f"{boot.target}, firmware {version}, filter {boot.filter}, {hashed}, {boot.rate} Hz, {boot.sensor} "
        f"at ±{boot.gyro_range} deg/s and ±{boot.accel_range} g"
    )


def _raw(boot: BootFrame | None) -> tuple[str, Row]:
    accel, gyro = ("m/s^2", "rad/s") if boot else ("counts", "counts")
    accel_scale = boot.accel_range * GRAVITY / FULL if boot else 1.0
    gyro_scale = math.radians(boot.gyro_range) / FULL if boot else 1.0

    def row(t: int, frame: Frame) -> str:
        assert isinstance(frame, RawFrame)  # noqa: S101 - the recorder asks for these
        ax, ay, az, heat, gx, gy, gz = frame.counts
        values = [*(accel_scale * a for a in (ax, ay, az)), *(gyro_scale * g for g in (gx, gy, gz))]
        # data sheet of the MPU-6050: 340 counts a degree, 36.53 °C at zero
        cells = ",".join(f"{value:.9g}" for value in (*values, heat / 340.0 + 36.53))
        return f"{decimal_seconds(t)},{cells}\n"

    names = [f"{axis} [{unit}]" for axes, unit in zip(RAW, (accel, gyro), strict=True) for axis in axes]
    return ",".join(["t [s]", *names, "temperature [degC]"]) + "\n", row


def _attitude(frame: Frame) -> tuple[list[float], list[float]]:
    """Unit quaternion, and roll, pitch, yaw in rad."""
    import numpy as np

    from sequential.attitude import attitude_from_angles, roll_pitch_yaw

    if isinstance(frame, QuaternionFrame):
        q = np.array(frame.world_q_body)
        q /= np.linalg.norm(q) or 1.0
        return q.tolist(), roll_pitch_yaw(q).tolist()
    assert isinstance(frame, AngleFrame)  # noqa: S101 - the recorder asks for these
    return attitude_from_angles(frame.roll_pitch_yaw).tolist(), list(frame.roll_pitch_yaw)


def _attitude_row(t: int, frame: Frame) -> str:
    assert isinstance(frame, QuaternionFrame | AngleFrame)  # noqa: S101 - as above
    q, angles = _attitude(frame)
    cells = [f"{value:.9f}" for value in q] + [f"{math.degrees(angle):.4f}" for angle in angles]
    if frame.bias is not None and frame.status is not None:
        cells += [f"{value:.8f}" for value in frame.bias]
        cells += [str(int(bool(frame.status & 1))), str(int(frame.status))]
    return f"{decimal_seconds(t)},{','.join(cells)}\n"


def _tum_row(t: int, frame: Frame) -> str:
    (w, x, y, z), _ = _attitude(frame)
    return f"{decimal_seconds(t)} 0 0 0 {x:.9f} {y:.9f} {z:.9f} {w:.9f}\n"
