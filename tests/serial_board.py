"""A board played by a thread on a pseudo-terminal, whose frames are made by the C encoders."""

import contextlib
import ctypes
import math
import os
import pty
import select
import subprocess
import threading
import time
import tty
from dataclasses import dataclass, field
from pathlib import Path

CORE = Path(__file__).parents[1] / "firmware" / "core"
FLAGS = [
    *("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror"),
    *("-ffp-contract=off", "-O2"),
]


class BootFacts(ctypes.Structure):
    """`struct boot_facts` of firmware/core/frame.h."""

    _fields_ = (
        ("version", ctypes.c_uint8 * 3),
        ("target", ctypes.c_uint8),
        ("filter", ctypes.c_uint8),
        ("sensor", ctypes.c_uint8),
        ("rate_hz", ctypes.c_uint16),
        ("calibration_hash", ctypes.c_uint32),
        ("gyro_range_deg_s", ctypes.c_uint16),
        ("accel_range_g", ctypes.c_uint8),
    )


FACTS = BootFacts((ctypes.c_uint8 * 3)(1, 2, 3), 3, 0x83, 1, 100, 0xCAFE0123, 2000, 8)


def encoders(compiler, folder):
    """The C encoders, compiled into `folder`."""
    library = folder / "frames.so"
    sources = [CORE / name for name in ("crc16.c", "frame.c", "text.c")]
    subprocess.run([compiler, *FLAGS, "-shared", "-fPIC", *sources, "-o", library], check=True)
    functions = ctypes.CDLL(str(library))
    functions.crc16.restype = ctypes.c_uint16
    for name in ("frame_quaternion", "frame_angles", "frame_raw", "frame_boot", "text_attitude"):
        getattr(functions, name).restype = ctypes.c_uint8
    return functions


def written(function, *arguments):
    """The bytes that an encoder writes, and nothing behind them."""
    out = (ctypes.c_uint8 * 64)(*[0xEE] * 64)
    length = function(out, *arguments)
    assert set(out[length:]) == {0xEE}
    return bytes(out[:length])


def counts(k):
    """Sample k: level but for a few counts, which differ on every axis."""
    return (k % 50 - 25, k % 3, 4096 + k % 7, -1000, 100 + k % 11, -(k % 100), 5 - k % 13)


def attitude(k):
    """Sample k, Q30 and angles: turning about z at 36 deg/s."""
    half = 0.5 * math.radians(0.36 * k)
    q = [round(math.cos(half) * 2**30), 0, 0, round(math.sin(half) * 2**30)]
    return q, [0, 0, (round(0.36 * k * 65536 / 360) + 32768) % 65536 - 32768]


@dataclass
class Board:
    """Sends a frame each `pause_s` of real time and each 10 ms of its own clock, until it is left.

    drop: numbers of samples whose frame is lost; spoil: with a bit changed; missing: without a sample;
    hears: obeys commands; boots: answers to b; starts_s: silent for so long; lasts: samples until the port
    goes away; restart: samples after which it starts again; first: its first sequence number.
    """

    functions: ctypes.CDLL
    pause_s: float = 0.001
    mode: str = "q"
    drop: frozenset = frozenset()
    spoil: frozenset = frozenset()
    missing: frozenset = frozenset()
    hears: bool = True
    boots: bool = True
    starts_s: float = 0.0
    noise: bytes = b""
    lasts: float = math.inf
    restart: int = 0
    first: int = 0
    sent: int = field(default=0, init=False)
    port: str = field(default="", init=False)

    def __enter__(self):
        self._ours, self._theirs = pty.openpty()
        tty.setraw(self._theirs)
        self.port = os.ttyname(self._theirs)
        self._leave = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._leave.set()
        self._thread.join()
        with contextlib.suppress(OSError):
            os.close(self._ours)
        with contextlib.suppress(OSError):
            os.close(self._theirs)

    def _run(self):
        time.sleep(self.starts_s)
        sequence, start = self.first, 0
        self._write(self.noise)
        for k in range(1_000_000):
            if self._leave.is_set():
                return
            if k >= self.lasts:  # unplugged
                os.close(self._ours)
                os.close(self._theirs)
                return
            if self.restart and k == self.restart:
                sequence, start, self.mode = 0, k, "q"
            t_us = ctypes.c_uint32((k - start) * 10_000 + 50_000)
            for command in self._heard() if k else b"b":
                if command == ord("b"):
                    if self.boots:
                        args = (ctypes.c_uint16(sequence), t_us, ctypes.byref(FACTS))
                        self._write(written(self.functions.frame_boot, *args))
                        sequence += 1
                else:
                    self.mode = chr(command)
            frame = bytearray(self._frame(k, ctypes.c_uint16(sequence), t_us))
            if k in self.spoil:
                frame[11] ^= 1
            if k not in self.drop:
                self._write(bytes(frame))
            sequence += 1
            self.sent += 1
            time.sleep(self.pause_s)

    def _heard(self):
        if not select.select([self._ours], [], [], 0)[0]:
            return b""
        received = os.read(self._ours, 64)
        return received if self.hears else b""

    def _write(self, data):
        if data:
            os.write(self._ours, data)

    def _frame(self, k, sequence, t_us):
        status = 1 | (8 if k in self.missing else 0)
        q, angles = attitude(k)
        bias = (ctypes.c_int32 * 3)(2**24 // 100, 0, -(2**24) // 100)
        turns = (ctypes.c_int16 * 3)(*angles)
        if self.mode == "x":  # no firmware of ours
            return b"\x55\xa5 hello\n"
        if self.mode == "r":
            return written(self.functions.frame_raw, sequence, t_us, (ctypes.c_int16 * 7)(*counts(k)), status)
        if self.mode == "a":
            return written(self.functions.frame_angles, sequence, t_us, turns, bias, status)
        if self.mode == "t":
            return written(self.functions.text_attitude, sequence, t_us, turns)
        args = (sequence, t_us, (ctypes.c_int32 * 4)(*q), bias, status)
        return written(self.functions.frame_quaternion, *args)
