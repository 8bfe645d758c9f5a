"""A folder or a zip of text files, seen alike."""

from __future__ import annotations

import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

from sequential.errors import FileFormatError
from sequential.readers.imu.text_table import decoded

__all__ = ["Export", "open_export"]

DEEPEST = 4  # folders in folders


@dataclass(frozen=True, slots=True, eq=False)
class Export:
    """Names inside, with `/`, and where it lies; `zipped` tells which of the two it is."""

    where: str
    name: str
    inside: tuple[str, ...]
    zipped: bool

    def names(self, ending: str) -> list[str]:
        """Files of this ending, those nearest to the top first."""
        found = [name for name in self.inside if name.lower().endswith(f".{ending}")]
        return sorted(found, key=lambda name: (name.count("/"), name))

    def find(self, tail: str) -> str | None:
        """The file whose path ends so, nearest to the top."""
        found = [
            n for n in self.names(tail.rpartition(".")[2]) if f"/{n}".lower().endswith(f"/{tail.lower()}")
        ]
        return found[0] if found else None

    def text(self, name: str) -> str:
        """The text of a file inside."""
        if not self.zipped:
            return decoded((Path(self.where) / name).read_bytes(), f"{self.where}/{name}")
        try:
            with zipfile.ZipFile(self.where) as archive:
                content = archive.read(name)
        except Exception as fault:  # noqa: BLE001 - checksums, passwords, methods of compression
            raise FileFormatError(f"{self.where}: {name} cannot be unpacked ({fault})") from None
        return decoded(content, f"{self.where}: {name}")


def open_export(path: str | os.PathLike[str]) -> Export:
    """List a folder or a zip; raises `FileFormatError` for a zip that is broken."""
    place = Path(path)
    if place.is_dir():
        files = [p.relative_to(place) for p in place.rglob("*") if p.is_file()]
        inside = tuple(p.as_posix() for p in files if len(p.parts) <= DEEPEST and not p.name.startswith("."))
        return Export(os.fspath(path), place.name, inside, zipped=False)
    try:
        with zipfile.ZipFile(place) as archive:
            inside = tuple(n for n in archive.namelist() if not n.endswith("/") and "__MACOSX" not in n)
    except zipfile.BadZipFile:
        raise FileFormatError(f"{place} is not a zip that can be read; export it again") from None
    return Export(os.fspath(path), place.stem, inside, zipped=True)
