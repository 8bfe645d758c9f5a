"""A calibration leaves the house: constants for a microcontroller, and Kalibr's IMU file."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.sensors.calibration import ImuCalibration
from sequential.sensors.calibration_header import c_header

__all__ = ["c_header", "kalibr_yaml"]

Array = NDArray[np.float64]


def kalibr_yaml(calibration: ImuCalibration, *, rate: float | None = None) -> str:
    """The scale-misalignment part of Kalibr's `imu.yaml`.

    Kalibr's equations go from the truth to the reading, `reading = M C quantity + bias`, with M lower
    triangular and the x axis of its IMU frame along the accelerometer's; so M C is the inverse of our
    matrix, cut by an LQ decomposition, and T_i_b turns our frame into Kalibr's.  Kalibr has no line for a
    constant bias (its bias is a spline); ours stands beside it as `offset`.

    Parameters
    ----------
    calibration : with an accelerometer, a gyroscope, or both
    rate : of the recording, Hz

    Raises
    ------
    DataError
        where there is neither accelerometer nor gyroscope.
    """
    accel, gyro = calibration.accel, calibration.gyro
    if accel is None and gyro is None:
        raise DataError("Kalibr's IMU file needs an accelerometer or a gyroscope; there is neither")
    imu_R_body = np.eye(3) if accel is None else _lower_and_turn(np.linalg.inv(accel.matrix))[1]
    pose = np.eye(4)
    pose[:3, :3] = imu_R_body
    lines = ["imu0:", "  model: scale-misalignment", *_rows("  T_i_b", pose), "  time_offset: 0.0"]
    if rate is not None:
        lines.append(f"  update_rate: {rate:.6g}")
    if accel is not None:
        lower, _ = _lower_and_turn(np.linalg.inv(accel.matrix))
        lines += ["  accelerometers:", f"    # {accel.unit_in} per {accel.unit_out}"]
        lines += [*_rows("    M", lower), f"    offset: {_numbers(accel.offset)}  # {accel.unit_in}"]
    if gyro is not None:
        lower, turn = _lower_and_turn(np.linalg.inv(gyro.matrix) @ imu_R_body.T)
        felt = np.zeros((3, 3)) if calibration.g_sensitivity is None else calibration.g_sensitivity
        lines += ["  gyroscopes:", f"    # {gyro.unit_in} per {gyro.unit_out}"]
        lines += [*_rows("    M", lower), *_rows("    C_gyro_i", turn), *_rows("    A", felt @ imu_R_body.T)]
        lines.append(f"    offset: {_numbers(gyro.offset)}  # {gyro.unit_in}")
    return "\n".join(lines) + "\n"


def _lower_and_turn(matrix: NDArray[Any]) -> tuple[Array, Array]:
    """Lower triangular L with a positive diagonal and an orthogonal C, L C = matrix."""
    q, r = np.linalg.qr(matrix.T)
    signs = np.where(np.diag(r) < 0, -1.0, 1.0)
    return (r.T * signs), (q * signs).T


def _rows(name: str, matrix: Array) -> list[str]:
    indent = " " * (len(name) - len(name.lstrip()))
    return [f"{name}:", *(f"{indent}- {_numbers(row)}" for row in matrix)]


def _numbers(values: Array) -> str:
    return f"[{', '.join(repr(float(value) + 0.0) for value in values)}]"
