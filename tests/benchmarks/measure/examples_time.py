"""All of examples/, two at a time and warm: how long a student waits for the whole course."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import perf_counter

from measure.figures import Figure, say

__all__ = ["figures"]

ROOT = Path(__file__).resolve().parents[3]
PARTS = {"figures.py", "claims.py"}  # what examples import is none
AT_ONCE = 2
MUST_S = 300.0
QUICK = "0[1-5]_*.py"


def figures(*, quick: bool = False) -> dict[str, Figure]:
    """Wall-clock seconds of a pass over every example, after one that fills the compiled cache."""
    folder = ROOT / "examples"
    found = sorted((folder / "l19").glob(QUICK) if quick else folder.rglob("*.py"))
    scripts = [path for path in found if path.name not in PARTS]
    with tempfile.TemporaryDirectory() as out:
        _pass(scripts, Path(out))
        began, busy = perf_counter(), _children_s()
        seconds = _pass(scripts, Path(out))
        whole, busy = perf_counter() - began, _children_s() - busy
    slowest = sorted(seconds, key=lambda name: -seconds[name])[:5]
    say("slowest: " + ", ".join(f"{name} {seconds[name]:.1f} s" for name in slowest))
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    told = f"{len(scripts)} files, {AT_ONCE} at a time on {cores} cores, warm"
    return {
        "examples_all": Figure(whole, "s", told, None if quick else MUST_S),
        "examples_cpu": Figure(busy, "s", "processor time of all of them, whatever else the machine does"),
        "examples_slowest": Figure(seconds[slowest[0]], "s", f"{slowest[0]}, beside another"),
    }


def _children_s() -> float:
    times = os.times()
    return times.children_user + times.children_system


def _pass(scripts: list[Path], out: Path) -> dict[str, float]:
    """Seconds of each script."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        return dict(pool.map(lambda path: _timed(path, out), scripts))


def _timed(path: Path, out: Path) -> tuple[str, float]:
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
    began = perf_counter()
    done = subprocess.run(
        [sys.executable, path], cwd=out, env={**os.environ, **threads},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{path.name} ends with {done.returncode}: {done.stderr.strip().splitlines()[-1]}")
    return path.name, perf_counter() - began
