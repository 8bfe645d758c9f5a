"""Tables of a distance sensor: true distances and readings, in columns of a CSV file."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.readers.imu.text_table import TextTable, read_table

__all__ = ["RangeTable", "read_range_table"]

Array = NDArray[np.float64]
DISTANCE = ("distance", "dist", "d", "range", "true")
READING = ("voltage", "volt", "reading", "v", "u", "adc", "counts", "value")
UNITS = {"mm", "cm", "m", "in", "v", "mv", "lsb", "counts", "count", "adc"}
SPELT = {"v": "V", "mv": "mV", "lsb": "LSB", "count": "counts", "adc": "counts"}


@dataclass(frozen=True, slots=True, eq=False)
class RangeTable:
    """Distances and readings (N,), and the units that their headings name; empty where they name none."""

    distances: Array
    readings: Array
    unit: str
    reading_unit: str


def read_range_table(
    path: str | os.PathLike[str], *, distance: str | None = None, reading: str | None = None
) -> RangeTable:
    """Read a table; headings such as `distance_cm`, `voltage (V)`, or two columns without any.

    Parameters
    ----------
    distance, reading : headings of the columns, where they are not found out

    Raises
    ------
    DataError, FileFormatError
        naming line and column of a cell that is no number, or the headings that are there.
    """
    table = read_table(path, _is_header)
    first = _column(table, distance, DISTANCE, "distance")
    second = _column(table, reading, READING, "reading")
    values = table.numbers([first, second])
    whole = np.isfinite(values).any(axis=1)  # empty rows of a spreadsheet
    return RangeTable(values[whole, 0], values[whole, 1], _unit(table, first), _unit(table, second))


def _words(heading: str) -> list[str]:
    return [word for word in re.split(r"[^a-z]+", heading.lower()) if word]


def _is_header(cells: Sequence[str]) -> bool:
    return any(_words(cell)[:1] and _words(cell)[0] in DISTANCE for cell in cells)


def _column(table: TextTable, wanted: str | None, names: tuple[str, ...], what: str) -> int:
    if wanted is not None:
        if wanted in table.header:
            return table.header.index(wanted)
        raise FileFormatError(
            f"{table.where} has no column {wanted!r} for the {what}; it has {', '.join(table.header)}"
        )
    if not table.header:
        if table.width == 2:
            return 0 if what == "distance" else 1
        raise FileFormatError(f"{table.where} has no headings; put distance,voltage above its columns")
    found = [k for name in names for k, heading in enumerate(table.header) if _words(heading)[:1] == [name]]
    if not found:
        raise FileFormatError(
            f"{table.where}: no column is named for the {what} ({', '.join(names[:3])} …); it has "
            f"{', '.join(table.header)}: name it with --{what}"
        )
    return found[0]


def _unit(table: TextTable, column: int) -> str:
    words = _words(table.header[column]) if table.header else []
    unit = next((word for word in words[1:] if word in UNITS), "")
    return SPELT.get(unit, unit)
