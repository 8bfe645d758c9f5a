"""Calibration of accelerometer and gyro from six positions and three known turns.

F. Ferraris, U. Grimaldi and M. Parvis, "Procedure for effortless in-field calibration of three-axial rate
gyro and accelerometers", Sensors and Materials 7 (1995), 311-330; equation numbers in comments are theirs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError
from sequential.sensors.calibration import AffineCalibration, ImuCalibration
from sequential.sensors.ferraris_sections import Rows, find_sections, require_sections
from sequential.sensors.ferraris_solution import Parameters, SectionMeans, parameter_cov, solve
from sequential.sensors.finding import Finding
from sequential.sensors.gravity import STANDARD_GRAVITY
from sequential.sensors.recording import ImuRecording

__all__ = ["Ferraris", "FerrarisFit"]

Array = NDArray[np.float64]
CROSS_AXIS = np.sin(np.radians(10.0))


@dataclass(frozen=True, slots=True, eq=False)
class FerrarisFit:
    """What the session says about the IMU.

    Parameters
    ----------
    calibration : accelerometer, gyro, and what the gyro reads of the specific force (g_sensitivity)
    accel_gain, accel_rotation : (3, 3) diagonal K_a in raw units per m/s², and R_a; matrix = (K_a R_a)^-1
    gyro_gain, gyro_rotation : the same of the gyro, K_g in raw units per rad/s
    g_sensitivity : (3, 3) K_ga, what a specific force adds to the gyro, raw units per m/s²
    g_sensitivity_cov : (9, 9) of its rows one after the other
    sections : rows of the recording by the name of the section
    residuals : (6, 3) calibrated mean of each position minus gravity along its axis, m/s²
    """

    calibration: ImuCalibration
    accel_gain: Array
    accel_rotation: Array
    gyro_gain: Array
    gyro_rotation: Array
    g_sensitivity: Array
    g_sensitivity_cov: Array
    sections: Mapping[str, Rows]
    residuals: Array
    findings: tuple[Finding, ...] = ()

    def apply(self, accel: ArrayLike, gyro: ArrayLike) -> tuple[Array, Array]:
        """Calibrated specific force and rate (..., 3) from raw ones, acceleration's influence taken off."""
        accel_part, gyro_part = self.calibration.accel, self.calibration.gyro
        assert accel_part is not None  # noqa: S101 - calibrate() gives both
        assert gyro_part is not None  # noqa: S101
        force = accel_part.apply(accel)
        raw = np.asarray(gyro, dtype=np.float64) - force @ self.g_sensitivity.T
        return force, gyro_part.apply(raw)

    def to_imucal(self) -> dict[str, Any]:
        """The same constants under the names and in the units (deg/s) of imucal's JSON files."""
        accel, gyro = self.calibration.accel, self.calibration.gyro
        assert accel is not None  # noqa: S101 - calibrate() gives both
        assert gyro is not None  # noqa: S101
        return {
            "acc_unit": "m/s^2",
            "gyr_unit": "deg/s",
            "from_acc_unit": "a.u." if accel.unit_in == "counts" else accel.unit_in,
            "from_gyr_unit": "a.u." if gyro.unit_in == "counts" else gyro.unit_in,
            "comment": None,
            "K_a": self.accel_gain.tolist(),
            "R_a": self.accel_rotation.tolist(),
            "b_a": accel.offset.tolist(),
            "K_g": (self.gyro_gain * np.pi / 180).tolist(),
            "R_g": self.gyro_rotation.tolist(),
            "K_ga": self.g_sensitivity.tolist(),
            "b_g": gyro.offset.tolist(),
            "cal_type": "Ferraris",
            "_format_version": "2.0",
        }


@dataclass(frozen=True, slots=True)
class Ferraris:
    """Settings of the procedure.

    Parameters
    ----------
    gravity : |g| where the session was recorded, m/s²; negative where an axis reads -g pointing up
    turn : angle of the three turns about the upward axis, rad; negative is clockwise seen from above
    tilt_sigma : how well a face lies level, and a turn's axis stands upright, rad (1 standard deviation)
    turn_sigma : how well the angle of a turn is known, rad

    Notes
    -----
    The last two do not change the constants.  They are most of the constants' covariance: noise averages
    away in seconds, a crooked table does not.
    """

    gravity: float = STANDARD_GRAVITY
    turn: float = -2 * np.pi
    tilt_sigma: float = np.radians(0.5)
    turn_sigma: float = np.radians(1.0)

    def __post_init__(self) -> None:
        for name, low in (("gravity", None), ("turn", None), ("tilt_sigma", 0.0), ("turn_sigma", 0.0)):
            value = getattr(self, name)
            if not np.isfinite(value) or (value == 0 if low is None else value < low):
                asked = "a number other than zero" if low is None else "zero or more"
                raise DataError(f"Ferraris.{name} is {value}; expected {asked}")

    def calibrate(
        self, recording: ImuRecording, sections: Mapping[str, ArrayLike | slice] | None = None
    ) -> FerrarisFit:
        """Constants from one recording.

        Parameters
        ----------
        recording : with accelerometer and gyro, in any unit
        sections : rows of each of x_p, x_a (x axis up, down) … z_a and x_rot, y_rot, z_rot: a slice, or
            indices; None finds them (`find_sections`)

        Raises
        ------
        MissingStreamError, DataError
            DataError where a section is missing, empty or outside of the recording, or where a position is
            not what its name says.
        """
        recording.require("accel", "gyro", si=False)
        rows = (
            find_sections(recording, abs(self.turn))
            if sections is None
            else require_sections(sections, recording)
        )
        data = SectionMeans.of(recording, rows)
        _require_positions(data, recording.name)
        found = solve(data, self.gravity, self.turn)
        cov = parameter_cov(data, found, self.gravity, self.turn, self.tilt_sigma, self.turn_sigma)
        return self._fit(recording, rows, data, found, cov)

    def _fit(
        self,
        recording: ImuRecording,
        rows: dict[str, Rows],
        data: SectionMeans,
        found: Parameters,
        cov: Array,
    ) -> FerrarisFit:
        truth = self.gravity * np.repeat(np.eye(3), 2, axis=0) * np.tile([1.0, -1.0], 3)[:, None]
        residuals = (data.accel - found.accel_offset) @ found.accel_matrix.T - truth
        accel = AffineCalibration(
            found.accel_matrix,
            found.accel_offset,
            cov[:12, :12],
            "accel",
            recording.accel_unit,
            "m/s^2",
            float(np.sqrt(np.mean(residuals**2))),
            recording.name,
        )
        gyro = AffineCalibration(
            found.gyro_matrix,
            found.gyro_offset,
            cov[12:24, 12:24],
            "gyro",
            recording.gyro_unit,
            "rad/s",
            None,
            recording.name,
        )
        return FerrarisFit(
            ImuCalibration(accel, gyro, None, found.g_sensitivity),
            found.accel_gain,
            found.accel_rotation,
            found.gyro_gain,
            found.gyro_rotation,
            found.g_sensitivity,
            cov[24:, 24:],
            rows,
            residuals,
            (*recording.findings, *_doubts(found, recording)),
        )


def _require_positions(data: SectionMeans, name: str) -> None:
    """Every position must change its own axis most, and in the right direction."""
    half = (data.accel[0::2] - data.accel[1::2]) / 2  # (3, 3): one row an axis
    for k, axis in enumerate("xyz"):
        if int(np.argmax(np.abs(half[k]))) != k:
            other = "xyz"[int(np.argmax(np.abs(half[k])))]
            raise DataError(
                f"recording {name!r}: between {axis}_p and {axis}_a it is the {other} axis that changes most "
                f"({half[k].round(3).tolist()}); the sections are exchanged, or the axes of the recording are"
            )
        if half[k, k] * np.sign(np.trace(half)) < 0:
            raise DataError(
                f"recording {name!r}: {axis}_p and {axis}_a are exchanged: in {axis}_p the axis points up"
            )


def _doubts(found: Parameters, recording: ImuRecording) -> list[Finding]:
    """What a reader of the constants should know."""
    doubts = []
    reversed_axes = [axis for axis, gain in zip("xyz", np.diag(found.gyro_rotation), strict=True) if gain < 0]
    if reversed_axes:
        doubts.append(
            Finding(
                "warn",
                f"the calibrated gyro has the opposite sign of the raw one on {', '.join(reversed_axes)}",
                recording.name,
                "right if the turns were made in the direction of --turn; otherwise give --turn with the "
                "other sign",
            )
        )
    for what, rotation in (("accelerometer", found.accel_rotation), ("gyro", found.gyro_rotation)):
        apart = np.abs(rotation - np.diag(np.diag(rotation))).max()
        if apart > CROSS_AXIS:
            doubts.append(
                Finding(
                    "warn",
                    f"the {what}'s axes are {np.degrees(np.arcsin(min(1.0, apart))):.0f}° from the case's",
                    recording.name,
                    "a sensor is within a few degrees; hold each face flat on a level table",
                )
            )
    return doubts
