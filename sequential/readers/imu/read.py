"""Recordings of an IMU from files: the format is found out, or named."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

from sequential.errors import DataError, FileFormatError
from sequential.readers.broad import is_broad, read_broad
from sequential.readers.files import require_file
from sequential.readers.imu.archive import Export, open_export
from sequential.readers.imu.arrays import array_channels, imu_tk_channels
from sequential.readers.imu.assemble import Channels, assemble
from sequential.readers.imu.csv_file import Columns, channels_of, names_sensors, sensor_table
from sequential.readers.imu.detect import found_out
from sequential.readers.imu.phone import is_phone_header, phone_channels, sensor_logger_json
from sequential.readers.imu.text_table import decoded, table_of
from sequential.readers.imu.ulog import ulog_channels
from sequential.readers.imu.units import Scale, parse_units
from sequential.readers.npz import read_arrays
from sequential.readers.table import read_log
from sequential.sensors.recording import ImuRecording

__all__ = ["KINDS", "read_imu"]


@dataclass(frozen=True, slots=True)
class _Request:
    """What the user asks for besides the path."""

    units: dict[str, Scale]
    columns: Columns | None
    rate: float | None
    name: str


Reader = Callable[[Path, _Request], ImuRecording]


def read_imu(
    path: str | os.PathLike[str],
    *,
    kind: str | None = None,
    units: Mapping[str, str] | str | None = None,
    columns: Columns | None = None,
    rate: float | None = None,
    name: str | None = None,
) -> ImuRecording:
    """Read a recording; docs/imu.md lists the formats.

    Parameters
    ----------
    path : a file, or the folder or zip of an export
    kind : one of `KINDS`, where the format is not to be found out
    units : `{"accel": "g", "gyro": "deg/s", "mag": "uT", "t": "ms"}` or `"accel=g,gyro=deg/s"`; also
        `"counts"`, a sensitivity such as `"16384 LSB/g"`, or the range of a 16-bit converter, `"±4 g"`.
        They win over what the file states, and what nobody states is guessed from the readings
    columns : names of columns by role, `{"ax": "acc_x", …}` or `"ax=acc_x,…"`, or the roles in order
    rate : Hz, for a file without stamps
    name : of the recording; the file's name without its ending by default

    Returns
    -------
    ImuRecording
        whose `findings` say what was guessed and mended.

    Raises
    ------
    DataError
        if there is no such file, kind or unit.
    FileFormatError, MissingStreamError
        saying what is there, what is expected, and how to name it.
    """
    place = Path(path)
    if not place.is_dir():
        require_file(place)
    if kind is not None and kind not in KINDS:
        near = get_close_matches(kind, KINDS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise DataError(f"there is no kind {kind!r} of IMU recording, only {', '.join(KINDS)}{hint}")
    if rate is not None and not 0 < rate < float("inf"):
        raise DataError(f"the rate of a recording is a positive number of Hz, got {rate}")
    request = _Request(parse_units(units), columns, rate, name or place.stem)
    found = kind or found_out(place)
    recording = (_only_table if found == "alone" else KINDS[found])(place, request)
    return recording if name is None else replace(recording, name=name)


def _csv(place: Path, request: _Request) -> ImuRecording:
    """A table: of all sensors, of one sensor of a phone, or a log of this project."""
    text = decoded(place.read_bytes(), os.fspath(place))
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    cells = [cell.strip() for cell in first.replace(";", ",").split(",")]
    if "stream" in cells:
        return ImuRecording.from_log(read_log(place))
    if request.columns is None and is_phone_header(cells) and not names_sensors(cells):
        return _done(phone_channels(_alone(place), request.units.get("t")), request)
    return _table(place, request)


def _only_table(place: Path, request: _Request) -> ImuRecording:
    """The one table of a folder."""
    return _csv(place / open_export(place).names("csv")[0], request)


def _alone(place: Path) -> Export:
    """One file of a phone's export, without its neighbours."""
    return Export(os.fspath(place.parent), place.stem, (place.name,), zipped=False)


def _table(place: Path, request: _Request) -> ImuRecording:
    table = sensor_table(place)
    return _done(
        channels_of(
            table,
            name=request.name,
            columns=request.columns,
            rate=request.rate,
            time_unit=request.units.get("t"),
        ),
        request,
    )


def _sheet(accel: str | None = None, gyro: str | None = None) -> Reader:
    """A table whose units a data sheet or a publication states."""

    def read(place: Path, request: _Request) -> ImuRecording:
        stated = parse_units({k: v for k, v in (("accel", accel), ("gyro", gyro)) if v is not None})
        return _table(place, replace(request, units={**stated, **request.units}))

    return read


def _done(channels: Channels, request: _Request) -> ImuRecording:
    return assemble(channels, {k: v for k, v in request.units.items() if k != "t"})


def _npz(place: Path, request: _Request) -> ImuRecording:
    arrays = read_arrays(os.fspath(place))
    if is_broad(arrays):
        return read_broad(place)[0]
    if any(key.removesuffix("_t") in arrays for key in arrays if key.endswith("_t")):
        return ImuRecording.from_log(read_log(place))
    channels = array_channels(
        arrays, os.fspath(place), name=request.name, rate=request.rate, time_unit=request.units.get("t")
    )
    return _done(channels, request)


def _phone(place: Path, request: _Request) -> ImuRecording:
    if place.suffix.lower() == ".json":
        text = decoded(place.read_bytes(), os.fspath(place))
        return _done(sensor_logger_json(text, os.fspath(place), request.name), request)
    export = open_export(place) if place.is_dir() or place.suffix.lower() == ".zip" else _alone(place)
    return _done(phone_channels(export, request.units.get("t")), request)


def _euroc(place: Path, request: _Request) -> ImuRecording:
    """EuRoC's ASL folder, from anywhere inside down to imu0/data.csv."""
    if place.is_file() and place.suffix.lower() == ".csv":
        return _table(place, request)
    export = open_export(place)
    inside = export.find("imu0/data.csv") or export.find("data.csv")
    if inside is None:
        raise FileFormatError(f"{place} has no mav0/imu0/data.csv, in which EuRoC keeps its IMU")
    table = table_of(export.text(inside), f"{place}/{inside}", names_sensors)
    channels = channels_of(
        table, name=request.name, columns=request.columns, rate=None, time_unit=request.units.get("t")
    )
    return _done(channels, request)


KINDS: dict[str, Reader] = {
    "csv": _csv,
    "mpu6050": _sheet("16384 LSB/g", "131 LSB/dps"),
    "qmc5883l": _sheet(),
    "xio": _sheet("g", "deg/s"),
    "imucal": _sheet(),
    "imu_tk": lambda place, request: (
        _npz(place, request) if place.suffix == ".npz" else _done(imu_tk_channels(place), request)
    ),
    "npz": _npz,
    "broad": lambda place, _: read_broad(place)[0],
    "repoimu": _table,
    "euroc": _euroc,
    "phone": _phone,
    "sensor_logger": _phone,
    "phyphox": _phone,
    "ulog": lambda place, request: _done(ulog_channels(place), request),
    "log": lambda place, _: ImuRecording.from_log(read_log(place)),
}
