"""Calls into the C core: a whole recording, or one sample, with NumPy's arrays as they lie in memory."""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.firmware.library import load_library

__all__ = ["Answer", "run", "start", "step"]

Array = NDArray[np.float64]
POINTER, DOUBLE = ctypes.c_void_p, ctypes.c_double


class _Recording(ctypes.Structure):
    """`struct recording` of firmware/binding/binding.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("t", POINTER),
        ("gyro", POINTER),
        ("accel", POINTER),
        ("mag", POINTER),
        ("rate_hz", DOUBLE),
    )


class _Answer(ctypes.Structure):
    """`struct answer`."""

    _fields_ = (("world_q_body", POINTER), ("bias", POINTER), ("rest", POINTER), ("disturbed", POINTER))


class Answer(NamedTuple):
    """What a filter found: quaternions (N, 4), bias (N, 3) in rad/s, flags (N,); sealed."""

    world_q_body: Array
    bias: Array
    rest: NDArray[np.bool_]
    disturbed: NDArray[np.bool_]


def run(
    entry: str,
    settings: Array,
    t: NDArray[np.int64],
    gyro: Array,
    accel: Array,
    mag: Array | None,
    rate_hz: float = 0.0,
) -> Answer:
    """A filter over a recording (N samples), in one call that lets go of the interpreter.

    Parameters
    ----------
    entry : name of the module in firmware/core, such as "mahony_f32"
    settings : in the order of the C struct
    t : (N,) ns
    gyro, accel, mag : (N, 3) rad/s, m/s², µT
    rate_hz : nominal rate, for filters in fixed point
    """
    count = len(t)
    given = [np.ascontiguousarray(t, np.int64)]
    given += [np.ascontiguousarray(values, np.float64) for values in (gyro, accel)]
    field = None if mag is None else np.ascontiguousarray(mag, np.float64)
    # one block of each kind, so that the system maps it in few pieces
    numbers, flags = np.empty(7 * count), np.empty(2 * count, np.bool_)
    path, bias = numbers[: 4 * count].reshape(count, 4), numbers[4 * count :].reshape(count, 3)
    recording = _Recording(
        count, *(one.ctypes.data for one in given), None if field is None else field.ctypes.data, rate_hz
    )
    answer = _Answer(path.ctypes.data, bias.ctypes.data, flags.ctypes.data, flags[count:].ctypes.data)
    _function(entry, "run")(_pointer(settings), ctypes.byref(recording), ctypes.byref(answer))
    numbers.flags.writeable = flags.flags.writeable = False
    path, bias = numbers[: 4 * count].reshape(count, 4), numbers[4 * count :].reshape(count, 3)
    return Answer(path, bias, flags[:count], flags[count:])


def start(entry: str, settings: Array, sample: Array, size: int, rate_hz: float = 0.0) -> Array:
    """State (size,) from a first sample (9,): gyro, accelerometer, magnetometer."""
    state = np.zeros(size)
    _function(entry, "start")(_pointer(settings), DOUBLE(rate_hz), _pointer(sample), _pointer(state))
    return state


def step(entry: str, settings: Array, state: Array, sample: Array, dt: float, rate_hz: float = 0.0) -> None:
    """Advance a state by one sample (9,), dt seconds after the last, in place."""
    _function(entry, "step")(
        _pointer(settings), DOUBLE(rate_hz), _pointer(sample), DOUBLE(dt), _pointer(state)
    )


def _function(entry: str, verb: str) -> Any:
    function = getattr(load_library(), f"binding_{entry}_{verb}")
    function.restype = None
    return function


def _pointer(array: Array) -> ctypes.c_void_p:
    """The address of an array that its caller keeps alive."""
    return POINTER(array.ctypes.data)
