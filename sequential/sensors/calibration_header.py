"""A calibration as constants of a C header: single precision for a Cortex-M4, fixed point for an AVR."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.sensors.calibration import KINDS, AffineCalibration, ImuCalibration
from sequential.sensors.gravity import STANDARD_GRAVITY
from sequential.sensors.recording import COUNTS, SI

__all__ = ["MPU6050_COUNTS", "c_header", "calibration_hash", "nominal_calibration", "other_ranges"]

Array = NDArray[np.float64]
MPU6050_COUNTS: Mapping[str, float] = {
    "accel": 8.0 * STANDARD_GRAVITY / 2**15,
    "gyro": math.radians(2000.0) / 2**15,
    "mag": 100.0 / 3000.0,
}
"""What a count is worth to the firmware's drivers: an MPU-6050 at ±8 g (m/s²) and ±2000 °/s (rad/s), a
QMC5883L at ±8 G (µT)."""
SAME_RANGE = (0.7, 1.4)  # ranges of a sensor lie a factor of two apart
MATRIX_BITS, SHIFT_BITS = 32, 24  # struct affine_q of firmware/core/calibration_q.h
STRUCTS = """\
/* As in calibration_f32.h and calibration_q.h of the firmware's core, with which this may be included. */
#include <stdint.h>
#ifndef FACTORLAB_AFFINE_F32
#define FACTORLAB_AFFINE_F32
struct affine_f32 {
    float matrix[3][3]; /* SI (mag: uT) per count */
    float offset[3];    /* counts */
};
#endif
#ifndef FACTORLAB_AFFINE_Q
#define FACTORLAB_AFFINE_Q
struct affine_q {
    int32_t matrix[3][3]; /* SI (mag: uT) per count, Q32 */
    int32_t shift[3];     /* SI (mag: uT), Q24: matrix * offset */
};
#endif
"""


def nominal_calibration() -> ImuCalibration:
    """What the data sheets say of the firmware's sensors: gains alone, `MPU6050_COUNTS`."""
    one = {
        kind: AffineCalibration(
            np.eye(3) * MPU6050_COUNTS[kind], np.zeros(3), None, kind, COUNTS, SI[kind], source="data sheet"
        )
        for kind in KINDS
    }
    return ImuCalibration(one["accel"], one["gyro"], one["mag"])


def calibration_hash(calibration: ImuCalibration) -> int:
    """First four bytes of the SHA-256 of the JSON file that `save` writes; 0 stands for no calibration.

    An image carries it in its boot frame: `sha256sum calibration.json` begins with the same eight digits.
    """
    return int(hashlib.sha256((calibration.to_json() + "\n").encode()).hexdigest()[:8], 16)


def other_ranges(
    calibration: ImuCalibration, counts: Mapping[str, float] = MPU6050_COUNTS
) -> dict[str, float]:
    """Sensors calibrated in counts that are not the driver's, with how many of the driver's counts one is.

    The constants of such an accelerometer or gyro are right for the range that it was recorded with, and
    wrong on a board whose driver chooses `counts`.
    """
    found = {}
    for one in calibration.present:
        if one.kind != "mag" and one.unit_in == COUNTS and one.unit_out == SI[one.kind]:
            ratio = float(np.cbrt(abs(np.linalg.det(one.matrix)))) / counts[one.kind]
            if not SAME_RANGE[0] < ratio < SAME_RANGE[1]:
                found[one.kind] = ratio
    return found


def c_header(
    calibrations: ImuCalibration | Sequence[AffineCalibration] | None,
    *,
    source: str = "",
    guard: str = "FACTORLAB_IMU_CALIBRATION_H",
    counts: Mapping[str, float] = MPU6050_COUNTS,
) -> str:
    """Constants for the firmware, C99: every sensor in single precision and in fixed point, and a hash.

    The firmware reads counts.  A calibration made from counts is written as it is, one made from SI readings
    for counts of the size `counts`; sensors without a calibration get that size alone, so that the header
    always builds an image.  A sensor whose numbers do not fit struct affine_q has a comment in place of its
    fixed-point constants.

    Parameters
    ----------
    calibrations : the sensors, at most one of each kind; None for an uncalibrated MPU-6050 (hash 0)
    source : the recording and the command, for the comment at the head
    guard : name of the include guard
    counts : what a count of the driver is worth: gyro rad/s, accel m/s², mag µT

    Raises
    ------
    DataError
        where there is nothing to write, two sensors of one kind, or a number that a float cannot hold.
    """
    if calibrations is None:
        bundle, found = nominal_calibration(), 0
    else:
        bundle = _bundle(calibrations)
        found = calibration_hash(bundle)
    source = source or "; ".join(dict.fromkeys(one.source for one in bundle.present if one.source))
    nominal = nominal_calibration()
    lines = [
        "/* Calibration of an inertial sensor: calibrated = matrix * (raw - offset), raw in counts.",
        f" * Source: {_commentable(source or 'not stated')}",
        " */",
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        STRUCTS,
        "/* First 4 bytes of the SHA-256 of calibration.json; 0: none */",
        f"#define FACTORLAB_CALIBRATION_HASH 0x{found:08x}UL",
        "",
    ]
    for kind in ("gyro", "accel", "mag"):
        one = getattr(bundle, kind)
        if one is None:
            scale = counts[kind]
            given = getattr(nominal, kind).with_counts(scale / MPU6050_COUNTS[kind])
            lines += _constants(given, f"not calibrated: {scale:.6g} {SI[kind]} per count")
        elif one.unit_in == SI[kind]:
            lines += _constants(one.with_counts(counts[kind]), f"counts of {counts[kind]:.6g} {SI[kind]}")
        else:
            ratio = other_ranges(bundle, counts).get(kind)
            remark = "" if ratio is None else f"another range: one is {ratio:.3g} of the firmware's driver"
            lines += _constants(one, remark)
    if bundle.g_sensitivity is not None:
        lines += _felt(bundle.g_sensitivity, "raw unit" if bundle.gyro is None else bundle.gyro.unit_in)
    return "\n".join([*lines, f"#endif /* {guard} */", ""])


def _bundle(calibrations: ImuCalibration | Sequence[AffineCalibration]) -> ImuCalibration:
    if isinstance(calibrations, ImuCalibration):
        sensors: Sequence[AffineCalibration] = calibrations.present
    else:
        sensors = tuple(calibrations)
    kinds = [one.kind for one in sensors]
    if not kinds or len(set(kinds)) < len(kinds):
        raise DataError(f"a C header takes one calibration a sensor, got {', '.join(kinds) or 'none'}")
    if isinstance(calibrations, ImuCalibration):
        return calibrations
    by_kind = {one.kind: one for one in sensors}
    return ImuCalibration(by_kind.get("accel"), by_kind.get("gyro"), by_kind.get("mag"))


def _constants(one: AffineCalibration, remark: str) -> list[str]:
    unit_in, unit_out = _commentable(one.unit_in), _commentable(one.unit_out)
    title = f"{one.kind}: {unit_out} from {unit_in}" + (f", {remark}" if remark else "")
    rows = ",\n".join(f"     {{{', '.join(_float(value) for value in row)}}}" for row in one.matrix)
    lines = [
        f"/* {title} */",
        f"static const struct affine_f32 {one.kind}_calibration_f32 = {{",
        f"    {{{rows[5:]}}},",
        f"    {{{', '.join(_float(value) for value in one.offset)}}}}};",
    ]
    try:
        matrix = [[_fixed(value, MATRIX_BITS) for value in row] for row in one.matrix]
        shift = [_fixed(value, SHIFT_BITS) for value in one.matrix @ one.offset]
    except OverflowError as error:
        return [*lines, f"/* no {one.kind}_calibration_q: {error} */", ""]
    rows = ",\n".join(f"     {{{', '.join(row)}}}" for row in matrix)
    return [
        *lines,
        f"static const struct affine_q {one.kind}_calibration_q = {{",
        f"    {{{rows[5:]}}},",
        f"    {{{', '.join(shift)}}}}};",
        "",
    ]


def _felt(matrix: Array, unit: str) -> list[str]:
    rows = ",\n".join(f"    {{{', '.join(_float(value) for value in row)}}}" for row in matrix)
    return [
        "/* What the gyro reads of gravity: first take off gyro_g_sensitivity * calibrated accelerometer. */",
        f"/* {_commentable(unit)} per m/s^2; the core of the firmware leaves it out */",
        f"static const float gyro_g_sensitivity[3][3] = {{\n{rows}}};",
        "",
    ]


def _float(value: float) -> str:
    """Nine digits carry a float there and back."""
    if abs(value) > np.finfo(np.float32).max:
        raise DataError(f"{value:g} is more than a float can hold; give the raw readings another unit")
    digits = f"{float(np.float32(value)):.9g}"
    return f"{digits if set('.en') & set(digits) else digits + '.0'}f"


def _fixed(value: float, bits: int) -> str:
    """A signed number of 32 bits, `bits` of them behind the point; a literal of long, INT32_MIN left out."""
    number = round(value * 2.0**bits)
    if abs(number) >= 2**31:
        raise OverflowError(f"{value:.4g} is not within +-{2.0 ** (31 - bits):g} (Q{bits})")
    return f"{number}L"


def _commentable(text: str) -> str:
    """One line that cannot end the comment it stands in."""
    return " ".join(text.split()).replace("*/", "* /")
