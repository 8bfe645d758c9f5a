"""Rows of a CSV file as text, with the number of the line that each came from."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError, NotFiniteError
from sequential.readers.files import read_text
from sequential.readers.stamps import stamp_ns, stamp_s

__all__ = ["CsvTable", "Reading", "numbers", "read_csv_table", "stamps"]

SEPARATORS = (",", ";", "\t")
TIME = {"t": stamp_s, "t_ns": stamp_ns}


@dataclass(frozen=True, slots=True, eq=False)
class CsvTable:
    """`header` and `rows` of stripped cells, the line of each row, and the comments without their `#`."""

    path: str
    header: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    comments: tuple[str, ...]

    def where(self, line: int) -> str:
        """Name a place in the file."""
        return f"{self.path}, line {line}"

    @property
    def time(self) -> str:
        """Name of the time column; raises `FileFormatError` unless there is one."""
        found = [name for name in TIME if name in self.header]
        if len(found) != 1:
            raise FileFormatError(
                f"{self.path}: the header needs one time column, 't' (seconds) or 't_ns' (nanoseconds); "
                f"it has {', '.join(self.header)}"
            )
        return found[0]


@dataclass(slots=True)
class Reading:
    """Cells of one reading of a stream, and the line on which they stand."""

    line: int
    t: str
    values: list[str]
    context: list[str]


def read_csv_table(path: str | os.PathLike[str]) -> CsvTable:
    """Read a CSV file whose first row is a header.

    Cells are separated by commas, semicolons or tabs, whichever the header uses most; with semicolons a
    decimal comma is understood.  Empty lines are skipped, and lines that begin with `#` are comments.

    Raises
    ------
    DataError, FileFormatError
    """
    name = os.fspath(path)
    comments, kept, lines = [], [], []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        text = line.strip()
        if text.startswith("#"):
            comments.append(text.lstrip("# "))
        elif text:
            kept.append(line)
            lines.append(number)
    if not kept:
        raise FileFormatError(f"{name} is empty; a log begins with a header such as t,stream,v0,v1")
    separator = max(SEPARATORS, key=kept[0].count)
    decimal_comma = separator == ";"
    rows = [
        [cell.strip().replace(",", ".") if decimal_comma else cell.strip() for cell in row]
        for row in csv.reader(kept, delimiter=separator)
    ]
    if len(rows) != len(kept):
        raise FileFormatError(
            f"{name}: a quoted cell runs over the end of its line; a log has one reading a line"
        )
    header = _header(name, rows[0], lines[0])
    _require_cells(name, rows, lines, len(header))
    return CsvTable(name, header, rows[1:], lines[1:], tuple(comments))


def _header(name: str, cells: list[str], line: int) -> tuple[str, ...]:
    while cells and not cells[-1]:
        cells = cells[:-1]
    if not all(cells) or all(_is_number(cell) for cell in cells):
        raise FileFormatError(
            f"{name}, line {line}: the first row must name every column, such as t,stream,v0,v1 "
            f"or t,gps.x,gps.y; it is {','.join(cells)!r}"
        )
    if len(set(cells)) < len(cells):
        twice = next(cell for cell in cells if cells.count(cell) > 1)
        raise FileFormatError(f"{name}, line {line}: the header names the column {twice!r} twice")
    return tuple(cells)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _require_cells(name: str, rows: list[list[str]], lines: list[int], width: int) -> None:
    """Refuse rows of another length than the header's; trailing empty cells do not count."""
    for row, line in zip(rows[1:], lines[1:], strict=True):
        if len(row) == width:
            continue
        if any(row[width:]):
            raise FileFormatError(
                f"{name}, line {line}: {len(row)} cells where the header names {width} columns"
            )
        del row[width:]


def stamps(table: CsvTable, name: str, readings: Sequence[Reading]) -> NDArray[np.int64]:
    """(N,) ns; raises `FileFormatError` naming the line."""
    parse = TIME[table.time]
    found = np.empty(len(readings), dtype=np.int64)
    for k, reading in enumerate(readings):
        try:
            found[k] = parse(reading.t)
        except ValueError as fault:
            where = f"{table.where(reading.line)}, column {table.time!r}"
            raise FileFormatError(f"{where}: the stamp of a reading of {name!r}: {fault}") from None
    return found


def numbers(
    table: CsvTable,
    columns: Sequence[str],
    lines: Sequence[int],
    cells: list[list[str]],
    *,
    missing: bool = False,
) -> NDArray[np.float64]:
    """(N, m) finite numbers, or NaN where `missing` allows it.

    Raises
    ------
    FileFormatError, NotFiniteError
        naming line and column.
    """
    try:
        found = np.array(cells, dtype=np.float64).reshape(len(cells), len(columns))
    except ValueError:
        k, j = next(
            (k, j) for k, row in enumerate(cells) for j, cell in enumerate(row) if not _is_number(cell)
        )
        raise FileFormatError(
            f"{table.where(lines[k])}, column {columns[j]!r}: {cells[k][j]!r} is not a number"
        ) from None
    if len(bad := np.argwhere(np.isinf(found) if missing else ~np.isfinite(found))):
        k, j = int(bad[0][0]), int(bad[0][1])
        raise NotFiniteError(
            f"{table.where(lines[k])}, column {columns[j]!r}: {cells[k][j]} where a number is needed; "
            f"leave out readings that are not known ({len(bad) - 1} more such cells)"
        )
    return found
