"""Units and signs, judged by gravity: its length at rest, and the way in which a gyro turns it."""

from __future__ import annotations

import numpy as np

from sequential.sensors.finding import Finding
from sequential.sensors.gravity import STANDARD_GRAVITY
from sequential.sensors.health.clock import FEWEST
from sequential.sensors.recording import SI, ImuRecording
from sequential.sensors.turning import level_at_rest, quietest, turning_ratio

__all__ = ["scale_findings"]

DEG = np.pi / 180.0
FASTEST = 70.0  # rad/s: 4000 deg/s, the largest range that is sold
RESTING = 0.6  # rad/s: 35 deg/s, more than any bias


def scale_findings(recording: ImuRecording) -> list[Finding]:
    """Findings about the scale of accelerometer and gyro, where they are in SI units."""
    if len(recording) < FEWEST:
        return []
    found = []
    if recording.accel is not None and recording.accel_unit == SI["accel"]:
        found += _gravity(level_at_rest(recording.accel, recording.rate))
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


def _gyro(recording: ImuRecording) -> list[Finding]:
    gyro, accel = recording.gyro, recording.accel
    assert gyro is not None  # noqa: S101 - the caller has looked
    largest = float(np.abs(gyro).max())
    ratio = None if accel is None else turning_ratio(gyro, recording.t, accel)
    degrees = "it is in deg/s: read it with units gyro=deg/s"
    if ratio is not None and 0.3 < ratio / DEG < 3.0:
        return [Finding("fail", f"the gyro turns {1 / ratio:.0f} times as far as gravity does", do=degrees)]
    if largest > FASTEST:
        return [Finding("fail", f"the gyro reaches {largest:.0f} rad/s, which no gyro measures", do=degrees)]
    calm = quietest(gyro, recording.rate)
    resting = float(np.median(np.linalg.norm(gyro[calm], axis=1)))
    if (
        accel is not None
        and resting > RESTING
        and ratio is None
        and float(accel[calm].std(axis=0).max()) < 0.2
    ):
        what = f"the gyro shows {resting:.2f} rad/s while the accelerometer rests"
        return [Finding("fail", what, do=f"{degrees}, or remove its bias (factorlab calibrate gyro)")]
    return [] if ratio is None else _turning(ratio)


def _turning(ratio: float) -> list[Finding]:
    """A gyro that is neither in degrees nor right."""
    if 30.0 < ratio < 120.0:
        do = "its unit was taken as deg/s and is rad/s: read it with units gyro=rad/s"
        return [Finding("fail", f"gravity turns {ratio:.0f} times as far as the gyro does", do=do)]
    if ratio < -0.3:
        what = f"the gyro turns gravity the wrong way ({ratio:.2f} of what the accelerometer shows)"
        return [Finding("fail", what, do="the axes or signs of the two disagree; turn one of them round")]
    if not 0.5 < ratio < 2.0:
        what = f"gravity turns {ratio:.2f} times as far as the gyro does"
        return [Finding("warn", what, do="check the range that the gyro was set to, and that axes agree")]
    return []
