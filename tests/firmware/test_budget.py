"""What every filter takes stays within firmware/budget.csv, and the file tells no tales."""

import pytest

from factorlab.firmware.budget import NUMBERS, ROWS, measure, read_budget, write_budget

BUDGET = read_budget()
LOOSE = 1.25  # a figure that became this much better is to be written down


@pytest.mark.parametrize("row", BUDGET, ids=lambda row: f"{row.target}-{row.filter}-{row.axes}")
def test_a_filter_stays_within_its_budget(row, arm_toolchain, qemu, avr_toolchain, simavr):
    measured = measure(row.target, row.filter, row.axes)
    over = {
        n: (getattr(measured, n), getattr(row, n)) for n in NUMBERS if getattr(measured, n) > getattr(row, n)
    }
    assert not over, "more than firmware/budget.csv allows (measured, budget)"
    slack = {
        n: (getattr(measured, n), getattr(row, n))
        for n in NUMBERS
        if getattr(row, n) > LOOSE * getattr(measured, n) + 16
    }
    assert not slack, "far below the budget: python -m factorlab.firmware.budget > firmware/budget.csv"


def test_every_filter_has_a_row(firmware_dir):
    there = {row for row in ROWS if (firmware_dir / "core" / f"{row[1]}.c").is_file()}
    assert {(row.target, row.filter, row.axes) for row in BUDGET} == there


def test_the_file_is_what_is_written(firmware_dir):
    assert write_budget(BUDGET) == (firmware_dir / "budget.csv").read_text(encoding="utf-8")
