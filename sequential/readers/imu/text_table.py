"""Tables of numbers from loggers and spreadsheets: any separator, decimal sign and preamble."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.readers.files import require_file

__all__ = ["TextTable", "decoded", "read_table", "table_of"]

Array = NDArray[np.float64]
SEPARATORS = (";", "\t", ",")
PREAMBLE = 60  # lines before the header, at most
MISSING = {"", "nan", "na", "n/a", "null", "none", "-", "inf", "-inf", "+inf"}
DECIMAL_COMMA = re.compile(r"^\s*[-+]?\d*,\d+(?:[eE][-+]?\d+)?\s*$")


@dataclass(frozen=True, slots=True, eq=False)
class TextTable:
    """Lines of cells with their numbers in the file; `header` is empty where there is none.

    `separator` None stands for blanks; `preamble` holds what stands above the header as KEY,VALUE.
    """

    where: str
    header: tuple[str, ...]
    body: list[str]
    lines: list[int]
    separator: str | None
    preamble: dict[str, str]

    def __len__(self) -> int:
        return len(self.body)

    @property
    def width(self) -> int:
        """Cells of the first row."""
        return len(_split(self.body[:1], self.separator)[0])

    def text(self, column: int) -> list[str]:
        """The cells of one column; an empty text where a row ends before it."""
        found = []
        for line in self.body:
            cells = line.split(self.separator, column + 1)
            found.append(cells[column].strip() if column < len(cells) else "")
        return found

    def numbers(self, columns: Sequence[int]) -> Array:
        """(N, m) numbers, NaN where a cell is empty or says so.

        Raises
        ------
        FileFormatError
            naming line and column of a cell that is no number.
        """
        try:
            return np.loadtxt(
                self.body, delimiter=self.separator, usecols=columns, comments=None, ndmin=2, dtype=np.float64
            )
        except (ValueError, IndexError):
            return self._mended(columns)

    def _mended(self, columns: Sequence[int]) -> Array:
        """As `numbers`, cell by cell."""
        found = np.full((len(self.body), len(columns)), np.nan)
        for k, row in enumerate(_split(self.body, self.separator)):
            for j, column in enumerate(columns):
                cell = row[column].strip() if column < len(row) else ""
                if cell.lower() in MISSING:
                    continue
                try:
                    found[k, j] = float(cell)
                except ValueError:
                    name = self.header[column] if column < len(self.header) else f"number {column}"
                    raise FileFormatError(
                        f"{self.where}, line {self.lines[k]}, column {name!r}: {cell!r} is not a number; "
                        "mend the cell or empty it"
                    ) from None
        return found


def read_table(path: str | os.PathLike[str], is_header: Callable[[Sequence[str]], bool]) -> TextTable:
    """Read a table from a file; see `table_of`."""
    file = require_file(path)
    return table_of(decoded(file.read_bytes(), os.fspath(path)), os.fspath(path), is_header)


def decoded(content: bytes, where: str) -> str:
    """Text in UTF-8, UTF-16 with a mark, or the code page of a western Windows.

    Raises
    ------
    FileFormatError
        for a binary file.
    """
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", errors="replace")
    if b"\0" in content[:4096]:
        raise FileFormatError(
            f"{where} is a binary file with a name that ends in {Path(where).suffix or 'nothing'}; IMU "
            "recordings are CSV, NPZ, MAT, HDF5, ULog (.ulg), or a folder or zip of CSV files"
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def table_of(text: str, where: str, is_header: Callable[[Sequence[str]], bool]) -> TextTable:
    """Cut a text into a table.

    Parameters
    ----------
    where : name of the file, for messages
    is_header : does a row of cells name the columns?  The first row that does, within 60 lines, is the
        header; else the first row with words in every second cell is

    Raises
    ------
    FileFormatError
        for an empty text, or one with a header and nothing below.
    """
    kept = [(n, line) for n, line in enumerate(text.splitlines(), start=1) if line.strip(" \t,;\ufeff")]
    if not kept:
        raise FileFormatError(f"{where} is empty; a recording has a header such as t,ax,ay,az,gx,gy,gz")
    at, separator, header = _header(kept, is_header)
    numbered = [(n, line) for n, line in kept[at + bool(header) :] if not line.lstrip().startswith("#")]
    plain = _plain([line for _, line in numbered], separator)
    numbered = [(n, line) for (n, _), line in zip(numbered, plain, strict=True) if line.strip()]
    body = [line for _, line in numbered]
    if header and len(body) > 1 and not any(map(_is_number, _split(body[:1], separator)[0])):
        body, numbered = body[1:], numbered[1:]  # a second line of header: units, or axes
    if not body:
        raise FileFormatError(f"{where} has a header and no sample; the recording is empty")
    preamble = {}
    for _, line in kept[:at]:
        key, _, value = line.strip('#" ').partition(_separator(line) or ":")
        preamble[key.strip().strip('"')] = value.strip().strip('"')
    return TextTable(where, tuple(header), body, [n for n, _ in numbered], separator, preamble)


def _plain(body: list[str], separator: str | None) -> list[str]:
    """Lines without quotes, and with decimal points."""
    if separator is not None and any('"' in line for line in body):
        rows = [next(csv.reader([line], delimiter=separator, skipinitialspace=True), []) for line in body]
        body = [separator.join(_bare(cell, separator) for cell in cells) for cells in rows]
    if separator == ",":
        return body
    first = (cell for cells in _split(body[:200], separator) for cell in cells)
    return [line.replace(",", ".") for line in body] if any(map(DECIMAL_COMMA.match, first)) else body


def _bare(cell: str, separator: str) -> str:
    """A cell that was quoted, without separators of its own."""
    return cell.replace(",", "." if DECIMAL_COMMA.match(cell) else " ").replace(separator, " ")


def _header(
    kept: list[tuple[int, str]], is_header: Callable[[Sequence[str]], bool]
) -> tuple[int, str | None, list[str]]:
    """Index of the header's line, the separator of the table, and its cells; no cells for bare numbers."""
    worded: tuple[int, str | None, list[str]] | None = None
    for at, (_, line) in enumerate(kept[:PREAMBLE]):
        separator = _separator(line)
        cells = _trimmed(_split([line.lstrip("# ")], separator)[0])
        if is_header(cells):
            return at, separator, cells
        if len(cells) > 2 and all(_is_number(cell.replace(",", ".")) for cell in cells):
            return worded or (at, separator, [])
        if len(cells) > 2 and worded is None:
            worded = at, separator, cells
    return worded or (0, _separator(kept[0][1]), [])


def _separator(line: str) -> str | None:
    """The separator of a line; None stands for blanks."""
    counts = {mark: line.count(mark) for mark in SEPARATORS}
    if counts[";"] or counts["\t"]:  # a comma beside these is a decimal sign
        return ";" if counts[";"] >= counts["\t"] else "\t"
    return "," if counts[","] else None


def _split(lines: list[str], separator: str | None) -> list[list[str]]:
    if separator is None:
        return [line.split() for line in lines]
    if any('"' in line for line in lines):
        return [next(csv.reader([line], delimiter=separator, skipinitialspace=True), []) for line in lines]
    return [line.split(separator) for line in lines]


def _trimmed(cells: list[str]) -> list[str]:
    found = [cell.strip() for cell in cells]
    while found and not found[-1]:
        found.pop()
    return found


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
