"""Calls into the C core: a whole recording, or one sample, with NumPy's arrays as they lie in memory."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.firmware.library import load_library

__all__ = ["WIDTHS", "run", "start", "state_size", "step"]

Array = NDArray[np.float64]
POINTER, DOUBLE = ctypes.c_void_p, ctypes.c_double


# numbers a sample of the fields of an attitude history, and their names in `struct answer`
WIDTHS = {
    "world_q_body": 4, "heading_free": 4, "cov": 9, "cov_6d": 9, "gyro_bias": 3, "gyro_bias_cov": 9,
}  # fmt: skip
ANSWER = {
    "world_q_body": "world_q_body", "gyro_bias": "bias", "rest": "rest", "magnetic_disturbance": "disturbed",
    "heading_free": "heading_free", "cov": "cov", "cov_6d": "cov_6d", "gyro_bias_cov": "bias_cov",
}  # fmt: skip


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

    _fields_ = tuple((name, POINTER) for name in ANSWER.values())


def run(
    entry: str,
    known: Sequence[str],
    settings: Array,
    t: NDArray[np.int64],
    gyro: Array,
    accel: Array,
    mag: Array | None,
    rate_hz: float = 0.0,
) -> dict[str, Any]:
    """A filter over a recording (N samples), in one call that lets go of the interpreter.

    Parameters
    ----------
    entry : name of the module in firmware/core, such as "mahony_f32"
    known : fields of an attitude history that the filter knows, of WIDTHS, rest and magnetic_disturbance
    settings : in the order of the filter's FIELDS
    t : (N,) ns
    gyro, accel, mag : (N, 3) rad/s, m/s², µT
    rate_hz : nominal rate, for filters in fixed point

    Returns
    -------
    the fields of an attitude history, sealed
    """
    count = len(t)
    arrays = [np.ascontiguousarray(values, np.float64) for values in (gyro, accel)]
    field = None if mag is None else np.ascontiguousarray(mag, np.float64)
    stamps = np.ascontiguousarray(t, np.int64)
    addresses = [stamps.ctypes.data, *(one.ctypes.data for one in arrays)]
    recording = _Recording(count, *addresses, None if field is None else field.ctypes.data, rate_hz)
    # one block of each kind, so that the system maps it in few pieces
    numbers = np.empty(count * sum(WIDTHS[name] for name in known if name in WIDTHS))
    flags = np.empty(2 * count, np.bool_)
    answer = _Answer()
    for name, column in _columns(numbers, flags, count, known).items():
        setattr(answer, ANSWER[name], column.ctypes.data)
    _function(entry, "run")(_pointer(settings), ctypes.byref(recording), ctypes.byref(answer))
    numbers.flags.writeable = flags.flags.writeable = False
    return {name: one for name, one in _columns(numbers, flags, count, known).items() if name in known}


def _columns(
    numbers: Array, flags: NDArray[np.bool_], count: int, known: Sequence[str]
) -> dict[str, NDArray[Any]]:
    """Views of two blocks: what is known, and both flags, which every filter writes."""
    columns: dict[str, NDArray[Any]] = {}
    start = 0
    for name in (one for one in known if one in WIDTHS):
        width = WIDTHS[name]
        part = numbers[start : start + count * width]
        columns[name] = part.reshape((count, 3, 3) if width == 9 else (count, width))
        start += count * width
    return {**columns, "rest": flags[:count], "magnetic_disturbance": flags[count:]}


def state_size(entry: str) -> int:
    """Numbers of a state."""
    function = getattr(load_library(), f"binding_{entry}_state_size")
    function.restype = ctypes.c_int32
    return int(function())


def start(entry: str, settings: Array, sample: Array, rate_hz: float = 0.0) -> Array:
    """State (n,) from a first sample (9,): gyro, accelerometer, magnetometer."""
    state = np.zeros(state_size(entry))
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
