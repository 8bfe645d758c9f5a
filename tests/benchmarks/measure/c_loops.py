"""The loops of loops.c, compiled in this run and called with arrays."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .cases import DT, Linear, Planar

__all__ = ["Loop", "compile_loops", "linear_loop", "planar_loop", "series_loop"]

FLAGS = ("-O3", "-march=native", "-ffast-math", "-shared", "-fPIC")


@dataclass(frozen=True)
class Loop:
    """A piece of work, and where it leaves the filtered means, (steps, n) or (series, steps, n)."""

    work: Callable[[], float]
    mean: np.ndarray


def compile_loops() -> ctypes.CDLL:
    """With gcc, or what `cc` is here."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise SystemExit("the figures are ratios to C loops: install a C compiler, gcc or cc")
    source = Path(__file__).with_name("loops.c")
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "loops.so"
        subprocess.run([compiler, *FLAGS, str(source), "-o", str(library), "-lm"], check=True)
        return ctypes.CDLL(str(library))


def linear_loop(library: ctypes.CDLL, case: Linear) -> Loop:
    """The first series of a case."""
    n, m = case.sizes
    z = np.ascontiguousarray(case.z[0])
    mean = np.zeros((len(z), n))
    given = (case.F, case.H, case.Q, case.R, case.x0, case.P0, z, mean, np.zeros((len(z), n, n)))
    return Loop(_bound(library[f"linear_{n}_{m}"], (len(z),), given), mean)


def series_loop(library: ctypes.CDLL, case: Linear) -> Loop:
    """All series of a case, one after the other."""
    n, m = case.sizes
    count, steps = case.z.shape[:2]
    mean, cov = np.zeros((count, steps, n)), np.zeros((count, steps, n, n))
    given = (case.F, case.H, case.Q, case.R, case.x0, case.P0, case.z, mean, cov)
    return Loop(_bound(library[f"series_{n}_{m}"], (count, steps), given), mean)


def planar_loop(library: ctypes.CDLL, case: Planar, name: str) -> Loop:
    """The unicycle by `extended` or `unscented`."""
    steps = len(case.z)
    mean = np.zeros((steps, 3))
    given = (case.Q, case.R, case.x0, case.P0, case.z, mean, np.zeros((steps, 3, 3)))
    return Loop(_bound(library[name], (steps, DT), given), mean)


def _bound(function: Any, numbers: tuple[float, ...], arrays: tuple[np.ndarray, ...]) -> Callable[[], float]:
    """A call without arguments, which keeps its arrays alive."""
    function.restype = ctypes.c_double
    held = tuple(np.ascontiguousarray(a) for a in arrays)
    assert all(a is b for a, b in zip(held[-2:], arrays[-2:], strict=True)), "results are written in place"
    first = [ctypes.c_long(v) if isinstance(v, int) else ctypes.c_double(v) for v in numbers]
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in held]

    def work() -> float:
        assert held
        return float(function(*first, *pointers))

    return work
