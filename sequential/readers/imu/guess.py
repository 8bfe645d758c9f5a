"""Units told from the readings themselves: gravity at rest is known, and a gyro must turn it rightly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sequential.readers.imu.units import Scale, scale_of
from sequential.sensors.finding import Finding
from sequential.sensors.turning import level_at_rest, quietest, right_factor, too_far, turning_errors

__all__ = ["FREE_FALL", "guess_accel", "guess_gyro", "guess_mag"]

Array = NDArray[np.float64]
SENSITIVITIES = (16384.0, 8192.0, 4096.0, 2048.0)  # counts in one g, ±2 to ±16 g in 16 bits
DEG = np.pi / 180.0
GYRO_SENSITIVITIES = (131.0, 65.5, 32.8, 16.4)  # counts in one deg/s, ±250 to ±2000 deg/s
# name, what rest shows, and what motion may make of it
ACCEL_BANDS = (
    ("g", 0.8, 1.25, 0.3, 3.1),
    ("m/s^2", 7.8, 12.2, 3.1, 31.0),
    ("mg", 800.0, 1250.0, 310.0, 3100.0),
)
MAG_BANDS = (("G", 0.2, 0.75), ("uT", 18.0, 75.0), ("mG", 180.0, 750.0), ("nT", 18_000.0, 75_000.0))
FREE_FALL = 0.3  # of g: an accelerometer at rest that shows less has had gravity taken away


def guess_accel(accel: Array, rate: float) -> tuple[Scale | None, Finding]:
    """The unit of an accelerometer by its length at rest; None where it is no unit that is known."""
    level = level_at_rest(accel, rate)
    whole = _whole(accel)
    for name, low, high, least, most in ACCEL_BANDS:
        if low <= level <= high:
            return _told("accel", name, level)
        if least <= level <= most and not whole:
            what = f"the accel has no unit and is taken as {name}: it shows {level:.4g} where it moves least"
            return scale_of("accel", name), Finding("warn", what, do="give units accel=… if that is wrong")
    if whole:
        for counts in SENSITIVITIES:
            if abs(level / counts - 1.0) < 0.2:
                return _told("accel", f"{counts:g} LSB/g", level)
        what = f"accelerometer without a known unit: {level:.5g} at rest, taken as counts"
        return None, Finding("warn", what, do="calibrate it, or give units accel='16384 LSB/g' or the like")
    what = f"accelerometer without a known unit: {level:.4g} at rest, where 1 g or 9.81 m/s² is expected"
    return None, Finding("warn", what, do="give units accel=g, m/s^2 or a sensitivity such as '16384 LSB/g'")


def _told(sensor: str, unit: str, level: float) -> tuple[Scale | None, Finding]:
    what = f"the {sensor} has no unit and is taken as {unit}, as its length at rest is {level:.4g}"
    return scale_of(sensor, unit), Finding("note", what, do=f"give units {sensor}=… if that is wrong")


def guess_gyro(
    gyro: Array, t: NDArray[np.int64], accel: Array | None, accel_unit: Scale | None
) -> tuple[Scale | None, Finding]:
    """The unit of a gyro: the one in which it turns gravity as the accelerometer sees it turn.

    Where nothing turns, its size decides, and the finding is a warning.
    """
    said = accel_unit.name if accel_unit is not None else ""
    if _whole(gyro) and (said.endswith("LSB/g") or accel is None or said == "counts"):
        factors = np.array([DEG / counts for counts in GYRO_SENSITIVITIES])
        return _counts(said, right_factor(_errors(gyro, t, accel, factors)))
    errors = _errors(gyro, t, accel, np.array([1.0, DEG]))
    turns = right_factor(errors)
    if turns is not None:
        return _gyro(("rad/s", "deg/s")[turns], "so it turns gravity as the accelerometer shows")
    if too_far(errors):
        return _gyro("deg/s", "in rad/s it would turn where the accelerometer does not")
    largest = float(np.abs(gyro).max(initial=0.0))
    rate = 1e9 / float(np.median(np.diff(t))) if len(t) > 1 else float("nan")
    steps = np.abs(np.diff(gyro, axis=0))[quietest(gyro, rate)[1:]]
    quiet = float(np.median(steps)) if steps.size else 0.0
    unit = "deg/s" if largest > 40.0 or (quiet > 0.02 and largest < 5.0) else "rad/s"
    why = f"by its size alone (largest {largest:.3g}, usual step {quiet:.2g})"
    return _gyro(unit, why, sure=largest > 40.0)


def _errors(gyro: Array, t: NDArray[np.int64], accel: Array | None, factors: Array) -> Array | None:
    return None if accel is None else turning_errors(gyro, t, accel, factors)


def _counts(accel_unit: str, turns: int | None) -> tuple[Scale | None, Finding]:
    """The sensitivity of a gyro of whole numbers: the one that turns gravity rightly, or the usual one."""
    if turns is not None:
        counts = GYRO_SENSITIVITIES[turns]
        what = f"the gyro has no unit and is taken as {counts:g} LSB/(deg/s): so it turns gravity rightly"
        return scale_of("gyro", f"{counts:g} LSB/dps"), Finding("note", what, do="give units gyro=… if wrong")
    if accel_unit != "16384 LSB/g":
        what = "the gyro holds whole numbers and no unit, and is taken as counts"
        return None, Finding("warn", what, do="give units gyro='131 LSB/dps' or the like")
    what = "the gyro has no unit and is taken as 131 LSB/(deg/s), the ±250 deg/s that an MPU-6050 starts with"
    do = "give units gyro='±500 dps', '±1000 dps' or '±2000 dps' if it was set to that range"
    return scale_of("gyro", "131 LSB/dps"), Finding("warn", what, do=do)


def _gyro(unit: str, why: str, *, sure: bool = True) -> tuple[Scale | None, Finding]:
    what = f"the gyro has no unit and is taken as {unit}: {why}"
    return scale_of("gyro", unit), Finding("note" if sure else "warn", what, do="give units gyro=… if wrong")


def guess_mag(mag: Array) -> tuple[Scale | None, Finding]:
    """The unit of a magnetometer by the size of the Earth's field, 25 to 65 µT; None for counts."""
    known = mag[np.isfinite(mag[:, 0])]
    level = float(np.median(np.linalg.norm(known, axis=1))) if len(known) else float("nan")
    if not _whole(known):
        for name, low, high in MAG_BANDS:
            if low <= level <= high:
                return _told("mag", name, level)
    what = f"the magnetometer has no unit and is left as it is (median length {level:.4g})"
    return None, Finding("note", what, do="a heading needs no unit; give units mag=uT, G, … for one")


def _whole(values: Array) -> bool:
    """Whether all readings look like counts: whole, and not all tiny."""
    known = values[np.isfinite(values).all(axis=1)]
    return bool(len(known)) and bool((known == np.round(known)).all()) and float(np.abs(known).max()) > 30.0
