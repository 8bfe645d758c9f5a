"""How many cycles one update of a fixed-point filter takes on an ATmega328P, counted in simavr."""

from __future__ import annotations

import functools
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from factorlab.firmware.avr import build_on_simavr, kept_folder
from factorlab.firmware.instructions import IMU_Q
from factorlab.firmware.toolchain import MACHINE, PLAIN, firmware_folder, require_tools, run_tool
from sequential.errors import DataError

__all__ = ["CycleCounts", "count_cycles"]

FLAGS = (*MACHINE["avr"], *PLAIN, "-O2", "-Wl,--gc-sections")
ROW = np.dtype([("sample", IMU_Q), ("periods", "u1"), ("unused", "u1", 3)])
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class CycleCounts:
    """What the emulator counted.

    Attributes
    ----------
    cycles : (N,) of each update, call and return included; the first is the update after the start
    stack : bytes of stack that an update used at most, its return address included
    states : (N, S) bytes of the state after each, as the AVR holds it: without gaps
    """

    cycles: Integers
    stack: int
    states: NDArray[np.uint8]

    @property
    def mean(self) -> float:
        """Cycles an update, on average."""
        return float(self.cycles.mean())

    @property
    def worst(self) -> int:
        """Cycles of the longest update."""
        return int(self.cycles.max())


def count_cycles(module: str, samples: NDArray[np.void], periods: ArrayLike | None = None) -> CycleCounts:
    """Run a filter of `firmware/core` with its constants at 100 Hz over samples, counting every update.

    Parameters
    ----------
    module : such as "mahony_q", with a header of constants `<module>_100hz.h`
    samples : (N,) of dtype `IMU_Q`, a period apart
    periods : (N,) that each sample stands for; 1 unless given, 0 starts anew

    Raises
    ------
    DataError
        where the samples are of another kind, or there are no constants for the module.
    ToolMissingError
        where compiler or emulator are missing.
    """
    if samples.dtype != IMU_Q:
        raise DataError(f"{module} takes samples of dtype {IMU_Q}, got {samples.dtype}")
    folder = firmware_folder()
    header = folder / "core" / f"{module}_100hz.h"
    if not header.is_file():
        raise DataError(f"there are no constants for {module} at 100 Hz: no {header.name} in {header.parent}")
    require_tools("avr", emulate=True)
    rows = np.zeros(len(samples) + 1, ROW)
    rows["sample"] = samples[np.r_[0, np.arange(len(samples))]]
    rows["periods"][1:] = 1 if periods is None else periods
    with tempfile.TemporaryDirectory(prefix="factorlab-cycles-") as name:
        image, given, taken = (Path(name) / one for one in ("image.elf", "rows", "answers"))
        sources = [folder / "check" / "cycles_avr.c", *sorted((folder / "core").glob("*_q*.c"))]
        defined = [f"-DMODULE={module}", f'-DHEADER="{header}"']
        command = [
            "avr-gcc",
            *FLAGS,
            *defined,
            f"-I{header.parent}",
            *map(str, sources),
            "-o",
            str(image),
            "-lm",
        ]
        run_tool(command, what=f"compiling {module} for avr")
        rows.tofile(given)
        state = _state_bytes(run_tool(["avr-nm", "-S", str(image)]))
        run_tool(
            [str(_simulator()), str(image), str(given), str(taken), str(state)], what=f"counting {module}"
        )
        answers = np.fromfile(taken, np.dtype([("cycles", "<u4"), ("stack", "<u4"), ("state", "u1", state)]))
    cycles = answers["cycles"][1:].astype(np.int64)
    return CycleCounts(cycles, int(answers["stack"].max()), answers["state"][1:])


def _state_bytes(symbols: str) -> int:
    """The letter box holds the periods, a sample, and the state."""
    box = next(line.split() for line in symbols.splitlines() if line.endswith(" box"))
    return int(box[1], 16) - 1 - IMU_Q.itemsize


@functools.cache
def _simulator() -> Path:
    source = firmware_folder() / "check" / "cycles_avr_simulator.c"
    return build_on_simavr([source], kept_folder() / "cycles", what="compiling the cycle counter")
