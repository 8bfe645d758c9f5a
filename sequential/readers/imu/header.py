"""What the names of a table's columns say: which sensor, which axis, which unit."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from sequential.errors import FileFormatError
from sequential.readers.imu.units import Scale, scale_of

__all__ = ["ROLES", "Layout", "describe", "find_layout", "parse_columns"]

AXES = "xyz"
SENSORS = {"accel": "a", "gyro": "g", "mag": "m"}
ROLES = ("t", *(letter + axis for letter in SENSORS.values() for axis in AXES), "temperature", "sample")
EXPECTED = "t, ax, ay, az, gx, gy, gz[, mx, my, mz][, temperature], with units as in 'ax [g]' or 'gx (deg/s)'"

NAMES = {
    "accel": r"a|acc|accel|accelero|accelerometer|acceleration|acceleration_with_g|total_acceleration|"
    r"linear_?acceleration|lin_acc|specific_force|f|a_rs_s|imu_acc|accelerometer_m_s2",
    "gyro": r"g|gyr|gyro|gyros|gyroscope|w|omega|angular_?velocity|angular_?rate|ang_?vel|rotation_?rate|"
    r"rate|w_rs_s|imu_gyr|gyro_rad|rot",
    "mag": r"m|mag|magn|magneto|magnetometer|magnetic_?field|mag_?field|b|imu_mag|magnetometer_ga",
}
PREFIX = r"(?:imu\d*_|sensor_|raw_|calibrated_|cal_)?"
PATTERNS = {
    sensor: re.compile(rf"{PREFIX}(?:(?:{names})_?([xyz0-2])|([xyz])_?(?:{names}))(?:_(?:axis|raw|cal))?")
    for sensor, names in NAMES.items()
}
TIME = re.compile(
    r"t|time|times|timestamp|time_?stamp|ts|seconds?|secs?|seconds_elapsed|elapsed(?:_time)?|millis|micros|nanos|"
    r"date_?time|clock|sensor_time|time_since_start|sample_time"
)
TEMPERATURE = re.compile(r"(?:imu_|sensor_|gyro_|chip_)?(?:temp|temperature|tmp)")
SAMPLE = re.compile(
    r"n|i|sample|samples|n_samples?|index|idx|count|packet_?(?:counter|count|number)?|frame|row"
)
BRACKET = re.compile(r"^(.*?)\s*[\[(]([^\])]*)[\])]?\s*$")
SUFFIXES = {
    "accel": ("m_s2", "ms2", "mps2", "mg", "g"),
    "gyro": ("rad_s", "rads", "radps", "deg_s", "degs", "dps", "mdps"),
    "mag": ("ut", "nt", "gauss", "mgauss", "t"),
    "t": ("ns", "us", "ms", "s", "sec", "seconds", "millis", "micros"),
    "temperature": ("degc", "celsius", "c"),
}
TIME_NAMES = {
    "millis": "ms",
    "micros": "us",
    "nanos": "ns",
    "seconds": "s",
    "seconds_elapsed": "s",
    "secs": "s",
}


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each role stands in a row, and the units that the header states, by sensor."""

    columns: dict[str, int]
    units: dict[str, Scale]

    def axes(self, sensor: str) -> list[int] | None:
        """Columns of the three axes of `accel`, `gyro` or `mag`, where all are there."""
        names = [SENSORS[sensor] + axis for axis in AXES]
        return [self.columns[name] for name in names] if all(n in self.columns for n in names) else None

    @property
    def usable(self) -> bool:
        """Whether any sensor is complete."""
        return any(self.axes(sensor) for sensor in SENSORS)


def describe(cell: str) -> tuple[str, Scale | None] | None:
    """The role of a column and the unit in its name, or None where the name says nothing.

    >>> describe("Gyroscope X (deg/s)")
    ('gx', Scale(name='deg/s', factor=0.017453292519943295, offset=0.0))
    """
    text = cell.strip().strip("#\"' ")
    bracket = BRACKET.match(text)
    name, unit = (bracket[1], bracket[2]) if bracket else (text, None)
    name = re.sub(r"[^0-9a-z]+", "_", re.sub(r"([a-z])([XYZ])$", r"\1_\2", name).lower()).strip("_")
    role = _role(name)
    if role is not None:
        sensor = _sensor(role)
        stated = scale_of(sensor, unit) if unit and sensor else None
        return role, stated or (scale_of("t", TIME_NAMES[name]) if name in TIME_NAMES else None)
    for sensor, suffixes in SUFFIXES.items():
        for suffix in suffixes:
            stem = name.removesuffix(f"_{suffix}")
            if stem != name and (role := _role(stem)) is not None and _sensor(role) == sensor:
                return role, scale_of(sensor, suffix.replace("m_s2", "m/s2").replace("_s", "/s"))
    return None


def _role(name: str) -> str | None:
    if TIME.fullmatch(name):
        return "t"
    for sensor, pattern in PATTERNS.items():
        if found := pattern.fullmatch(name):
            axis = found[1] or found[2]
            return SENSORS[sensor] + (axis if axis in AXES else AXES[int(axis)])
    if TEMPERATURE.fullmatch(name):
        return "temperature"
    return "sample" if SAMPLE.fullmatch(name) else None


def _sensor(role: str) -> str:
    """The sensor that a role belongs to, empty for a count of samples."""
    if role in {"t", "temperature"}:
        return role
    return next((sensor for sensor, letter in SENSORS.items() if role[0] == letter and len(role) == 2), "")


def find_layout(header: Sequence[str]) -> Layout:
    """The roles of the columns that say what they are; of two columns with one role the first counts."""
    columns: dict[str, int] = {}
    units: dict[str, Scale] = {}
    for index, cell in enumerate(header):
        if (found := describe(cell)) is None or found[0] in columns:
            continue
        columns[found[0]] = index
        if found[1] is not None and units.setdefault(_sensor(found[0]), found[1]).name != found[1].name:
            raise FileFormatError(
                f"the column {cell.strip()!r} is in {found[1].name}, another axis of its sensor in "
                f"{units[_sensor(found[0])].name}; one sensor has one unit"
            )
    return Layout(columns, units)


def parse_columns(
    given: Mapping[str, str] | Sequence[str] | str, header: Sequence[str] | None, where: str
) -> Layout:
    """The layout that a user names: `{"ax": "acc_x", …}`, `ax=acc_x,ay=acc_y,…`, or the roles in order.

    A name of a column may be its number, from 0.  Units in the names that are given still count.

    Raises
    ------
    FileFormatError
        naming what is there.
    """
    if isinstance(given, str):
        words = [word.strip() for word in given.split(",") if word.strip()]
        given = dict(word.split("=", 1) for word in words if "=" in word) if "=" in given else words
    if not isinstance(given, Mapping):
        given = {role: str(index) for index, role in enumerate(given) if role not in {"", "-", "_"}}
    columns: dict[str, int] = {}
    units: dict[str, Scale] = {}
    for role, column in given.items():
        if role not in ROLES:
            near = get_close_matches(role, ROLES, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise FileFormatError(f"columns are named for {', '.join(ROLES)}, not for {role!r}{hint}")
        columns[role] = _index(str(column).strip(), header, where)
        said = describe(header[columns[role]]) if header and columns[role] < len(header) else None
        if said is not None and said[1] is not None and said[0] == role:
            units.setdefault(_sensor(role), said[1])
    return Layout(columns, units)


def _index(column: str, header: Sequence[str] | None, where: str) -> int:
    if header is not None and column in header:
        return list(header).index(column)
    bare = [cell.strip().strip("#\"' ") for cell in header or ()]
    if column in bare:
        return bare.index(column)
    if column.isdecimal():
        return int(column)
    near = get_close_matches(column, bare, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    has = f"it has {', '.join(bare)}" if bare else "it has no header: give the number of the column, from 0"
    raise FileFormatError(f"{where} has no column {column!r}{hint}; {has}")
