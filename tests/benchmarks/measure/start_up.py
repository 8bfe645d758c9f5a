"""What a fresh process costs: the import of `sequential`, and a first result with warm caches."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from statistics import median

from .figures import Figure

__all__ = ["figures"]

BARS = {"import": (0.3, 0.3), "linear": (1.0, 0.7), "extended": (1.0, 0.7)}
REPEATS = 5


def fresh(what: str) -> tuple[float, float]:
    """CPU seconds since the process began, interpreter included, and wall seconds since its first line."""
    command = [sys.executable, str(Path(__file__).with_name("first_call.py")), what]
    answer = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    return float(answer[0]), float(answer[1])


def figures() -> dict[str, Figure]:
    """Medians of fresh processes in turn, after one of each."""
    times: dict[str, list[tuple[float, float]]] = {what: [] for what in BARS}
    for what in BARS:
        fresh(what)
    for _ in range(REPEATS):
        for what, seen in times.items():
            seen.append(fresh(what))
    found = {}
    for what, seen in times.items():
        name = "import_seconds" if what == "import" else f"first_call_{what}_seconds"
        cpu, wall = (median(column) for column in zip(*seen, strict=True))
        found[name] = Figure(cpu, "s", "CPU of the whole process, interpreter and imports", *BARS[what])
        found[f"{name}_wall"] = Figure(wall, "s", "wall, other processes included")
    return found
