"""Kalibr's `imu.yaml`: four noise figures, a rate and a topic."""

from __future__ import annotations

import math
import os
from typing import Any, NamedTuple

from sequential.errors import DataError, FileFormatError, ModelError
from sequential.noise import KALIBR, ImuNoise
from sequential.readers.files import read_text, replacing

__all__ = ["KalibrImu", "read_kalibr_imu", "write_kalibr_imu"]

UNITS = {
    "accelerometer_noise_density": "m/s^2/sqrt(Hz), white noise (velocity random walk N)",
    "accelerometer_random_walk": "m/s^3/sqrt(Hz), random walk of the bias (K)",
    "gyroscope_noise_density": "rad/s/sqrt(Hz), white noise (angle random walk N)",
    "gyroscope_random_walk": "rad/s^2/sqrt(Hz), random walk of the bias (rate random walk K)",
}


class KalibrImu(NamedTuple):
    """What an `imu.yaml` says: noise, samples a second (Hz), and the ROS topic."""

    noise: ImuNoise
    rate: float
    topic: str


def write_kalibr_imu(
    path: str | os.PathLike[str], noise: ImuNoise, rate: float, *, topic: str = "/imu0", comment: str = ""
) -> None:
    """Write an `imu.yaml` as Kalibr reads it.

    Parameters
    ----------
    path : of the file
    noise : in SI units, as `ImuNoise` holds it
    rate : samples a second, Hz
    topic : of the IMU in a ROS bag
    comment : lines for the top of the file

    Raises
    ------
    DataError
        for a rate that is not positive, or a folder that is not there.
    """
    import yaml

    if not (math.isfinite(rate) and rate > 0):
        raise DataError(f"Kalibr's imu.yaml needs the rate of the IMU in Hz, a positive number; got {rate}")
    ours = {theirs: getattr(noise, name) for theirs, name in KALIBR.items()}
    with replacing(path) as file:
        file.writelines(f"# {line}\n" for line in comment.splitlines())
        for name, unit in UNITS.items():
            # a float in YAML needs a point, or it is read as text: 1e-5 is a string
            file.write(f"{name}: {ours[name]:.9e}  # {unit}\n")
        yaml.safe_dump({"rostopic": topic, "update_rate": float(rate)}, file, default_flow_style=False)


def read_kalibr_imu(path: str | os.PathLike[str]) -> KalibrImu:
    """Read an `imu.yaml`, or EuRoC's `sensor.yaml`, which has the same names; other entries are left alone.

    Raises
    ------
    DataError, FileFormatError
        naming the entry that is missing, or is no number.
    """
    import yaml

    name = os.fspath(path)
    try:
        # OpenCV's first line is no directive of YAML
        entries = yaml.safe_load(read_text(path).removeprefix("%YAML:1.0"))
    except yaml.YAMLError as fault:
        reason = " ".join(str(fault).split())
        raise FileFormatError(f"{name} is not YAML: {reason}") from None
    if not isinstance(entries, dict):
        raise FileFormatError(f"{name} holds no entries; an imu.yaml says 'gyroscope_noise_density: 0.0017'")
    wanted = (*UNITS, "update_rate", "rate_hz")
    numbers = {key: _number(name, key, entries[key]) for key in wanted if key in entries}
    try:
        noise = ImuNoise.from_kalibr(numbers)
    except ModelError as fault:
        raise FileFormatError(f"{name}: {fault}") from None
    rate = numbers.get("update_rate", numbers.get("rate_hz", math.nan))
    return KalibrImu(noise, rate, str(entries.get("rostopic", "")))


def _number(name: str, key: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise FileFormatError(f"{name}: {key} is {value!r}, a number is needed") from None
