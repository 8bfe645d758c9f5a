"""One table with all sensors: plain CSV, MPU-6050 and QMC5883L dumps, x-io, imucal, EuRoC, RepoIMU."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.log import frozen
from sequential.readers.imu.assemble import Channels, assemble
from sequential.readers.imu.clock import evenly, stamps_of
from sequential.readers.imu.header import AXES, EXPECTED, SENSORS, Layout, find_layout, parse_columns
from sequential.readers.imu.text_table import TextTable, read_table
from sequential.readers.imu.units import Scale, scale_of
from sequential.sensors.finding import Finding
from sequential.sensors.recording import ImuRecording

__all__ = ["Columns", "channels_of", "names_sensors", "read_repoimu", "sensor_table"]

Array = NDArray[np.float64]
Columns = Mapping[str, str] | Sequence[str] | str
RATE = re.compile(r"fs|rate|sampl(?:e|ing)[ _]?(?:rate|frequency)(?:[ _]?hz)?|frequency|odr", re.IGNORECASE)
REPOIMU = ["t", "qw", "qx", "qy", "qz", "ax", "ay", "az", "gx", "gy", "gz", "mx", "my", "mz"]


def names_sensors(cells: Sequence[str]) -> bool:
    """Whether a row names the axes of a sensor, or is RepoIMU's."""
    return is_repoimu(cells) or (len(cells) > 2 and find_layout(cells).usable)


def is_repoimu(header: Sequence[str]) -> bool:
    """The first header line of RepoIMU, in which a group of columns has one name."""
    return len(header) > 1 and header[1].strip().startswith("Vicon Orientation")


def sensor_table(path: str | os.PathLike[str]) -> TextTable:
    """Read the table of a file whose header names sensors."""
    return read_table(path, names_sensors)


def channels_of(
    table: TextTable, *, name: str, columns: Columns | None, rate: float | None, time_unit: Scale | None
) -> Channels:
    """Stamps and readings of a table, as they stand there.

    Raises
    ------
    FileFormatError
        for columns that are missing or not known, or where there are neither stamps nor a rate.
    """
    if is_repoimu(table.header) and columns is None:
        layout = Layout(
            {role: k for k, role in enumerate(REPOIMU)}, _units(accel="m/s^2", gyro="rad/s", mag="counts")
        )
    elif columns is not None:
        layout = parse_columns(columns, table.header, table.where)
    else:
        layout = find_layout(table.header)
    _require_whole(layout, table)
    found: dict[str, Array] = {}
    for sensor in SENSORS:
        if axes := layout.axes(sensor):
            found[sensor] = table.numbers(axes)
    if (at := layout.columns.get("temperature")) is not None:
        found["temperature"] = table.numbers([at])[:, 0]
    t, said = _stamps(table, layout, rate, time_unit)
    channels = Channels(table.where, name, t, **found, units=layout.units, findings=said)
    if "sample" in layout.columns and "t" not in layout.columns:
        _, rows = np.unique(t, return_index=True)  # parts of a session that was cut and pasted
        if len(rows) < len(t) or (np.diff(t) < 0).any():
            channels.select(rows)
            what = f"sample numbers are out of order; {len(t) - len(rows)} that stand twice are left out"
            said.append(Finding("note", what))
    return channels


def _units(**names: str) -> dict[str, Scale]:
    scales = {sensor: scale_of(sensor, name) for sensor, name in names.items()}
    return {sensor: scale for sensor, scale in scales.items() if scale is not None}


def _require_whole(layout: Layout, table: TextTable) -> None:
    """Refuse a sensor that lacks an axis, and a table without a sensor."""
    has = ", ".join(repr(cell) for cell in table.header) or "no header"
    for sensor, letter in SENSORS.items():
        given = [axis for axis in AXES if letter + axis in layout.columns]
        if given and len(given) < 3:
            lost = letter + next(axis for axis in AXES if axis not in given)
            raise FileFormatError(
                f"{table.where}: the {sensor} has {', '.join(letter + a for a in given)} but no {lost}; the "
                f"columns are {has}. Name it with columns {lost}=NAME"
            )
    if not layout.usable:
        width = f"{table.width} columns without names" if not table.header else f"the columns {has}"
        raise FileFormatError(
            f"{table.where} has {width}; expected are {EXPECTED}. Say which is which with columns "
            "ax=NAME,ay=NAME,… (or their numbers, from 0): --columns on the command line"
        )


def _stamps(
    table: TextTable, layout: Layout, rate: float | None, time_unit: Scale | None
) -> tuple[NDArray[np.int64], list[Finding]]:
    if (at := layout.columns.get("t")) is not None:
        return stamps_of(table.text(at), time_unit or layout.units.get("t"), table.where)
    stated = rate or next(
        (_positive(v) for k, v in table.preamble.items() if RATE.fullmatch(k.strip())), None
    )
    if stated is None:
        raise FileFormatError(
            f"{table.where} has no time column and no rate; give rate=100 (Hz; --rate in a command), or "
            f"name the column with columns t=NAME. The columns are {', '.join(table.header) or 'unnamed'}"
        )
    if (at := layout.columns.get("sample")) is not None:
        numbers = table.numbers([at])[:, 0]
        if np.isfinite(numbers).all():
            t = np.round((numbers - numbers.min()) * (1e9 / stated)).astype(np.int64)
            return t, [Finding("note", f"stamps are sample numbers at {stated:g} Hz")]
    return evenly(len(table), stated), [
        Finding("note", f"there are no stamps; samples are even at {stated:g} Hz")
    ]


def _positive(text: str) -> float | None:
    try:
        value = float(text.replace(",", "."))
    except ValueError:
        return None
    return value if np.isfinite(value) and value > 0 else None


def read_repoimu(path: str | os.PathLike[str]) -> tuple[ImuRecording, Array]:
    """Read a trial of RepoIMU with its truth (Szczesna et al., ICCVG 2016).

    Returns
    -------
    recording : its magnetometer is normalised, so `mag_unit` is "counts"
    world_q_body : (N, 4) w x y z of the Vicon system; rows of NaN where the markers were not seen

    Raises
    ------
    DataError, FileFormatError
    """
    table = sensor_table(path)
    if not is_repoimu(table.header):
        raise FileFormatError(
            f"{table.where} is no trial of RepoIMU: its second column is not 'Vicon Orientation'"
        )
    channels = channels_of(table, name=Path(path).stem, columns=None, rate=None, time_unit=None)
    before = channels.t
    recording = assemble(channels, {})
    q = table.numbers([1, 2, 3, 4])[np.searchsorted(before, recording.t)]
    length = np.linalg.norm(q, axis=1, keepdims=True)
    return recording, frozen(q / np.where(length > 0.5, length, np.nan))
