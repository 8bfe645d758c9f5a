"""PX4's flight logs: the inertial sensor that the autopilot flew with, and its magnetometer."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FileFormatError, MissingStreamError
from sequential.readers.files import require_file
from sequential.readers.imu.assemble import Channels
from sequential.readers.imu.merge import SensorStream, merge
from sequential.readers.imu.units import scale_of
from sequential.sensors.finding import Finding

__all__ = ["ulog_channels"]

TOPICS = ["sensor_combined", "vehicle_magnetometer", "sensor_mag", "sensor_accel", "sensor_gyro"]
INVALID = 0x7FFFFFFF  # a relative stamp that says: no reading


def ulog_channels(path: str | os.PathLike[str]) -> Channels:
    """Read `sensor_combined` (or `sensor_accel` and `sensor_gyro`) and the magnetometer; body axes are FRD.

    Raises
    ------
    DataError
        where pyulog is not installed.
    FileFormatError, MissingStreamError
    """
    file = require_file(path)
    try:
        from pyulog import ULog
    except ImportError:
        raise DataError(f"{file} is a ULog, which needs pyulog: pip install 'factorlab[ulog]'") from None
    if not file.read_bytes().startswith(b"ULog"):
        raise FileFormatError(f"{file} is not a ULog: it does not begin with the letters ULog")
    try:
        with file.open("rb") as opened:
            log = ULog(opened, TOPICS)
    except Exception as fault:  # noqa: BLE001 - a parser of binary files fails in many ways
        raise FileFormatError(
            f"{file} is a ULog that cannot be read ({fault}); copy it from the card again"
        ) from None
    topics: dict[str, dict[str, NDArray[Any]]] = {}
    for data in log.data_list:
        if data.multi_id == 0 or data.name not in topics:
            topics[data.name] = data.data
    streams = _inertial(topics)
    if not streams:
        raise MissingStreamError(
            f"{file} has none of the topics sensor_combined, sensor_accel, sensor_gyro: log them (SDLOG_…)"
        )
    if mag := _magnetometer(topics):
        streams["mag"] = mag
    said = [Finding("note", "axes are PX4's: x forward, y right, z down, so that gravity reads -9.81 on z")]
    return merge(streams, where=os.fspath(path), name=Path(path).stem, findings=said)


def _inertial(topics: dict[str, dict[str, NDArray[Any]]]) -> dict[str, SensorStream]:
    metric, angular = scale_of("accel", "m/s^2"), scale_of("gyro", "rad/s")
    if (both := topics.get("sensor_combined")) is not None:
        t = both["timestamp"].astype(np.int64) * 1000
        late = both.get("accelerometer_timestamp_relative", np.zeros(len(t))).astype(np.int64)
        good = late != INVALID
        accel = SensorStream((t + late * 1000)[good], _axes(both, "accelerometer_m_s2")[good], metric)
        return {"gyro": SensorStream(t, _axes(both, "gyro_rad"), angular), "accel": accel}
    streams = {}
    for sensor, topic, unit in (("accel", "sensor_accel", metric), ("gyro", "sensor_gyro", angular)):
        if (data := topics.get(topic)) is not None:
            streams[sensor] = SensorStream(_sampled(data), _axes(data, ""), unit)
    return streams


def _magnetometer(topics: dict[str, dict[str, NDArray[Any]]]) -> SensorStream | None:
    gauss = scale_of("mag", "G")
    if (data := topics.get("vehicle_magnetometer")) is not None:
        return SensorStream(_sampled(data), _axes(data, "magnetometer_ga"), gauss)
    if (data := topics.get("sensor_mag")) is not None:
        return SensorStream(_sampled(data), _axes(data, ""), gauss)
    return None


def _sampled(data: dict[str, NDArray[Any]]) -> NDArray[np.int64]:
    """When it was sampled, ns; older logs only know when it was published."""
    stamp = data.get("timestamp_sample", data["timestamp"]).astype(np.int64)
    return np.asarray(np.where(stamp > 0, stamp, data["timestamp"].astype(np.int64)) * 1000)


def _axes(data: dict[str, NDArray[Any]], name: str) -> NDArray[np.float64]:
    """(N, 3) of `name[0]` to `name[2]`, or of x, y and z."""
    keys = [f"{name}[{k}]" for k in range(3)] if name else ["x", "y", "z"]
    if missing := [key for key in keys if key not in data]:
        raise FileFormatError(f"the ULog topic has no field {missing[0]}; it has {', '.join(data)}")
    return np.stack([data[key].astype(np.float64) for key in keys], axis=1)
