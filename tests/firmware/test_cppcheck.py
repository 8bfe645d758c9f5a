"""Static analysis of the core: no finding, and no departure from MISRA C:2012 but those on a written list."""

import csv
import re
import subprocess
from pathlib import Path

import pytest
from c_structs import CORE

CHECK = CORE.parent / "check"
SOURCES = [str(one) for one in sorted(CORE.glob("*.c"))]
TEMPLATE = "--template={file}:{line}: {id}: {message}"


def told(cppcheck, *arguments):
    """What cppcheck says of the core, a line a finding."""
    command = [cppcheck, "-q", "--std=c99", f"-I{CORE}", TEMPLATE, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return [line for line in done.stderr.splitlines() if line.strip()]


def rules(cppcheck, source):
    """Of MISRA C:2012 that a file departs from, with one place each."""
    found = {}
    for line in told(cppcheck, "--addon=misra", source):
        if rule := re.search(r"misra-c2012-(\d+\.\d+)", line):
            found.setdefault(rule[1], line)
    return found


def deviations():
    lines = (CHECK / "misra_deviations.csv").read_text().splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def test_there_is_no_finding(cppcheck):
    # where a variable is declared is a matter of taste: some files declare at the head of a block
    wanted = ("--enable=warning,style,performance,portability", "--suppress=variableScope")
    assert not told(cppcheck, *wanted, *SOURCES)


def test_it_finds_what_is_put_there(cppcheck, tmp_path):
    wrong = tmp_path / "wrong.c"
    wrong.write_text("int last(void);\nint last(void) { int a[2] = {0, 0}; return a[2]; }\n")
    assert any("arrayIndexOutOfBounds" in line for line in told(cppcheck, str(wrong)))


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: Path(path).name)
def test_departures_from_misra_are_on_the_list(cppcheck, source):
    listed = {row["rule"] for row in deviations()}
    assert not {rule: line for rule, line in rules(cppcheck, source).items() if rule not in listed}


def test_the_add_on_finds_what_is_put_there(cppcheck, tmp_path):
    wrong = tmp_path / "wrong.c"
    wrong.write_text("int f(int a);\nint f(int a) { if (a) { a = 1; } return a; }\n")
    assert "14.4" in rules(cppcheck, str(wrong))


def test_every_departure_has_its_reason():
    rows = deviations()
    assert all(row["stake"] and row["reason"] for row in rows)
    assert len({row["rule"] for row in rows}) == len(rows)
