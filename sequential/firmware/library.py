"""The shared object of the C core: loaded once, compiled anew where a checkout's sources are newer."""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path

from sequential.errors import ToolMissingError
from sequential.firmware.build import compile_core, library_path, source_folder

__all__ = ["load_library", "missing"]

REMEDY = "run `python -m sequential.firmware`"


def load_library() -> ctypes.CDLL:
    """The C core as ctypes sees it.

    Raises
    ------
    ToolMissingError
        where it is not compiled and cannot be: one sentence with what to install.
    """
    found = loaded()
    if isinstance(found, str):
        raise ToolMissingError(found)
    return found


@functools.cache
def loaded() -> ctypes.CDLL | str:
    """The library, or why there is none; found out once a process."""
    path = library_path()
    try:
        if _stale(path):
            _compile(path)
        return ctypes.CDLL(str(path))
    except ToolMissingError as error:
        return str(error)
    except OSError as error:
        return f"the C core {path} does not load ({error}); {REMEDY}"


def missing() -> str:
    """Why the C filters cannot run here, one sentence; empty where they can."""
    found = loaded()
    return found if isinstance(found, str) else ""


def _stale(path: Path) -> bool:
    """Whether there is no library, or a file of the checkout that it was made of has changed since."""
    if not path.exists():
        return True
    folder = source_folder()
    if folder is None or folder.parent == path.parent:  # installed: library and sources came together
        return False
    made = path.stat().st_mtime_ns
    return any(
        file.stat().st_mtime_ns > made for part in ("core", "binding") for file in (folder / part).iterdir()
    )


def _compile(path: Path) -> None:
    folder = source_folder()
    if folder is None:
        raise ToolMissingError(
            "the C filters are not compiled here, and their sources are not here: install factorlab from "
            "its repository, with a C compiler (Debian: apt install gcc)"
        )
    try:
        compile_core(folder, path)
    except (RuntimeError, OSError) as error:
        reason = str(error).rstrip(".")
        raise ToolMissingError(f"the C filters are not compiled: {reason}; then {REMEDY}") from error
