"""A benchmark made of parts: each stands in `measure/NAME.py` and gives its own rows."""

from __future__ import annotations

import argparse
import importlib
import sys
from pathlib import Path
from time import perf_counter

from measure.figures import Figure, publish, say

sys.path.append(str(Path(__file__).resolve().parents[2]))


def measured(parts: list[str], *, quick: bool) -> dict[str, Figure]:
    """The rows of every part, in order."""
    rows: dict[str, Figure] = {}
    for name in parts:
        began = perf_counter()
        rows |= importlib.import_module(f"measure.{name}").figures(quick=quick)
        say(f"{name}: {perf_counter() - began:.0f} s")
    return rows


def run_parts(description: str | None, parts: tuple[str, ...]) -> int:
    """Read the command line, measure, print, and judge: 3 when a must is missed."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--json", action="store_true", help="one JSON document on stdout")
    parser.add_argument("--quick", action="store_true", help="fewer seeds: no measurement")
    parser.add_argument("--only", default=",".join(parts), metavar="NAME,NAME")
    asked = parser.parse_args()
    wanted = asked.only.split(",")
    if unknown := set(wanted) - set(parts):
        parser.error(f"no part is called {', '.join(sorted(unknown))}; there are {', '.join(parts)}")
    return publish(measured(wanted, quick=asked.quick))
