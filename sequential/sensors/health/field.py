"""The magnetometer: absent, constant, or not in the field of the Earth."""

from __future__ import annotations

import numpy as np

from sequential.sensors.finding import Finding
from sequential.sensors.health.clock import FEWEST
from sequential.sensors.recording import SI, ImuRecording

__all__ = ["field_findings"]

EARTH = (15.0, 110.0)  # µT: 23 to 67 on the ground, and what uncalibrated iron makes of it
VARIES = 0.15
TURNED = 0.5  # rad: more than this must show


def field_findings(recording: ImuRecording) -> list[Finding]:
    """Findings about the magnetometer, where there is an IMU to go with it."""
    inertial = recording.accel is not None or recording.gyro is not None
    if recording.mag is None:
        what = "there is no magnetometer: heading drifts with the gyro's bias, and north is not known"
        return [Finding("note", what)] if inertial else []
    mag = recording.mag[np.isfinite(recording.mag[:, 0])]
    if len(mag) < min(FEWEST, len(recording)):
        what = f"the magnetometer has {len(mag)} readings in {len(recording)} samples"
        return [Finding("fail", what, do="leave it out, or check that it is read at all")]
    if (mag == mag[0]).all():
        return [_constant(recording)]
    length = np.linalg.norm(mag, axis=1)
    usual = float(np.median(length))
    found = []
    if recording.mag_unit == SI["mag"] and not EARTH[0] < usual < EARTH[1]:
        what = f"the magnetic field is {usual:.3g} µT, where the Earth has 25 to 65 µT"
        found.append(Finding("warn", what, do="calibrate it (factorlab calibrate mag), or state its unit"))
    spread = float(np.quantile(length, 0.95) - np.quantile(length, 0.05)) / max(usual, 1e-12)
    if spread > 2 * VARIES:
        what = f"the length of the magnetic field varies by ±{spread / 2:.0%} of {usual:.3g}"
        found.append(
            Finding("note", what, do="iron or magnets near, or no calibration (factorlab calibrate mag)")
        )
    return found


def _constant(recording: ImuRecording) -> Finding:
    what = "the magnetometer gives one reading from beginning to end"
    turned = 0.0
    if recording.gyro is not None and recording.gyro_unit == SI["gyro"] and len(recording) > 1:
        free = recording.gyro[1:] - np.median(recording.gyro, axis=0)
        turned = float(np.ptp(np.cumsum(free * recording.dt[:, None], axis=0), axis=0).max())
    if recording.gyro is not None and turned < TURNED:
        return Finding("warn", what, do="nothing turned, so it may be right; turn it once to see")
    return Finding("fail", what, do="leave it out (mag=None, --no-mag): a heading from it would be wrong")
