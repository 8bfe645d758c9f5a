"""What every filter may take on every target: firmware/budget.csv, and how its figures are measured.

`python -m factorlab.firmware.budget` measures all of them and prints the file anew.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path

from factorlab.firmware.toolchain import firmware_folder
from factorlab.report.document import Cell, Table
from sequential.sensors import ImuRecording

__all__ = ["FILE", "ROWS", "STEPS", "Budget", "measure", "memory_table", "read_budget", "write_budget"]

FILE = "budget.csv"
SAMPLES = 3000  # of the simulated minute, at 100 Hz
# target, module, axes
ROWS = (
    ("m4", "mahony_f32", "6-D as published"), ("m4", "mahony_f32", "6-D"), ("m4", "mahony_f32", "9-D"),
    ("m4", "tilt_f32", "6-D"),
    ("m4", "complementary_f32", "6-D"), ("m4", "error_state_f32", "6-D"), ("m4", "error_state_f32", "9-D"),
    ("m4", "mahony_q", "6-D"), ("m4", "tilt_q", "6-D"), ("m4", "complementary_q", "6-D"),
    ("avr", "mahony_q", "6-D"), ("avr", "tilt_q", "6-D"), ("avr", "complementary_q", "6-D"),
)  # fmt: skip


# where it is not `<module>_step`
STEPS = {
    ("mahony_f32", "6-D"): "mahony_f32_step_6d",
    ("mahony_f32", "6-D as published"): "mahony_f32_step_published",
}


@dataclass(frozen=True, slots=True)
class Budget:
    """One filter on one target.

    Parameters
    ----------
    target : "m4" (Cortex-M4F) or "avr" (ATmega328P)
    filter : module of firmware/core
    axes : "6-D", or "9-D" with magnetometer; "6-D as published": the filter of the paper alone
    text : bytes of code and constants of start, step and attitude
    state : bytes that change with every sample
    stack : bytes of the deepest path from the step
    mean, worst : of an update: instructions on the M4, cycles on the AVR
    """

    target: str
    filter: str
    axes: str
    text: int
    state: int
    stack: int
    mean: int
    worst: int


def read_budget(path: Path | None = None) -> tuple[Budget, ...]:
    """The rows of the file; of firmware/budget.csv unless told otherwise."""
    with (path or firmware_folder() / FILE).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return tuple(
        Budget(row["target"], row["filter"], row["axes"], *(int(row[name]) for name in NUMBERS))
        for row in rows
    )


NUMBERS = ("text", "state", "stack", "mean", "worst")
HEAD = """\
# What a filter may take: bytes of code and constants (text), of state, of stack; instructions (m4) or cycles
# (avr) of an update, mean and worst over 3000 samples of a simulated motion.  tests/firmware/test_budget.py
# measures them again; python -m factorlab.firmware.budget > firmware/budget.csv writes them anew.
"""


def write_budget(rows: Iterable[Budget]) -> str:
    """The file's text."""
    lines = [",".join(field.name for field in fields(Budget))]
    lines += [",".join(map(str, astuple(row))) for row in rows]
    return HEAD + "\n".join(lines) + "\n"


def measure(target: str, module: str, axes: str) -> Budget:
    """One row, measured by compiling and emulating.

    Raises
    ------
    ToolMissingError
        where a compiler or an emulator is missing.
    """
    from factorlab.firmware.instructions import imu_q
    from factorlab.firmware.sizes import module_sizes

    recording = _motion(axes)
    step = STEPS.get((module, axes))
    sizes = module_sizes(module, target, step=step)
    if target == "avr":
        from factorlab.firmware.cycles import count_cycles

        counts = count_cycles(module, imu_q(recording))
        stack, mean, worst = counts.stack, counts.mean, counts.worst
    else:
        from factorlab.firmware.instructions import count_instructions, imu_f32

        samples = imu_q(recording) if module.endswith("_q") else imu_f32(recording)
        counted = count_instructions(module, samples, step=step)
        stack, mean, worst = sizes.stack, counted.mean, counted.worst
    return Budget(target, module, axes, sizes.text, sizes.state, max(stack, sizes.stack), round(mean), worst)


def _motion(axes: str) -> ImuRecording:
    """The same samples wherever this runs."""
    from factorlab.firmware.verify import simulated

    whole = simulated().select(slice(0, SAMPLES))
    return whole if axes == "9-D" else replace(whole, mag=None)


def memory_table() -> Table | None:
    """The file as a table for a report; None where this installation has none."""
    try:
        rows = read_budget()
    except OSError:
        return None
    heads = (
        "filter", "on", "", ("code", "B"), ("state", "B"), ("stack", "B"), ("update, mean", "instr./cycles"),
        ("longest", "instr./cycles"),
    )  # fmt: skip
    cells: list[tuple[Cell, ...]] = [
        (row.filter, row.target, row.axes, row.text, row.state, row.stack, row.mean, row.worst)
        for row in rows
    ]
    caption = "firmware/budget.csv: instructions on the M4, cycles on the AVR; the tests measure it again."
    return Table(heads, tuple(cells), caption, digits=6)


def main() -> int:
    """Measure what is there and print the file."""
    core = firmware_folder() / "core"
    there = [row for row in ROWS if (core / f"{row[1]}.c").is_file()]
    sys.stdout.write(write_budget(measure(*row) for row in there))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
