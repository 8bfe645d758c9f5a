"""From recordings to constants: dwells, fits, and a trial on another recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sequential.errors import DataError
from sequential.sensors import (
    AccelerometerFit,
    AffineCalibration,
    Dwells,
    Finding,
    GyroAtRest,
    GyroBetweenDwells,
    GyroFit,
    ImuCalibration,
    ImuRecording,
    KnownTurn,
    MultiPosition,
    StillDetector,
    TurnFit,
    Verification,
    bias_at_rest,
    join_recordings,
    turn_gains,
    verify,
)
from sequential.sensors.gravity_fit import Prior

__all__ = ["Calibrated", "calibrate_accel", "calibrate_gyro", "calibrate_imu"]


@dataclass(frozen=True, slots=True, eq=False)
class Calibrated:
    """Constants, and everything that a page says about them; what a job does not do is None."""

    recording: ImuRecording
    dwells: Dwells
    detector: StillDetector
    calibration: ImuCalibration
    gravity: float
    accel: AccelerometerFit | None = None
    gyro: GyroFit | None = None
    turns: TurnFit | None = None
    rest: GyroAtRest | None = None
    findings: tuple[Finding, ...] = ()
    verification: Verification | None = None

    def verified(self, other: ImuRecording) -> Calibrated:
        """The same with a trial on another recording."""
        done = verify(self.calibration, other, gravity=self.gravity, detector=self.detector)
        return replace(self, verification=done)


def calibrate_accel(
    recordings: Sequence[ImuRecording], settings: MultiPosition, detector: StillDetector
) -> Calibrated:
    """Accelerometer from dwells in many positions, or in six.

    Raises
    ------
    DataError
        where positions are too few, missing or coplanar.
    """
    for one in recordings:
        one.require("accel", si=False)
    whole, dwells = join_recordings(recordings, detector)
    fit = settings.calibrate(dwells)
    bundle = ImuCalibration(accel=fit.calibration)
    return Calibrated(whole, dwells, detector, bundle, settings.gravity, fit, findings=fit.findings)


def calibrate_imu(
    recordings: Sequence[ImuRecording],
    settings: MultiPosition,
    detector: StillDetector,
    between: GyroBetweenDwells | None = None,
) -> Calibrated:
    """Accelerometer from the dwells, then gyro from the moves between them.

    Raises
    ------
    DataError
    """
    for one in recordings:
        one.require("accel", "gyro", si=False)
    done = calibrate_accel(recordings, settings, detector)
    accel = done.accel
    assert accel is not None  # noqa: S101 - it is what was just made
    gyro = (between or GyroBetweenDwells()).calibrate(
        done.recording, done.dwells, accel.calibration, used=accel.used
    )
    bundle = ImuCalibration(gyro.accel, gyro.calibration, None, gyro.rest.g_sensitivity)
    findings = (*_still_open(accel.findings, gyro.accel), *gyro.findings)
    return replace(done, calibration=bundle, gyro=gyro, rest=gyro.rest, findings=findings)


def _still_open(findings: Sequence[Finding], refined: AffineCalibration) -> list[Finding]:
    """Findings of the accelerometer's fit less what the moves have cleared up."""
    assert refined.cov is not None  # noqa: S101 - a fit has a covariance
    sigma = np.sqrt(np.diag(refined.cov))[[3, 6, 7]] / np.diag(refined.matrix)[[0, 0, 1]]
    if (sigma > 0.5 * Prior().shear).any():
        return list(findings)
    what = "a misalignment of the accelerometer that its positions do not show comes from the gyro's moves"
    return [Finding("note", what) if "cannot be seen" in one.what else one for one in findings]


def calibrate_gyro(
    recordings: Sequence[ImuRecording],
    detector: StillDetector,
    turns: Sequence[KnownTurn] = (),
    *,
    gravity: float,
    turn_sigma: float = np.radians(0.5),
) -> Calibrated:
    """Bias from the still parts, gains from known turns where there are any.

    Raises
    ------
    DataError
    """
    for one in recordings:
        one.require("gyro", si=False)
    whole, dwells = join_recordings(recordings, detector)
    if turns:
        fit = turn_gains(whole, dwells, turns, sigma=turn_sigma)
        bundle = ImuCalibration(gyro=fit.calibration)
        done = Calibrated(whole, dwells, detector, bundle, gravity, turns=fit, rest=fit.rest)
        still = sorted({"xyz"[k] for k in range(3)} - {"xyz"[turn.axis] for turn in turns})
        if still:
            what = f"no turn about {' and '.join(still)}: the gain there is the nominal one"
            done = replace(done, findings=(Finding("warn", what, "", "turn about every axis"),))
        return done
    rest = bias_at_rest(dwells)
    if whole.gyro_unit != "rad/s":
        raise DataError(
            f"the gyro of {whole.name!r} is in {whole.gyro_unit}, and a recording at rest shows no "
            "scale: give --units gyro=…, or known turns (--turn x=90), or take calibrate imu"
        )
    cov = np.zeros((12, 12))
    cov[9:, 9:] = rest.cov
    source = f"{whole.name}: bias of {len(dwells)} still parts, gains nominal"
    gyro = AffineCalibration(np.eye(3), rest.bias, cov, "gyro", whole.gyro_unit, "rad/s", None, source)
    what = "a recording at rest shows the bias alone: gains and misalignment are the nominal ones"
    finding = Finding("note", what, "", "add known turns with --turn, or calibrate imu on many positions")
    bundle = ImuCalibration(gyro=gyro)
    return Calibrated(whole, dwells, detector, bundle, gravity, rest=rest, findings=(finding,))
