"""Recordings as plain CSV, units in the header, so that reading one gives the same numbers."""

from __future__ import annotations

import os

import numpy as np

from sequential.readers.files import replacing
from sequential.readers.stamps import decimal_seconds
from sequential.sensors.recording import ImuRecording

__all__ = ["write_imu"]

LETTERS = {"accel": "a", "gyro": "g", "mag": "m"}


def write_imu(recording: ImuRecording, path: str | os.PathLike[str]) -> None:
    """Write t [s], ax [m/s^2] …, gx [rad/s] …, mx [uT] …, temperature [degC], as far as they are there.

    Rows without a magnetometer reading have empty cells.  The file appears whole or not at all.
    """
    header, arrays = ["t [s]"], []
    for sensor, letter in LETTERS.items():
        if (values := getattr(recording, sensor)) is not None:
            unit = getattr(recording, f"{sensor}_unit")
            header += [f"{letter}{axis} [{unit}]" for axis in "xyz"]
            arrays.append(values)
    if recording.temperature is not None:
        header.append("temperature [degC]")
        arrays.append(recording.temperature[:, None])
    table = np.hstack(arrays).tolist()
    with replacing(path) as file:
        file.write(",".join(header) + "\n")
        for t, row in zip(recording.t.tolist(), table, strict=True):
            cells = ["" if value != value else repr(value) for value in row]  # noqa: PLR0124 - NaN
            file.write(",".join([decimal_seconds(t), *cells]) + "\n")
