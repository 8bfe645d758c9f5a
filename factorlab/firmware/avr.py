"""An image for the ATmega328P, run in simavr on recorded samples."""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from factorlab.firmware.emulation import PERIOD_US, Emulation, Floats, frames_of_samples
from factorlab.firmware.recorded import FAULTS, checked_counts, checked_faults
from factorlab.firmware.toolchain import firmware_folder, require_tools, run_tool
from sequential.errors import DataError, SolverError

__all__ = [
    "ABSENT",
    "CLOCK_HZ",
    "GOOD",
    "HUNG",
    "build_on_simavr",
    "build_simulator",
    "emulate_avr",
    "kept_folder",
    "live_avr",
]

CLOCK_HZ = 16e6
PERIOD_S = PERIOD_US * 1e-6
KINDS = "good", "absent", "hung"  # what the sensor can do in the period of a row
GOOD, ABSENT, HUNG = (FAULTS[kind] for kind in KINDS)
RECORD = np.dtype([("cycle", "<u8"), ("row", "<u4"), ("kind", "S1"), ("value", "u1"), ("unused", "<u2")])
Records = NDArray[np.void]


def emulate_avr(
    image: Path,
    counts: ArrayLike,
    *,
    mode: str = "q",
    faults: ArrayLike | None = None,
    who_am_i: int = 0x68,
    simulator: Path | None = None,
) -> Emulation:
    """Run an image on samples of an MPU-6050 on simulated I2C, 100 a second, and time what comes out.

    Parameters
    ----------
    image : firmware.elf of firmware/ports/avr
    counts : (N, 7) int16 rows ax ay az temperature gx gy gz, as from `mpu6050_counts`
    mode : `q` quaternion, `a` angles, `r` raw or `t` text frames; a command that the board receives
    faults : (N,) `GOOD`, `ABSENT` (the sensor does not acknowledge) or `HUNG` (it holds the clock for ever)
    who_am_i : what the sensor says it is
    simulator : from `build_simulator`; by default one is compiled, once a process

    Raises
    ------
    DataError
        for counts, faults or a mode that are none; where the board stopped by itself.
    ToolMissingError
        where compiler, libsimavr or libelf are missing, or the image cannot be read.
    """
    rows = checked_counts(counts, mode)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "samples").write_bytes(rows.astype("<i2").tobytes())
        options = ["--send", mode, "--who-am-i", str(who_am_i)]
        if faults is not None:
            (folder / "faults").write_bytes(checked_faults(faults, len(rows), KINDS).tobytes())
            options += ["--faults", str(folder / "faults")]
        command = [
            str(simulator or _simulator()),
            str(image),
            str(folder / "samples"),
            str(folder / "records"),
        ]
        said = run_tool([*command, *options], what=f"emulating {image.name}")
        records = np.fromfile(folder / "records", RECORD)
    return _read(records, json.loads(said), mode, len(rows))


def _read(records: Records, facts: dict[str, int], mode: str, count: int) -> Emulation:
    seconds = records["cycle"] / CLOCK_HZ
    on_line = records["kind"] == b"B"
    data, byte_s = records["value"][on_line].tobytes(), seconds[on_line]
    begun = np.flatnonzero(records["kind"] == b"R")
    if facts["crashed"]:
        raise SolverError(
            f"the emulated board stopped after {facts['cycles'] / CLOCK_HZ:.3f} s: its program slept with "
            "interrupts off or ran into what is no code; build the image anew, for the ATmega328P"
        )
    # the timer starts with the board, and a burst begins less than a period after its tick
    start_us = int(seconds[begun[0]] / PERIOD_S) * PERIOD_US if len(begun) else PERIOD_US
    frames, first_byte_s, boot, corrupt = frames_of_samples(data, byte_s, start_us, count)
    sample_s, update_cycles = _marked(records, begun, count)
    return Emulation(
        target="atmega328p",
        filter=boot.filter if boot else "unknown",
        mode=mode,
        data=data,
        byte_s=byte_s,
        frames=frames,
        boot=boot,
        update_cycles=update_cycles,
        sample_s=sample_s,
        first_byte_s=first_byte_s,
        corrupt=corrupt,
        asleep=facts["asleep"] / facts["cycles"],
        stack=facts["stack"],
    )


def _marked(records: Records, begun: NDArray[np.int64], count: int) -> tuple[Floats, Floats]:
    """From the edges of the marker pins: when each row stood in memory, and cycles of its update."""
    sample_s, update_cycles = np.full(count, np.nan), np.full(count, np.nan)
    up = _edges(records, b"S", 1)
    update, done = _edges(records, b"U", 1), _edges(records, b"U", 0)
    for k, at in enumerate(begun):
        row = int(records["row"][at])
        end = int(begun[k + 1]) if k + 1 < len(begun) else len(records)
        if (stored := _between(up, at, end)) is not None:
            sample_s[row] = records["cycle"][stored] / CLOCK_HZ
        start, stop = _between(update, at, end), _between(done, at, end)
        if start is not None and stop is not None:
            update_cycles[row] = float(records["cycle"][stop] - records["cycle"][start])
    return sample_s, update_cycles


def _edges(records: Records, kind: bytes, level: int) -> NDArray[np.int64]:
    return np.flatnonzero((records["kind"] == kind) & (records["value"] == level))


def _between(places: NDArray[np.int64], begin: int, end: int) -> int | None:
    k = int(np.searchsorted(places, begin))
    return int(places[k]) if k < len(places) and places[k] < end else None


def build_simulator(out: Path) -> Path:
    """Compile firmware/ports/avr/simulator into the folder `out`; the program.

    Raises
    ------
    ToolMissingError
        where gcc, libsimavr-dev or libelf-dev are missing.
    """
    sources = sorted((firmware_folder() / "ports" / "avr" / "simulator").glob("*.c"))
    return build_on_simavr(sources, out / "simulate", what="compiling the simulated board")


def build_on_simavr(sources: Sequence[Path], program: Path, *, what: str) -> Path:
    """Compile a program of this computer on libsimavr."""
    require_tools("avr", emulate=True)
    run_tool(
        ["gcc", "-std=c99", "-O2", "-o", str(program), *map(str, sources), "-lsimavr", "-lelf"], what=what
    )
    return program


def kept_folder() -> Path:
    """A folder for programs that are compiled once a process."""
    return Path(_kept().name)


@cache
def _kept() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="factorlab-")


@cache
def _simulator() -> Path:
    return build_simulator(kept_folder())


@contextmanager
def live_avr(image: Path, counts: ArrayLike, *, simulator: Path | None = None) -> Iterator[str]:
    """Run an image in real time; gives the name of a pseudo-terminal that stands for its serial line.

    It ends with the samples, or with the `with` block.
    """
    with tempfile.TemporaryDirectory() as name:
        samples = Path(name) / "samples"
        samples.write_bytes(checked_counts(counts).astype("<i2").tobytes())
        command = [str(simulator or _simulator()), str(image), str(samples), "/dev/null", "--real-time"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as board:  # noqa: S603 - our own program
            try:
                assert board.stdout is not None  # noqa: S101 - a pipe was asked for
                terminal = board.stdout.readline().strip()
                if not terminal:
                    raise DataError(f"{image} did not start in the simulated board")
                yield terminal
            finally:
                board.kill()
