"""Compile every kernel once, so that first runs are quick: `python -m vision3d.warm_up`.

As many processes as there are cores share the work, each writing to the same disk cache.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

__all__ = ["warm_up"]

SHARED = ("arrays", "lenses")  # most others are made of these
LONGEST_FIRST = ("plane_posterior", "plane_minima", "quad_edges", "discs", "pose_refinement")


def warm_up(progress: Callable[[str], object] = lambda _: None) -> None:
    """Import every kernel, which compiles what is not in the cache yet; `progress` hears of each."""
    for name in SHARED:
        compile_kernel(name)
    found = {path.stem for path in (Path(__file__).parent / "kernels").glob("[!_]*.py")}
    rest = [*LONGEST_FIRST, *sorted(found - {*SHARED, *LONGEST_FIRST})]
    with ProcessPoolExecutor(len(os.sched_getaffinity(0)), mp_context=get_context("spawn")) as pool:
        jobs = {pool.submit(compile_kernel, name): name for name in rest}
        for job in as_completed(jobs):
            job.result()
            progress(jobs[job])


def compile_kernel(name: str) -> None:
    """Import one kernel, which compiles it."""
    importlib.import_module(f"vision3d.kernels.{name}")


if __name__ == "__main__":
    import sys

    warm_up(lambda what: sys.stderr.write(f"compiled vision3d {what}\n"))
