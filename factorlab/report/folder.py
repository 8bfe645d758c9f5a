"""A folder of results that appears whole or not at all."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sequential.errors import DataError

__all__ = ["MANIFEST", "OutputExistsError", "require_free", "whole_folder"]

MANIFEST = "report.json"  # its "files" name what a later run may take away


class OutputExistsError(DataError):
    """The folder for the results already holds something."""


def require_free(target: Path, *, force: bool) -> None:
    """Raise unless results may be written to `target`; called before the work is done.

    Raises
    ------
    OutputExistsError
        where the folder holds files and `force` is False, or where it is a file.
    """
    if target.exists() and not target.is_dir():
        msg = f"{target} is a file; -o needs a folder"
        raise OutputExistsError(msg)
    if not force and target.is_dir() and any(target.iterdir()):
        msg = f"{target} already holds files; choose another folder with -o, or write over them with --force"
        raise OutputExistsError(msg)
    parent = _existing(target)
    if not parent.is_dir():
        msg = f"{target} cannot be made: {parent} is a file"
        raise OutputExistsError(msg)


def _existing(path: Path) -> Path:
    """The nearest parent that exists."""
    for parent in path.absolute().parents:
        if parent.exists():
            return parent
    return Path("/")


@contextmanager
def whole_folder(target: Path, *, force: bool) -> Iterator[Path]:
    """A temporary folder beside `target` whose files are moved into it once the block has ended well.

    With `force`, files of an earlier report are taken away first; whatever else is there stays.
    """
    require_free(target, force=force)
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    try:
        yield temporary
        temporary.chmod(0o755)  # mkdtemp makes a private folder
        _move(temporary, target)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _move(source: Path, target: Path) -> None:
    if not target.exists() or not any(target.iterdir()):
        source.replace(target)  # one step: the folder is empty or absent
        return
    for name in _earlier_files(target):
        (target / name).unlink(missing_ok=True)
        with suppress(OSError):  # not empty, or gone already
            (target / name).parent.rmdir()
    # the manifest last, so that a folder with one is complete
    files = sorted((p for p in source.rglob("*") if p.is_file()), key=lambda p: p.name == MANIFEST)
    for path in files:
        place = target / path.relative_to(source)
        place.parent.mkdir(parents=True, exist_ok=True)
        path.replace(place)


def _earlier_files(target: Path) -> list[str]:
    """Files that an earlier report says it wrote, those inside the folder only."""
    try:
        names = json.loads((target / MANIFEST).read_text(encoding="utf-8")).get("files", [])
    except (OSError, ValueError, AttributeError):
        return []
    whole = target.resolve()
    return [
        name for name in names if isinstance(name, str) and (target / name).resolve().is_relative_to(whole)
    ]
