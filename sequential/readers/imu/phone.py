"""Exports of phone apps, a folder or zip with one file a sensor: Sensor Logger and phyphox."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence

import numpy as np

from sequential.errors import FileFormatError, MissingStreamError
from sequential.readers.imu.archive import Export
from sequential.readers.imu.assemble import Channels
from sequential.readers.imu.clock import stamps_of
from sequential.readers.imu.guess import FREE_FALL
from sequential.readers.imu.merge import SensorStream, increasing, merge
from sequential.readers.imu.text_table import TextTable, table_of
from sequential.readers.imu.units import GRAVITY, Scale, scale_of
from sequential.sensors.finding import Finding
from sequential.sensors.turning import level_at_rest

__all__ = ["is_phone_header", "phone_channels", "sensor_logger_json"]

# names of files and sensors, without what is no letter, to what they hold
STEMS = {
    "totalacceleration": "total",
    "accelerometer": "accel",
    "accelerometeruncalibrated": "uncalibrated",
    "accelerometerwithg": "accel",
    "accelerationwithg": "accel",
    "linearaccelerometer": "linear",
    "linearacceleration": "linear",
    "accelerometerwithoutg": "linear",
    "gravity": "gravity",
    "gyroscope": "gyro",
    "gyroscopeuncalibrated": "gyro_uncalibrated",
    "magnetometer": "mag",
    "magnetometeruncalibrated": "mag_uncalibrated",
    "magneticfield": "mag",
}
AXIS = re.compile(r"^(.*?)[\s_]*\b([xyz])\s*(?:[\[(](.*)[\])])?$", re.IGNORECASE)
WITHOUT = re.compile(r"lin|without|sans|ohne|user", re.IGNORECASE)


def is_phone_header(cells: Sequence[str]) -> bool:
    """Whether a row names x, y and z, with a unit or without, and something more."""
    return len(_axes(cells)) == 3 and len(cells) > 3


def _axes(header: Sequence[str]) -> dict[str, int]:
    found: dict[str, int] = {}
    for index, cell in enumerate(header):
        if match := AXIS.match(cell.strip().strip('"')):
            found.setdefault(match[2].lower(), index)
    return found


def phone_channels(export: Export, time_unit: Scale | None) -> Channels:
    """Merge the sensors of an export.

    Raises
    ------
    FileFormatError, MissingStreamError
    """
    findings: list[Finding] = []
    streams: dict[str, SensorStream] = {}
    for path in export.names("csv"):
        stem = path.rpartition("/")[2].rpartition(".")[0]
        if "meta" in path.lower().split("/")[:-1] or stem.lower() in {
            "metadata",
            "annotation",
            "device",
            "time",
        }:
            continue
        for what, stream in _streams(export, path, stem, time_unit):
            streams.setdefault(what, stream)
    return _merged(streams, export.where, export.name, findings, inverted=_inverted(export))


def _streams(export: Export, path: str, stem: str, time_unit: Scale | None) -> list[tuple[str, SensorStream]]:
    """The sensor of a file, or nothing where it is none that an IMU has."""
    text, where = export.text(path), f"{export.where}: {path}"
    known = STEMS.get(re.sub(r"[^a-z]", "", stem.lower()))
    first = text.lstrip("\ufeff").split("\n", 1)[0]
    if known is None and not re.search(r"m/s|rad/s|T\)", first):
        return []
    table = table_of(text, where, is_phone_header)
    axes = _axes(table.header)
    if len(axes) < 3:
        if known is None:
            return []
        raise FileFormatError(f"{where}: columns x, y and z are needed; it has {', '.join(table.header)}")
    cell = AXIS.match(table.header[axes["x"]].strip().strip('"'))
    label, unit = (cell[1], cell[3]) if cell else ("", None)
    what = _kind(known, label, unit)
    if what is None:
        return []
    sensor = {"gyro": "gyro", "mag": "mag"}.get(what.split("_", 1)[0], "accel")
    scale = scale_of(sensor, unit) if unit else None
    t, _ = stamps_of(table.text(_time_column(table)), time_unit or _time_unit(table), where)
    values = table.numbers([axes["x"], axes["y"], axes["z"]])
    return [(what, SensorStream(t, values, scale))]


def _kind(known: str | None, label: str, unit: str | None) -> str | None:
    """What a file holds: by its name, and where that says nothing (or 'Raw Data') by unit and label."""
    if known == "accel" and WITHOUT.search(label):
        return "linear"
    if known is not None or unit is None:
        return known
    for sensor in ("gyro", "mag"):
        if scale_of(sensor, unit) is not None:
            return sensor
    if scale_of("accel", unit) is not None:
        return "linear" if WITHOUT.search(label) else "accel"
    return None


def _time_column(table: TextTable) -> int:
    names = [cell.strip().strip('"').lower() for cell in table.header]
    for index, name in enumerate(names):
        if re.match(r"(time|temps|zeit|tiempo|tempo|timestamp|seconds_elapsed|t)\b", name):
            return index
    return 0


def _time_unit(table: TextTable) -> Scale | None:
    name = table.header[_time_column(table)].strip().strip('"').lower()
    if name == "seconds_elapsed":
        return scale_of("t", "s")
    found = re.search(r"[\[(](.*)[\])]", name)
    return scale_of("t", found[1]) if found else None


def _merged(
    streams: Mapping[str, SensorStream], where: str, name: str, findings: list[Finding], *, inverted: bool
) -> Channels:
    filled = {
        what: stream for what, stream in streams.items() if np.isfinite(stream.values).all(axis=1).any()
    }
    streams = {what: increasing(stream, what, findings) for what, stream in filled.items()}
    chosen = {}
    if accel := _with_gravity(streams, where, findings, inverted=inverted):
        chosen["accel"] = accel
    for sensor, default in (("gyro", "rad/s"), ("mag", "uT")):
        stream = streams.get(sensor) or streams.get(f"{sensor}_uncalibrated")
        if stream is not None:
            chosen[sensor] = SensorStream(stream.t, stream.values, stream.unit or scale_of(sensor, default))
    if not chosen:
        raise MissingStreamError(
            f"{where} has none of TotalAcceleration.csv, Accelerometer.csv, Gyroscope.csv, Magnetometer.csv"
        )
    return merge(chosen, where=where, name=name, findings=findings)


def _with_gravity(
    streams: Mapping[str, SensorStream], where: str, findings: list[Finding], *, inverted: bool
) -> SensorStream | None:
    """Specific force from whichever files hold it; apps take gravity out of some of them."""
    metric = scale_of("accel", "m/s^2")
    sign = -1.0 if inverted else 1.0
    if inverted:
        what = "accelerations of iOS have the opposite sign and are turned round"
        findings.append(Finding("note", what, do="switch on 'Standardise Units & Frames' in Sensor Logger"))
    if total := streams.get("total"):
        return SensorStream(total.t, sign * total.values, total.unit or metric)
    plain = streams.get("accel")
    if plain is not None and level_at_rest(plain.values, plain.rate) > FREE_FALL * _one_g(plain):
        return SensorStream(plain.t, sign * plain.values, plain.unit or metric)
    without = plain or streams.get("linear")
    if without is not None and (gravity := streams.get("gravity")):
        at = [
            np.interp(without.t - without.t[0], gravity.t - without.t[0], gravity.values[:, k])
            for k in range(3)
        ]
        what = "the acceleration is that without gravity plus the gravity that the phone estimated"
        findings.append(
            Finding("warn", what, do="record TotalAcceleration or the uncalibrated accelerometer")
        )
        return SensorStream(without.t, sign * (without.values + np.stack(at, axis=1)), without.unit or metric)
    if raw := streams.get("uncalibrated"):
        return SensorStream(raw.t, sign * raw.values, raw.unit)
    if without is None:
        return None
    level = level_at_rest(without.values, without.rate)
    raise FileFormatError(
        f"{where}: its acceleration is without gravity ({level:.2g} m/s² "
        "at rest, 9.81 expected), which no attitude and no calibration can use; record the acceleration with "
        "gravity (phyphox: 'Acceleration (with g)', Sensor Logger: TotalAcceleration, or Gravity as well)"
    )


def _one_g(stream: SensorStream) -> float:
    return 1.0 if stream.unit is not None and stream.unit.name == "g" else GRAVITY


def _inverted(export: Export) -> bool:
    """Whether Sensor Logger's Metadata.csv says that signs are those of iOS."""
    path = next((p for p in export.names("csv") if p.rpartition("/")[2].lower() == "metadata.csv"), None)
    if path is None:
        return False
    lines = export.text(path).lower().splitlines()
    if len(lines) < 2:
        return False
    said = dict(zip(lines[0].split(","), lines[1].split(","), strict=False))
    return "ios" in said.get("platform", "") and said.get("standardisation", "false").strip() != "true"


def sensor_logger_json(text: str, where: str, name: str) -> Channels:
    """Sensor Logger's JSON export: a list of records, each with its sensor, time (ns) and x, y, z.

    Raises
    ------
    FileFormatError, MissingStreamError
    """
    try:
        records = json.loads(text)
        found: dict[str, list[tuple[int, float, float, float]]] = {}
        platform = ""
        for record in records:
            what = STEMS.get(re.sub(r"[^a-z]", "", record.get("sensor", "").lower()))
            platform = platform or str(record.get("platform", "")).lower()
            if what is not None:
                row = int(record["time"]), float(record["x"]), float(record["y"]), float(record["z"])
                found.setdefault(what, []).append(row)
    except (ValueError, KeyError, TypeError, AttributeError) as fault:
        raise FileFormatError(
            f"{where} is not Sensor Logger's list of records with sensor, time, x, y, z ({fault})"
        ) from None
    streams = {
        what: SensorStream(np.array([row[0] for row in rows]), np.array([row[1:] for row in rows]))
        for what, rows in found.items()
    }
    return _merged(streams, where, name, [], inverted="ios" in platform)
