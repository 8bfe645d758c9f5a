"""Recordings as NumPy archives (IMU-TK's counts, VQF's test set), and IMU-TK's own text files."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.log import nanoseconds
from sequential.readers.files import require_file
from sequential.readers.imu.assemble import Channels
from sequential.readers.imu.clock import evenly, stamps_of
from sequential.readers.imu.merge import SensorStream, merge
from sequential.readers.imu.text_table import read_table
from sequential.readers.imu.units import Scale, scale_of
from sequential.sensors.finding import Finding

__all__ = ["array_channels", "imu_tk_channels", "is_imu_tk_text"]

NAMES = {
    "accel": ("acc", "accel", "accelerometer", "a"),
    "gyro": ("gyr", "gyro", "gyroscope", "w"),
    "mag": ("mag", "magnetometer", "m"),
}
RATES = ("rate", "sampling_rate", "fs", "rate_hz")
TIMES = ("t", "time", "timestamps", "t_ns")


def array_channels(
    arrays: Mapping[str, Any], where: str, *, name: str, rate: float | None, time_unit: Scale | None
) -> Channels:
    """Arrays `acc`, `gyr`, `mag` of shape (N, 3) with `t` (seconds, or integer ns) or a rate.

    Raises
    ------
    FileFormatError
        naming what is there.
    """
    found: dict[str, NDArray[np.float64]] = {}
    counted = []
    for sensor, spellings in NAMES.items():
        key = next((k for k in arrays if k.lower() in spellings), None)
        if key is None:
            continue
        values = np.asarray(arrays[key])
        if values.ndim != 2 or 3 not in values.shape or values.dtype.kind not in "iuf":
            raise FileFormatError(
                f"{where}: the array {key!r} must hold numbers of shape (N, 3), it is {values.shape}"
            )
        if values.dtype.kind in "iu":
            counted.append(sensor)
        found[sensor] = (values if values.shape[1] == 3 else values.T).astype(np.float64)
    if not found:
        raise FileFormatError(
            f"{where} holds the arrays {', '.join(arrays) or 'none'}; expected are acc and gyr (and mag) of "
            "shape (N, 3) with t (s) or rate (Hz), or a log's imu_t and imu"
        )
    count = len(next(iter(found.values())))
    t, said = _times(arrays, where, count, rate, time_unit)
    if wrong := [sensor for sensor, values in found.items() if len(values) != len(t)]:
        raise FileFormatError(
            f"{where}: {wrong[0]} has {len(found[wrong[0]])} rows and the time {len(t)}; they must agree"
        )
    units = {s: Scale("counts", None) for s in counted if s != "mag"} if _is_unsigned(arrays) else {}
    if units:
        said.append(
            Finding("note", "readings are whole numbers of a converter whose scale is not known: counts")
        )
    return Channels(where, name, t, **found, units=units, findings=said)


def _is_unsigned(arrays: Mapping[str, Any]) -> bool:
    return any(
        np.asarray(values).dtype.kind == "u" and np.asarray(values).ndim == 2 for values in arrays.values()
    )


def _times(
    arrays: Mapping[str, Any], where: str, count: int, rate: float | None, time_unit: Scale | None
) -> tuple[NDArray[np.int64], list[Finding]]:
    key = next((k for k in arrays if k.lower() in TIMES), None)
    if key is not None:
        t = np.asarray(arrays[key]).ravel()
        if time_unit is not None:
            return np.round(t * (time_unit.factor or 1.0)).astype(np.int64), []
        return nanoseconds(t), []
    key = next((k for k in arrays if k.lower() in RATES), None)
    stated = rate or (float(np.asarray(arrays[key]).ravel()[0]) if key else None)
    if not stated or stated <= 0:
        raise FileFormatError(
            f"{where} has no array t and no rate; give rate=100 (Hz; --rate on the command line)"
        )
    return evenly(count, stated), [Finding("note", f"there are no stamps; samples are even at {stated:g} Hz")]


def is_imu_tk_text(path: Path) -> bool:
    """Whether it is a text of four numbers a line, named for a sensor, such as `xsens_acc.mat`."""
    if not re.search(r"acc|gyr", path.stem, re.IGNORECASE) or not path.is_file():
        return False
    with path.open("rb") as file:
        first = file.read(400).split(b"\n")[0]
    words = re.split(rb"[\s,]+", first.strip())
    try:
        return len(words) == 4 and all(np.isfinite(float(word)) for word in words)
    except ValueError:
        return False


def imu_tk_channels(path: str | os.PathLike[str]) -> Channels:
    """IMU-TK's pair of text files, `NAME_acc.*` and `NAME_gyro.*`: t and three counts (or readings) a line.

    Either file, or the folder that holds one pair, may be named.

    Raises
    ------
    FileFormatError
    """
    place = Path(path)
    files = sorted(p for p in (place if place.is_dir() else place.parent).iterdir() if is_imu_tk_text(p))
    stem = re.sub(r"_?(acc|gyr).*$", "", place.stem, flags=re.IGNORECASE) if place.is_file() else ""
    pairs = {
        k: [f for f in files if f.name.startswith(stem) and re.search(k, f.stem, re.IGNORECASE)]
        for k in ("acc", "gyr")
    }
    if any(len(pair) > 1 for pair in pairs.values()):
        raise FileFormatError(
            f"{place} holds several recordings: {', '.join(f.name for f in files)}; name one file"
        )
    streams = {}
    for sensor, kind in (("accel", "acc"), ("gyro", "gyr")):
        for file in pairs[kind]:
            table = read_table(require_file(file), lambda _: False)
            t, _ = stamps_of(table.text(0), scale_of("t", "s"), table.where)
            values = table.numbers([1, 2, 3])
            whole = bool((values == np.round(values)).all())
            streams[sensor] = SensorStream(t, values, Scale("counts", None) if whole else None)
    if not streams:
        raise FileFormatError(
            f"{place} holds no file of IMU-TK: t and three numbers a line, named …acc… or …gyr…"
        )
    return merge(streams, where=os.fspath(path), name=stem or place.name, findings=[])
