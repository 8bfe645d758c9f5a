"""Exercises of the course: how long a student waits for a verdict, and how many wrong files are named."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

from measure.figures import Figure

__all__ = ["figures"]

MUST_S, REPEATS = 5.0, 5
TESTS = Path(__file__).resolve().parents[2]


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Seconds of the whole command on a right and on a wrong E1, and shares of the tables of the tests."""
    sys.path.insert(0, str(TESTS))  # the copies that the tests check
    from exercise_copies import RIGHT as OTHERS_RIGHT
    from exercise_mistakes import WRONG as OTHERS_WRONG
    from kalman_copies import PLAIN, RIGHT, WRONG

    rows = {}
    wrong = changed(PLAIN, WRONG["signe de l'innovation"])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "kalman.py"
        for name, text, code in (("right", PLAIN, 0), ("wrong", wrong, 3)):
            path.write_text(text, encoding="utf-8")
            seconds = median(timed(path, code) for _ in range(1 if quick else REPEATS))
            rows[f"check_{name}_e1"] = Figure(seconds, "s", "the whole command, wall", MUST_S)
        every = 8 if quick else 1
        cases = [(PLAIN, cause, changes) for cause, changes in WRONG.items()] + OTHERS_WRONG
        told = [named(path, changed(text, changes), cause) for text, cause, changes in cases[::every]]
        solutions = [*RIGHT.values(), *OTHERS_RIGHT.values()]
        passed = [accepted(path, text) for text in solutions]
    said = f"of {len(told)} wrong files, each with one mistake"
    rows["check_named"] = Figure(100 * sum(told) / len(told), "%", said, 100.0, better="higher")
    said = f"of {len(passed)} right files in several tastes"
    rows["check_accepted"] = Figure(100 * sum(passed) / len(passed), "%", said, 100.0, better="higher")
    return rows


def changed(text: str, changes: list[tuple[str, str]]) -> str:
    """A solution with some of its lines changed."""
    for before, after in changes:
        text = text.replace(before, after)
    return text


def timed(path: Path, code: int) -> float:
    """Wall seconds of `factorlab l19 check` in a fresh process, which must end as expected."""
    began = perf_counter()
    command = [sys.executable, "-m", "factorlab", "l19", "check", str(path)]
    done = subprocess.run(command, capture_output=True, check=False)
    assert done.returncode == code, done.stderr
    return perf_counter() - began


def named(path: Path, text: str, cause: str) -> bool:
    """Whether a wrong file is told by the name of its mistake."""
    from factorlab.l19.exercises.checking import check_path

    path.write_text(text, encoding="utf-8")
    (verdict,) = check_path(path)
    return any(finding.cause == cause for one in verdict.exercises for finding in one.of("FAIL"))


def accepted(path: Path, text: str) -> bool:
    """Whether a right file passes, with remarks or without."""
    from factorlab.l19.exercises.checking import check_path

    path.write_text(text, encoding="utf-8")
    return not check_path(path)[0].failed
