"""Compiled loops over pixels, points and views.  Importing a module here loads Numba.

Every kernel is decorated by `kernel`, with an explicit signature: it is compiled once per machine and kept on
disk.  The folder it is kept in carries a digest of the modules that others here import, because Numba itself
looks only at the file in which a function stands.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba

from sequential.cache_place import cache_place

__all__ = ["cache_folder", "entry", "inlined", "kernel"]

_IMPORTED = re.compile(r"from vision3d\.kernels\.(\w+) import")


def kernel(signature: Any, **options: Any) -> Callable[[Any], Any]:
    """Decorate a function that Python calls: compiled for the signature, kept on disk, without the GIL."""

    def decorate(function: Any) -> Any:
        with _kept():
            return numba.njit(signature, cache=True, error_model="numpy", nogil=True, **options)(function)

    return decorate


def inlined(function: Any) -> Any:
    """Decorate a small function that kernels call: it becomes a part of them."""
    with _kept():
        return numba.njit(cache=True, error_model="numpy", forceinline=True)(function)


def entry(signature: Any) -> Callable[[Any], Any]:
    """Decorate a function that kernels call by its `.address`: a plain C function, kept on disk."""

    def decorate(function: Any) -> Any:
        with _kept():
            return numba.cfunc(signature, cache=True, error_model="numpy")(function)

    return decorate


def cache_folder() -> Path:
    """Where compiled code is kept: NUMBA_CACHE_DIR, else the user's cache, else the temporary folder."""
    return cache_place(lambda: f"vision-{digest(Path(__file__).parent)}")


def digest(room: Path) -> str:
    """A name for the text of every module of a folder that another of them imports, and for Numba."""
    texts = {path.stem: path.read_text(encoding="utf-8") for path in sorted(room.glob("*.py"))}
    imported = {name for text in texts.values() for name in _IMPORTED.findall(text)}
    told = hashlib.sha256(numba.__version__.encode())
    for name in sorted(imported & texts.keys()):
        told.update(texts[name].encode())
    return told.hexdigest()[:16]


_folder = cache(cache_folder)


@contextmanager
def _kept() -> Iterator[None]:
    """Let Numba keep what is decorated meanwhile in this room's folder; other rooms have their own."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(_folder())
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before
