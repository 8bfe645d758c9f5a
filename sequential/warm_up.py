"""Compile every kernel and built-in model once, so that first runs are quick.

`python -m sequential.warm_up` makes everything, `python -m sequential.warm_up extended inertial` some rooms
only.  Two processes share the work, each writing to the same disk cache; what is cached costs a second.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import Any

from sequential.errors import ModelError

__all__ = ["warm_up"]

# Small functions first, since every kernel needs them; then the kernels, the longest to compile first.
SMALL = (
    "matrices",
    "poses",
    "charts",
    "belief",
    "bierman",
    "mixing",
    "orthogonal",
    "informing",
    "resampling",
    "sensing",
)
KERNELS = (
    "linear sizes",
    "extended sizes",
    "unscented sizes",
    "multiple",
    "extended",
    "online_extended",
    "unscented",
    "linear",
    "series",
    "multiple_smoothing",
    "factored",
    "online_factored",
    "online_sigma_points",
    "online_information",
    "information",
    "iterated",
    "linearize",
    "particles",
    "backward_simulation",
    "smoothing",
    "scripted",
    "looking",
    "walking",
)
# what is made for common sizes
SIZED = {"linear": "filter_linear", "extended": "filter_log", "unscented": "filter_sigma_points"}
MODELS = (
    "motion",
    "unicycle",
    "inertial",
    "position",
    "ranging",
    "direction",
    "declared",
    "linear",
    "exponential",
)
# loops that live beside the Python they serve
BESIDE = (
    "attitude.turning_kernel",
    "attitude.mahony_kernel",
    "attitude.madgwick_kernel",
    "attitude.complementary_kernel",
    "attitude.tilt_kernel",
    "attitude.smoother_forward_kernel",
    "attitude.smoother_backward_kernel",
    "attitude.smoother_dense_kernel",
    "attitude.smoother_rows_kernel",
    "attitude.error_state_tilt_kernel",
    "attitude.error_state_heading_kernel",
    "attitude.error_state_step_kernel",
    "attitude.error_state_kernel",
    "sensors.allan_kernel",
)
ROOMS = (*KERNELS, *BESIDE, *MODELS)


def warm_up(progress: Callable[[str], object] = lambda _: None, *rooms: str) -> None:
    """Compile whatever is not in the cache yet.

    Parameters
    ----------
    progress : hears what has just been made
    rooms : names of kernels and of rooms of models; all of them by default

    Raises
    ------
    ModelError
        where there is no such room.
    """
    wanted = rooms or ROOMS
    if unknown := [room for room in wanted if room not in ROOMS]:
        msg = f"there is nothing to compile in {unknown[0]!r}; there are {', '.join(ROOMS)}"
        raise ModelError(msg)
    for name in SMALL:
        importlib.import_module(f"sequential.kernels.{name}")
    progress("small matrices and charts")
    workers = max(1, min(len(os.sched_getaffinity(0)), len(wanted)))
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        # in the order of KERNELS, the longest first
        jobs = {pool.submit(compile_kernel, name): f"kernel {name}" for name in KERNELS if name in wanted}
        jobs |= {pool.submit(compile_models, name): f"models {name}" for name in MODELS if name in wanted}
        jobs |= {pool.submit(compile_loops, name): f"loops {name}" for name in BESIDE if name in wanted}
        for job in as_completed(jobs):
            job.result()
            progress(jobs[job])


def compile_kernel(name: str) -> None:
    """Import one kernel, which compiles it; with " sizes" behind its name, make it for common ones too."""
    room = name.removesuffix(" sizes")
    module = importlib.import_module(f"sequential.kernels.{room}")
    if room != name:
        from sequential.compile import make
        from sequential.filters.specialised import COMMON

        for state, reading in COMMON[room]:
            sizes = (state, reading) if room == "linear" else (state, state, reading)
            make(getattr(module, SIZED[room]), *sizes)


def compile_models(name: str) -> None:
    """Compile the functions of one room of models."""
    from sequential.compile import built_in

    module = importlib.import_module(f"sequential.models.{name}")
    for function in vars(module).values():
        if is_raw(function) and function.__module__ == module.__name__:
            built_in(function, getattr(module, "HELPERS", ()))


def compile_loops(name: str) -> None:
    """Import loops that live beside their Python, which compiles them."""
    importlib.import_module(f"sequential.{name}")


def is_raw(function: Any) -> bool:
    """Whether something is a model function in the kernels' calling convention."""
    code = getattr(function, "__code__", None)
    return code is not None and code.co_varnames[: code.co_argcount] == ("x", "u", "dt", "p", "out")


if __name__ == "__main__":
    import sys

    warm_up(lambda what: sys.stderr.write(f"compiled {what}\n"), *sys.argv[1:])
