"""Compile every kernel once, so that first runs are quick: `python -m vision3d.warm_up`."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path

__all__ = ["warm_up"]


def warm_up(progress: Callable[[str], object] = lambda _: None) -> None:
    """Import every kernel, which compiles what is not in the cache yet; `progress` hears of each."""
    for path in sorted((Path(__file__).parent / "kernels").glob("[!_]*.py")):
        importlib.import_module(f"vision3d.kernels.{path.stem}")
        progress(path.stem)


if __name__ == "__main__":
    import sys

    warm_up(lambda what: sys.stderr.write(f"compiled vision3d {what}\n"))
