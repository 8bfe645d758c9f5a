"""A calibration leaves the house: constants for a microcontroller, and Kalibr's IMU file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.sensors.calibration import AffineCalibration, ImuCalibration

__all__ = ["c_header", "kalibr_yaml"]

Array = NDArray[np.float64]


def c_header(
    calibrations: ImuCalibration | Sequence[AffineCalibration],
    *,
    source: str = "",
    guard: str = "FACTORLAB_IMU_CALIBRATION_H",
) -> str:
    """Constants of single precision for the firmware, C99: one struct a sensor, units at every field.

    Parameters
    ----------
    calibrations : the sensors, at most one of each kind
    source : the recording and the command, for the comment at the head
    guard : name of the include guard

    Raises
    ------
    DataError
        where there is nothing to write, two sensors of one kind, or a number that a float cannot hold.
    """
    sensors = calibrations.present if isinstance(calibrations, ImuCalibration) else tuple(calibrations)
    kinds = [one.kind for one in sensors]
    if not kinds or len(set(kinds)) < len(kinds):
        raise DataError(f"a C header takes one calibration a sensor, got {', '.join(kinds) or 'none'}")
    source = source or "; ".join(dict.fromkeys(one.source for one in sensors if one.source)) or "not stated"
    head = [
        "/* Calibration of an inertial sensor: calibrated = matrix * (raw - offset).",
        f" * Source: {_commentable(source)}",
        " */",
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
    ]
    return "\n".join(
        [*head, *(line for one in sensors for line in _struct(one)), f"#endif /* {guard} */", ""]
    )


def _struct(one: AffineCalibration) -> list[str]:
    name = f"{one.kind}_calibration"
    rows = [", ".join(_float(value) for value in row) for row in one.matrix]
    unit_in, unit_out = _commentable(one.unit_in), _commentable(one.unit_out)
    matrix = ",\n".join(f"        {{{row}}}" for row in rows)
    return [
        f"struct {name}_f32 {{",
        f"    float matrix[3][3]; /* {unit_out} per {unit_in} */",
        f"    float offset[3];    /* {unit_in} */",
        "};",
        f"static const struct {name}_f32 {name} = {{",
        f"    .matrix = {{\n{matrix}}},",
        f"    .offset = {{{', '.join(_float(value) for value in one.offset)}}},",
        "};",
        "",
    ]


def _felt(matrix: Array, unit: str) -> list[str]:
    rows = ",\n".join(f"    {{{', '.join(_float(value) for value in row)}}}" for row in matrix)
    return [
        "/* What the gyro reads of gravity: first take off gyro_g_sensitivity * calibrated accelerometer. */",
        f"/* {_commentable(unit)} per m/s^2 */",
        f"static const float gyro_g_sensitivity[3][3] = {{\n{rows}}};",
        "",
    ]


def _float(value: float) -> str:
    """Nine digits carry a float there and back."""
    if abs(value) > np.finfo(np.float32).max:
        raise DataError(f"{value:g} is more than a float can hold; give the raw readings another unit")
    digits = f"{float(np.float32(value)):.9g}"
    return f"{digits if set('.en') & set(digits) else digits + '.0'}f"


def _commentable(text: str) -> str:
    """One line that cannot end the comment it stands in."""
    return " ".join(text.split()).replace("*/", "* /")


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
