"""Rows of a recording as the emulated Cortex-M4 and the host read them, and the host itself."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from factorlab.firmware.emulation import COMMANDS, Counts, Emulation
from factorlab.firmware.toolchain import firmware_folder, run_tool
from sequential.errors import DataError, ShapeError
from sequential.readers.serial import BootFrame, Frame, decode

__all__ = [
    "FAULTS",
    "ROW",
    "build_host",
    "checked_counts",
    "checked_faults",
    "frames_unlike",
    "recorded_rows",
    "run_host",
]

ROW = np.dtype([("counts", "<i2", 7), ("answer", "u1"), ("command", "u1")])
FAULTS = {"good": 0, "absent": 1, "hung": 2, "bus": 3}


def recorded_rows(counts: ArrayLike, *, mode: str, faults: ArrayLike | None = None) -> NDArray[np.void]:
    """(N,) rows of firmware/ports/recorded/sensor.h.

    Parameters
    ----------
    counts : (N, 7) int16 rows ax ay az temperature gx gy gz
    mode : `q`, `a`, `r` or `t`
    faults : (N,) of `FAULTS`: the sensor answers, does not acknowledge, holds the clock for ever, or the bus
        fails

    Raises
    ------
    ShapeError, DataError
        where they are something else.
    """
    given = checked_counts(counts, mode)
    rows = np.zeros(len(given), ROW)
    rows["counts"] = given
    if faults is not None:
        rows["answer"] = checked_faults(faults, len(given))
    return rows


def checked_counts(counts: ArrayLike, mode: str = "q") -> Counts:
    """(N, 7) int16 rows for an emulated board, and a mode that it knows.

    Raises
    ------
    ShapeError, DataError
        where they are something else.
    """
    given = np.asarray(counts)
    if given.ndim != 2 or given.shape[1] != 7 or not len(given):
        raise ShapeError(f"counts must be (N, 7), ax ay az temperature gx gy gz; got {given.shape}")
    if not np.issubdtype(given.dtype, np.integer) or given.min() < -32768 or given.max() > 32767:
        raise DataError(
            f"counts must be integers of 16 bits, got {given.dtype} up to {np.abs(given).max():g}"
        )
    if mode not in COMMANDS:
        raise DataError(f"mode {mode!r} is none of {', '.join(COMMANDS)} ({', '.join(COMMANDS.values())})")
    return given.astype(np.int16)


def checked_faults(faults: ArrayLike, count: int, kinds: Iterable[str] = FAULTS) -> NDArray[np.uint8]:
    """(N,) of the numbers that FAULTS gives some kinds.

    Raises
    ------
    ShapeError
        where they are something else.
    """
    given, known = np.asarray(faults), [FAULTS[kind] for kind in kinds]
    if given.shape != (count,) or not np.isin(given, known).all():
        raise ShapeError(
            f"faults must be ({count},) of {', '.join(map(str, known))}, one a row; got {given.shape}"
        )
    return given.astype(np.uint8)


def build_host(
    out: Path,
    *,
    filter: str = "mahony_q",  # noqa: A002 - the word of the Makefiles
    calibration: Path | None = None,
    core: Path | None = None,
) -> Path:
    """Compile the application for this computer into the folder `out`; the program.

    Parameters
    ----------
    out : folder
    filter : of firmware/app/filter_*.c
    calibration : header of constants, as `factorlab calibrate … --c-header` writes them
    core : folder of the objects of firmware/core, for programs that share them; `out` unless given

    Raises
    ------
    ToolMissingError
        where make or a compiler is missing, or refuses.
    """
    asked = [f"OUT={out.resolve()}", f"FILTER={filter}", f"CALIBRATION={calibration or ''}"]
    asked.append(f"CORE_OUT={(core or out).resolve()}")
    run_tool(
        ["make", "-s", "-j2", "-C", str(firmware_folder() / "ports" / "host"), *asked],
        what=f"compiling {filter} for this computer",
    )
    return out / "firmware"


def run_host(program: Path, counts: ArrayLike, *, mode: str = "q", faults: ArrayLike | None = None) -> bytes:
    """Every byte that the application writes on this computer, given these samples.

    On an emulated board it writes the same, but for the name of the target in its boot frame.

    Raises
    ------
    ShapeError, DataError
        as `recorded_rows`.
    """
    rows = recorded_rows(counts, mode=mode, faults=faults)
    with tempfile.TemporaryDirectory() as name:
        source, sink = Path(name) / "rows", Path(name) / "bytes"
        rows.tofile(source)
        run_tool([str(program.resolve()), str(source), str(sink), mode], what=f"running {program.name}")
        return sink.read_bytes()


def frames_unlike(emulation: Emulation, host: bytes) -> int:
    """Frames of an emulated board that say something else than this computer's: attitude, bias, status.

    Sequence numbers and times are left out: boards start in their own time.  So are frames that were lost.

    Parameters
    ----------
    emulation : of N samples
    host : from `run_host` on the same samples, in the same mode
    """
    frames = [frame for frame in decode(host) if not isinstance(frame, BootFrame)]
    pairs = zip(emulation.frames, frames[-len(emulation.frames) :], strict=True)
    return sum(said is not None and _said(said) != _said(ours) for said, ours in pairs)


def _said(frame: Frame) -> Frame:
    return frame if isinstance(frame, BootFrame) else replace(frame, sequence=0, t_us=0)
