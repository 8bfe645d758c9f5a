"""Axes of a recording, or any columns of a table, as named channels of numbers."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FileFormatError
from sequential.readers.imu.clock import NO_STAMP, evenly, ordered, stamps_of
from sequential.readers.imu.text_table import TextTable, read_table
from sequential.readers.imu.units import parse_units
from sequential.sensors import Finding, ImuRecording

__all__ = ["Channel", "channels_of", "read_columns"]

Array = NDArray[np.float64]
AXES = {"accel": ("ax", "ay", "az"), "gyro": ("gx", "gy", "gz"), "mag": ("mx", "my", "mz")}
WRITTEN = {"m/s^2": "m/s²", "uT": "µT"}  # units as people write them
UNIT_OF_TIME = {"t": "s", "t_ns": "ns", "time_s": "s", "seconds": "s", "seconds_elapsed": "s"}
HELD = 0.3  # share of repeated rows from which a sensor is slower than the recording
HEADED = re.compile(r"(.+?)\s*[\[(]([^\])]*)[\])]")  # name [unit], name (unit)
TIMES = ("t", "time", "timestamp", "seconds", "t_ns", "time_s", "seconds_elapsed", "temps", "date")


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """One axis or column: `group` is the sensor that it belongs to, its own name for a single column."""

    name: str
    group: str
    unit: str
    t: NDArray[np.int64]
    values: Array
    temperature: Array | None = None


def channels_of(recording: ImuRecording) -> tuple[Channel, ...]:
    """Every axis of a recording; magnetometer rows without a sample are left out."""
    found = []
    for sensor in recording.sensors:
        values = np.asarray(getattr(recording, sensor))
        unit = str(getattr(recording, f"{sensor}_unit"))
        known = np.isfinite(values).all(axis=1)
        if sensor == "mag":
            known &= _new(values)
        heat = None if recording.temperature is None else recording.temperature[known]
        found += [
            Channel(name, sensor, WRITTEN.get(unit, unit), recording.t[known], values[known, k], heat)
            for k, name in enumerate(AXES[sensor])
        ]
    return tuple(found)


def _new(values: Array) -> NDArray[np.bool_]:
    """Rows of a magnetometer that hold a new sample, where a slower one is repeated until the next."""
    same = np.concatenate([[False], (np.diff(values, axis=0) == 0.0).all(axis=1)])
    return ~same if float(same.mean()) > HELD else np.ones(len(values), dtype=bool)


def read_columns(
    path: Path,
    columns: Mapping[str, str],
    *,
    rate: float | None = None,
    time_unit: str | None = None,
    temperature: str | None = None,
) -> tuple[tuple[Channel, ...], tuple[Finding, ...]]:
    """Columns of a table of any sensor, and what was noticed on the way.

    Parameters
    ----------
    columns : unit by name of column, "" where it is not known
    rate : Hz, where the table has no time column
    time_unit : "s", "ms", "us" or "ns"; guessed by default
    temperature : name of the column that holds it

    Raises
    ------
    DataError, FileFormatError
    """
    wanted = [*columns, *([] if temperature is None else [temperature])]
    table = read_table(path, lambda cells: any(_place(cells, name) is not None for name in wanted))
    t, rows, said = _times(path, table, rate, time_unit)
    heat = None if temperature is None else table.numbers([_found(path, table, temperature)])[rows, 0]
    found = []
    for name, unit in columns.items():
        column = _found(path, table, name)
        values = table.numbers([column])[rows, 0]
        known = np.isfinite(values)
        own = None if heat is None else heat[known]
        title, stated = _parts(table.header[column])
        found.append(Channel(title, title, unit or stated, t[known], values[known], own))
    return tuple(found), said


def _parts(cell: str) -> tuple[str, str]:
    """Name and unit of a column headed `gx [rad/s]` or `T (°C)`."""
    parts = HEADED.fullmatch(cell.strip())
    return (parts[1], parts[2]) if parts else (cell.strip(), "")


def _place(header: Sequence[str], name: str) -> int | None:
    """Index of the column of this name, written with its unit or without."""
    for cells in (list(header), [_parts(cell)[0] for cell in header]):
        if name in cells:
            return cells.index(name)
    return None


def _found(path: Path, table: TextTable, name: str) -> int:
    place = _place(table.header, name)
    if place is None:
        names = [_parts(cell)[0] for cell in table.header]
        near = get_close_matches(name, names, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise DataError(f"{path} has no column {name!r}; it has {', '.join(names) or 'no header'}{hint}")
    return place


def _times(
    path: Path, table: TextTable, rate: float | None, time_unit: str | None
) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[Finding, ...]]:
    """Stamps, the rows that they belong to, and what was noticed."""
    if rate is not None:
        return evenly(len(table), rate), np.arange(len(table)), ()
    place = next((k for k, cell in enumerate(table.header) if _parts(cell)[0].lower() in TIMES), None)
    if place is None:
        raise FileFormatError(
            f"{path} has no time column ({', '.join(TIMES[:4])} …), its columns are "
            f"{', '.join(table.header)}; give the rate of the readings with --rate HZ"
        )
    name, unit_there = _parts(table.header[place])
    stated = time_unit or unit_there or UNIT_OF_TIME.get(name.lower())
    unit = parse_units({"t": stated} if stated else None).get("t")
    stamps, said = stamps_of(table.text(place), unit, str(path))
    rows = np.flatnonzero(stamps != NO_STAMP)
    kept, more = ordered(stamps[rows], str(path))
    return stamps[rows][kept], rows[kept], (*said, *more)
