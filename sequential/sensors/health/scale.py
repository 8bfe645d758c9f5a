"""Units and signs, judged by gravity: its length at rest, and the way in which a gyro turns it."""

from __future__ import annotations

import numpy as np

from sequential.sensors.finding import Finding
from sequential.sensors.gravity import STANDARD_GRAVITY
from sequential.sensors.health.clock import FEWEST
from sequential.sensors.recording import SI, ImuRecording
from sequential.sensors.turning import is_calm, level_at_rest, quietest, right_factor, too_far, turning_errors

__all__ = ["scale_findings"]

DEG = np.pi / 180.0
FASTEST = 70.0  # rad/s: 4000 deg/s, the largest range that is sold
DEGREES = "it is in deg/s: read it with units gyro=deg/s"
RESTING = 0.6  # rad/s: 35 deg/s, more than any bias


def _times(factor: float) -> Finding:
    what = f"gravity turns {factor:g} times as far as the gyro does"
    return Finding("warn", what, do="check the range that the gyro was set to, and that its axes agree")


# What brings the gyro to rad/s, and what to say where that factor turns gravity rightly and 1 does not.
FACTORS = {
    1.0: None,
    DEG: Finding("fail", "the gyro turns 57 times as far as gravity does", do=DEGREES),
    1.0 / DEG: Finding(
        "fail",
        "gravity turns 57 times as far as the gyro does",
        do="its unit was taken as deg/s and is rad/s: read it with units gyro=rad/s",
    ),
    -1.0: Finding(
        "fail",
        "the gyro turns gravity the wrong way",
        do="the axes or signs of gyro and accelerometer disagree; turn one of them round",
    ),
    **{factor: _times(factor) for factor in (0.25, 0.5, 2.0, 4.0)},
}


def scale_findings(recording: ImuRecording) -> list[Finding]:
    """Findings about the scale of accelerometer and gyro, where they are in SI units."""
    if len(recording) < FEWEST:
        return []
    found = []
    if recording.accel is not None and recording.accel_unit == SI["accel"]:
        level = level_at_rest(recording.accel, recording.rate)
        found += _gravity(level) if is_calm(recording.accel, recording.rate) else _in_motion(level)
    if recording.gyro is not None and recording.gyro_unit == SI["gyro"]:
        found += _gyro(recording)
    return found


def _gravity(level: float) -> list[Finding]:
    said = f"the accelerometer shows {level:.{2 if level < 100 else 0}f} at rest where 9.81 m/s² is expected"
    guesses = (
        ("it is in g", "read it with units accel=g", 0.8, 1.25),
        ("it is in thousandths of g", "read it with units accel=mg", 800.0, 1250.0),
        ("these are counts", "read it with units accel='16384 LSB/g' or the like", 1250.0, 1e9),
    )
    for what, do, low, high in guesses:
        if low <= level <= high:
            return [Finding("fail", said, do=f"{what}; {do}")]
    ratio = level / STANDARD_GRAVITY
    if ratio < 0.3:
        do = "gravity was taken away; record the acceleration with gravity"
        return [Finding("fail", said, do=do)]
    if not 0.6 < ratio < 1.6:
        return [Finding("fail", said, do="state its unit with units accel=…, or calibrate it")]
    if not 0.88 < ratio < 1.12:
        return [Finding("warn", said, do="calibrate it (factorlab calibrate accel)")]
    return []


def _in_motion(level: float) -> list[Finding]:
    """An accelerometer that never rests shows g within a factor of three."""
    said = f"the accelerometer shows {level:.3g} where it moves least, far from 9.81 m/s²"
    if level < 0.3 * STANDARD_GRAVITY:
        return [Finding("fail", said, do="it is in g, or gravity was taken away; read it with units accel=g")]
    if level > 3.2 * STANDARD_GRAVITY:
        return [Finding("fail", said, do="state its unit with units accel=…")]
    return []


def _gyro(recording: ImuRecording) -> list[Finding]:
    gyro, accel = recording.gyro, recording.accel
    assert gyro is not None  # noqa: S101 - the caller has looked
    errors = None if accel is None else turning_errors(gyro, recording.t, accel, np.array(list(FACTORS)))
    right = right_factor(errors)
    if right is not None:
        return [finding] if (finding := list(FACTORS.values())[right]) is not None else []
    largest = float(np.abs(gyro).max())
    if largest > FASTEST:
        return [Finding("fail", f"the gyro reaches {largest:.0f} rad/s, which no gyro measures", do=DEGREES)]
    if too_far(errors):
        return [Finding("fail", "the gyro turns where the accelerometer shows that nothing does", do=DEGREES)]
    calm = quietest(gyro, recording.rate)
    resting = float(np.median(np.linalg.norm(gyro[calm], axis=1)))
    if accel is not None and resting > RESTING and float(accel[calm].std(axis=0).max()) < 0.2:
        what = f"the gyro shows {resting:.2f} rad/s while the accelerometer rests"
        return [Finding("fail", what, do=f"{DEGREES}, or remove its bias (factorlab calibrate gyro)")]
    return []
