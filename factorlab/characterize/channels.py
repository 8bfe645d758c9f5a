"""Axes of a recording, or any columns of a table, as named channels of numbers."""

from __future__ import annotations

from collections.abc import Mapping
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
        heat = None if recording.temperature is None else recording.temperature[known]
        found += [
            Channel(name, sensor, WRITTEN.get(unit, unit), recording.t[known], values[known, k], heat)
            for k, name in enumerate(AXES[sensor])
        ]
    return tuple(found)


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
    table = read_table(path, lambda cells: sum(name in cells for name in wanted) > 0)
    for name in wanted:
        if name not in table.header:
            near = get_close_matches(name, table.header, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            has = ", ".join(table.header) or "no header"
            raise DataError(f"{path} has no column {name!r}; it has {has}{hint}")
    t, rows, said = _times(path, table, rate, time_unit)
    heat = None
    if temperature is not None:
        heat = table.numbers([table.header.index(temperature)])[rows, 0]
    found = []
    for name, unit in columns.items():
        values = table.numbers([table.header.index(name)])[rows, 0]
        known = np.isfinite(values)
        found.append(
            Channel(name, name, unit, t[known], values[known], None if heat is None else heat[known])
        )
    return tuple(found), said


def _times(
    path: Path, table: TextTable, rate: float | None, time_unit: str | None
) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[Finding, ...]]:
    """Stamps, the rows that they belong to, and what was noticed."""
    if rate is not None:
        return evenly(len(table.rows), rate), np.arange(len(table.rows)), ()
    name = next((h for h in table.header if h.strip().lower().split("(")[0].strip() in TIMES), None)
    if name is None:
        raise FileFormatError(
            f"{path} has no time column ({', '.join(TIMES[:4])} …), its columns are "
            f"{', '.join(table.header)}; give the rate of the readings with --rate HZ"
        )
    unit = parse_units({"t": time_unit} if time_unit else None).get("t")
    stamps, said = stamps_of(table.text(table.header.index(name)), unit, str(path))
    rows = np.flatnonzero(stamps != NO_STAMP)
    kept, more = ordered(stamps[rows], str(path))
    return stamps[rows][kept], rows[kept], (*said, *more)
