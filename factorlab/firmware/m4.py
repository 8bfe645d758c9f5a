"""An image for the Cortex-M4F, run in QEMU's mps2-an386 on recorded samples."""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from factorlab.firmware.emulation import PERIOD_US, Emulation, Floats, frames_of_samples
from factorlab.firmware.recorded import recorded_rows
from factorlab.firmware.toolchain import mps2, require_tools, run_tool
from sequential.errors import DataError, SolverError

__all__ = ["CLOCK_HZ", "emulate_m4", "live_m4", "run_mps2", "tick_periods"]

EMULATOR = "qemu-system-arm"
CLOCK_HZ = 25e6  # of the mps2-an386
BAUD = 500_000  # of the line that its bytes are put on afterwards
PERIOD_S = PERIOD_US * 1e-6
SHIFT = 10  # 2^shift ns an instruction: 25.6 counts of the timer, so that single instructions are told apart
PERIOD = np.dtype(
    [("row", "<i4")]
    + [(name, "<u4") for name in ("tick", "sample", "update_start", "update_end", "first_byte", "sent")]
)
EMPTY, STACK = -2, -3  # rows of records that are not of a period
Periods = NDArray[np.void]


def emulate_m4(
    image: Path, counts: ArrayLike, *, mode: str = "q", faults: ArrayLike | None = None
) -> Emulation:
    """Run an image on samples of an MPU-6050, and count the instructions between what happens.

    Each period follows the one before at once, so that 20 000 samples take a second or two.  QEMU counts
    instructions, not cycles, and its serial line takes no time: `update_cycles` are instructions, the times
    within a period are those of one cycle an instruction at 25 MHz, and bytes follow the first one of their
    frame at 500 000 baud.

    Parameters
    ----------
    image : firmware.elf of firmware/ports/cortex_m4, BOARD=qemu
    counts : (N, 7) int16 rows ax ay az temperature gx gy gz, as from `mpu6050_counts`
    mode : `q` quaternion, `a` angles, `r` raw or `t` text frames; a command that the board receives
    faults : (N,) what the sensor does in the period of a row, see `recorded_rows`

    Raises
    ------
    DataError
        for counts, faults or a mode that are none.
    ToolMissingError
        where QEMU is missing, or cannot run the image.
    """
    rows = recorded_rows(counts, mode=mode, faults=faults)
    data, log = run_mps2(image, rows, command=mode, shift=SHIFT)
    stack = int(log["tick"][log["row"] == STACK][0])
    empty = log[log["row"] == EMPTY][0]
    periods = log[log["row"] > STACK][1:]
    byte_s, sample_s, update = _times(periods, empty, len(data), len(rows))
    begun = np.flatnonzero(periods["row"] == 0)
    start_us = (int(begun[0]) + 1) * PERIOD_US if len(begun) else PERIOD_US
    frames, first_byte_s, boot, corrupt = frames_of_samples(data, byte_s, start_us, len(rows))
    return Emulation(
        target="mps2-an386",
        filter=boot.filter if boot else "unknown",
        mode=mode,
        data=data,
        byte_s=byte_s,
        frames=frames,
        boot=boot,
        update_cycles=update,
        sample_s=sample_s,
        first_byte_s=first_byte_s,
        corrupt=corrupt,
        stack=stack,
    )


def _times(periods: Periods, empty: np.void, size: int, count: int) -> tuple[Floats, Floats, Floats]:
    """Of every byte, s; of every row's sample, s; and of every row's update, instructions."""
    begin = np.arange(1, len(periods) + 1) * PERIOD_S

    def after_tick(name: str) -> Floats:
        passed = _instructions(periods["tick"], periods[name])
        return np.asarray(np.where(periods[name] > 0, begin + passed / CLOCK_HZ, np.nan), np.float64)

    first, sample = after_tick("first_byte"), after_tick("sample")
    taken = _instructions(empty["update_start"], empty["update_end"])
    update = _instructions(periods["update_start"], periods["update_end"]) - taken
    sample_s, update_of_row = np.full(count, np.nan), np.full(count, np.nan)
    served = (periods["row"] >= 0) & (periods["row"] < count)
    sample_s[periods["row"][served]] = sample[served]
    updated = served & (periods["update_end"] > 0)
    update_of_row[periods["row"][updated]] = update[updated]
    return _on_the_line(periods, first, size), sample_s, update_of_row


def _on_the_line(periods: Periods, first: Floats, size: int) -> Floats:
    """(B,) when bytes leave: those of a period one after the other, at the line's rate."""
    sent = np.append(periods["sent"], size).astype(np.int64)
    # what leaves before the first period: the boot frame
    byte_s: Floats = np.arange(size, dtype=np.float64) * (10.0 / BAUD)
    for start, begin, end in zip(first, sent[:-1], sent[1:], strict=True):
        byte_s[begin:end] = start + np.arange(end - begin) * (10.0 / BAUD)
    return byte_s


def _instructions(start: NDArray[np.uint32], end: NDArray[np.uint32], shift: int = SHIFT) -> Floats:
    """Instructions between two readings of the timer, which counts 40 ns."""
    passed = np.asarray(end, np.int64) - np.asarray(start, np.int64)
    return np.asarray(np.rint(passed * 40.0 / 2**shift), np.float64)


def tick_periods(image: Path, counts: ArrayLike, *, shift: int = 0) -> NDArray[np.int64]:
    """Run an image that was built with CLOCK=systick; the (P,) clocks of 25 MHz between its ticks.

    The tick interrupts whatever runs; a period of 100 Hz is 250 000 clocks.  QEMU waits ten million
    instructions a period (half as many for each `shift`): some 20 periods a second.

    Parameters
    ----------
    image : firmware.elf of firmware/ports/cortex_m4, BOARD=qemu CLOCK=systick
    counts : (N, 7) rows; the sensor's start takes some 20 periods before them
    shift : 2^shift ns an instruction

    Raises
    ------
    ToolMissingError
        where QEMU is missing, or cannot run the image.
    """
    rows = recorded_rows(counts, mode="q")
    _, log = run_mps2(image, rows, command="q", shift=shift)
    ticks: NDArray[np.int64] = log["tick"][log["row"] > EMPTY].astype(np.int64)
    return ticks[1:] - ticks[:-1]


def run_mps2(image: Path, rows: NDArray[np.void], *, command: str, shift: int) -> tuple[bytes, Periods]:
    """What came over the serial line, and the log of firmware/ports/cortex_m4/qemu/log.h.

    Raises
    ------
    ToolMissingError
        where QEMU is missing, or cannot run the image.
    SolverError
        where the image stopped early.
    """
    require_tools("m4", emulate=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows.tofile(folder / "rows")
        timed = ["-serial", "file:bytes", "-icount", f"shift={shift}"]
        run_tool([*_qemu(image, command), *timed], cwd=folder, what=f"emulating {image.name}")
        data, log = (folder / "bytes").read_bytes(), np.fromfile(folder / "log", PERIOD)
    if not len(log) or log["row"][-1] != STACK:
        raise SolverError(
            f"{image.name} stopped after {len(log)} of {len(rows)} periods; build it anew with BOARD=qemu"
        )
    return data, log


@contextmanager
def live_m4(image: Path, counts: ArrayLike) -> Iterator[str]:
    """Run an image in real time; gives the name of a pseudo-terminal that stands for its serial line.

    It ends with the samples, or with the `with` block.  Its tick is as even as this computer lets it be.

    Parameters
    ----------
    image : firmware.elf of firmware/ports/cortex_m4, BOARD=qemu CLOCK=systick
    counts : (N, 7) rows, as `emulate_m4` takes them

    Raises
    ------
    DataError
        where the emulator does not start.
    """
    require_tools("m4", emulate=True)
    rows = recorded_rows(counts, mode="q")
    with tempfile.TemporaryDirectory() as name:
        rows.tofile(Path(name) / "rows")
        command = [*_qemu(image, ""), "-serial", "pty"]
        with subprocess.Popen(command, cwd=name, stdout=subprocess.PIPE, text=True) as board:  # noqa: S603 - QEMU
            try:
                said = board.stdout.readline() if board.stdout else ""
                terminal = re.search(r"/dev/\S+", said)
                if terminal is None:
                    raise DataError(f"{image} did not start in {EMULATOR}: {said.strip() or 'no word'}")
                yield terminal.group()
            finally:
                board.kill()


def _qemu(image: Path, command: str) -> list[str]:
    """All but the serial line and the time; the rows and the log lie in the folder where it runs."""
    return mps2(image, [word for word in ("firmware", "rows", "log", command) if word])
