"""Files at the door: what is missing is named, what is written appears whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import IO, Any

from sequential.errors import DataError, FileFormatError

__all__ = ["read_text", "replacing", "require_file"]


def require_file(path: str | os.PathLike[str]) -> Path:
    """Give the path of an existing file, or raise `DataError` with the nearest name in its folder."""
    found = Path(path)
    if found.is_dir():
        raise DataError(f"{found} is a folder, a file is needed")
    if not found.is_file():
        siblings = [p.name for p in found.parent.iterdir()] if found.parent.is_dir() else []
        near = get_close_matches(found.name, siblings, n=1)
        hint = f"; did you mean {found.parent / near[0]}?" if near else "; check the name and the folder"
        raise DataError(f"there is no file {found}{hint}")
    return found


def read_text(path: str | os.PathLike[str]) -> str:
    """Read a text file, with or without a byte order mark; raises `DataError`, `FileFormatError`."""
    found = require_file(path)
    try:
        return found.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as fault:
        raise FileFormatError(
            f"{found} is not text in UTF-8 (byte {fault.start}); save it as UTF-8, or name an NPZ file .npz"
        ) from None


@contextmanager
def replacing(path: str | os.PathLike[str], mode: str = "w") -> Iterator[IO[Any]]:
    """Open a temporary file beside `path` that takes its place when the block ends well.

    Whatever goes wrong inside the block, `path` keeps what it held.
    """
    goal = Path(path)
    if not goal.parent.is_dir():
        raise DataError(f"{goal} cannot be written: there is no folder {goal.parent}; create it first")
    text: dict[str, Any] = {} if "b" in mode else {"encoding": "utf-8", "newline": "\n"}
    handle, name = tempfile.mkstemp(dir=goal.parent, prefix=f".{goal.name}.")
    try:
        with os.fdopen(handle, mode, **text) as file:
            yield file
        umask = os.umask(0)
        os.umask(umask)
        Path(name).chmod(0o666 & ~umask)  # mkstemp makes private files
        Path(name).replace(goal)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
