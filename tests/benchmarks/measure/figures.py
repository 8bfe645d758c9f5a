"""Figures with a bar to clear: a table for a reader, one JSON document for a machine."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from time import perf_counter


@dataclass(frozen=True)
class Figure:
    """One measured number.  `better` says in which direction; the must decides the exit code."""

    value: float
    unit: str
    reference: str
    must: float | None = None
    aim: float | None = None
    better: str = "lower"

    def meets(self, bar: float | None) -> bool:
        """Whether the value clears a bar; no bar is cleared by anything."""
        if bar is None:
            return True
        return self.value <= bar if self.better == "lower" else self.value >= bar


def interleaved(works: dict[str, Callable[[], object]], rounds: int = 5) -> dict[str, float]:
    """Median seconds of each piece of work: one warm-up each, then rounds in turn in this one process."""
    for work in works.values():
        work()
    times: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            began = perf_counter()
            work()
            times[name].append(perf_counter() - began)
    return {name: median(values) for name, values in times.items()}


def publish(figures: dict[str, Figure]) -> int:
    """Print everything; the exit code is 3 when a must is missed."""
    if "--json" in sys.argv[1:]:
        sys.stdout.write(json.dumps({"figures": {k: vars(f) for k, f in figures.items()}}, indent=1) + "\n")
    else:
        width = max(map(len, figures))
        for name, f in figures.items():
            bars = "  ".join(
                f"{what} {bar:g}" for what, bar in (("must", f.must), ("aim", f.aim)) if bar is not None
            )
            verdict = "" if f.must is None else ("ok" if f.meets(f.must) else "MISSED")
            verdict += " (aim)" if f.aim is not None and f.meets(f.aim) else ""
            sign = "<=" if f.better == "lower" else ">="
            line = (
                f"{name:<{width}}  {f.value:10.4g} {f.unit:<8} {sign} {bars:<24} {verdict:<12} {f.reference}"
            )
            sys.stdout.write(line.rstrip() + "\n")
    return 0 if all(f.meets(f.must) for f in figures.values()) else 3


def say(text: str) -> None:
    """Progress, on stderr."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()
