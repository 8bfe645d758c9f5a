"""What calibration finds: an affine map a sensor, and the bundle of an IMU, saved as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sequential.errors import DataError, FileFormatError, NotFiniteError, ShapeError
from sequential.noise import require_covariance
from sequential.readers.files import read_text, replacing
from sequential.sensors.recording import SI, ImuRecording

__all__ = ["KINDS", "SCHEMA", "SCHEMA_VERSION", "AffineCalibration", "ImuCalibration"]

Array = NDArray[np.float64]
KINDS = ("accel", "gyro", "mag")
SCHEMA, SCHEMA_VERSION = "factorlab-imu-calibration", 1
WORST_CONDITION = 1e9  # of a matrix that can still be turned round


@dataclass(frozen=True, slots=True, eq=False)
class AffineCalibration:
    """Raw readings of a three-axis sensor become calibrated ones: `matrix @ (raw - offset)`.

    Parameters
    ----------
    matrix : (3, 3) gains, misalignment and frame at once, unit_out per unit_in
    offset : (3,) reading where the quantity is zero, unit_in
    cov : (12, 12) covariance of the matrix, row by row, then the offset; None where it is unknown
    kind : "accel", "gyro" or "mag"
    unit_in, unit_out : for instance "counts" and "m/s^2", as a recording names them
    residual_rms : what the fit left over, in unit_out; None where nothing was left to look at
    source : the recording or the work that it comes from

    Raises
    ------
    ShapeError, NotFiniteError, NotPositiveDefiniteError, DataError
        DataError where the matrix cannot be inverted, or where the kind is unknown.
    """

    matrix: Array
    offset: Array
    cov: Array | None = None
    kind: str = "accel"
    unit_in: str = "m/s^2"
    unit_out: str = "m/s^2"
    residual_rms: float | None = None
    source: str = ""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise DataError(f"AffineCalibration.kind is {self.kind!r}; it is one of {', '.join(KINDS)}")
        for name, shape in (("matrix", (3, 3)), ("offset", (3,))):
            object.__setattr__(self, name, _sealed(getattr(self, name), shape, f"{self.kind}.{name}"))
        if not np.linalg.cond(self.matrix) < WORST_CONDITION:
            raise DataError(
                f"{self.kind}.matrix cannot be inverted: an axis of the sensor reads nothing of its own"
            )
        if self.cov is not None:
            where = f"{self.kind}.cov (matrix row by row, then offset)"
            object.__setattr__(self, "cov", require_covariance(self.cov, 12, where, definite=False))

    @classmethod
    def identity(cls, kind: str, unit: str) -> AffineCalibration:
        """Readings that are already in order."""
        return cls(np.eye(3), np.zeros(3), None, kind, unit, unit)

    def apply(self, raw: ArrayLike) -> Array:
        """Calibrated readings (..., 3) in unit_out from raw ones (..., 3) in unit_in."""
        calibrated: Array = (self._readings(raw) - self.offset) @ self.matrix.T
        return calibrated

    def raw(self, calibrated: ArrayLike) -> Array:
        """The way back: what the sensor would have read, (..., 3) in unit_in."""
        back: Array = self._readings(calibrated) @ np.linalg.inv(self.matrix).T + self.offset
        return back

    def _readings(self, given: ArrayLike) -> Array:
        own = np.asarray(given, dtype=np.float64)  # int16 counts must not wrap round
        if own.ndim == 0 or own.shape[-1] != 3:
            raise ShapeError(f"readings of the {self.kind} must have shape (..., 3), got {own.shape}")
        return own

    def with_counts(self, scale: float, unit: str = "counts") -> AffineCalibration:
        """The same calibration for readings before their nominal scale: raw = scale * counts.

        A driver reads counts, and a firmware wants one multiplication instead of two.
        """
        if not np.isfinite(scale) or scale <= 0:
            raise DataError(
                f"with_counts: a count is worth {scale} {self.unit_in}; it must be more than zero"
            )
        factors = np.r_[np.full(9, scale), np.full(3, 1 / scale)]
        cov = None if self.cov is None else self.cov * np.outer(factors, factors)
        return replace(self, matrix=self.matrix * scale, offset=self.offset / scale, cov=cov, unit_in=unit)

    def sigmas(self) -> tuple[Array, Array] | None:
        """Standard deviations of the matrix (3, 3) and the offset (3,), None without a covariance."""
        if self.cov is None:
            return None
        sigma = np.sqrt(np.clip(np.diag(self.cov), 0.0, None))
        return sigma[:9].reshape(3, 3), sigma[9:]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and strings, as they stand in the JSON file."""
        return {
            "kind": self.kind,
            "unit_in": self.unit_in,
            "unit_out": self.unit_out,
            "matrix": self.matrix.tolist(),
            "offset": self.offset.tolist(),
            "cov": None if self.cov is None else self.cov.tolist(),
            "residual_rms": self.residual_rms,
            "source": self.source,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> AffineCalibration:
        """Back from `to_dict`; whatever is missing or malformed is named."""
        try:
            rms, cov = values.get("residual_rms"), values.get("cov")
            return cls(
                np.asarray(values["matrix"], dtype=np.float64),
                np.asarray(values["offset"], dtype=np.float64),
                None if cov is None else np.asarray(cov, dtype=np.float64),
                str(values["kind"]),
                str(values["unit_in"]),
                str(values["unit_out"]),
                None if rms is None else float(rms),
                str(values.get("source", "")),
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise FileFormatError(
                f"a calibration needs kind, unit_in, unit_out, matrix (3, 3) and offset (3,): {error!r}"
            ) from error

    def to_json(self) -> str:
        """One JSON object."""
        return json.dumps(self.to_dict(), indent=1, allow_nan=False)

    @classmethod
    def from_json(cls, text: str) -> AffineCalibration:
        """Back from `to_json`."""
        return cls.from_dict(_parsed(text, "the calibration"))


@dataclass(frozen=True, slots=True, eq=False)
class ImuCalibration:
    """Calibrations of the sensors of one IMU, any of them absent; one JSON file.

    `g_sensitivity` (3, 3) is what the gyro reads of the calibrated specific force, in the gyro's raw unit per
    m/s²; it is taken off before the gyro is calibrated.  None where it is not known, or too small to be seen.
    """

    accel: AffineCalibration | None = None
    gyro: AffineCalibration | None = None
    mag: AffineCalibration | None = None
    g_sensitivity: Array | None = None

    def __post_init__(self) -> None:
        for kind in KINDS:
            one = getattr(self, kind)
            if one is not None and one.kind != kind:
                raise DataError(f"ImuCalibration.{kind} was given a calibration of kind {one.kind!r}")
        if self.g_sensitivity is not None:
            sealed = _sealed(self.g_sensitivity, (3, 3), "ImuCalibration.g_sensitivity")
            object.__setattr__(self, "g_sensitivity", sealed)

    @property
    def present(self) -> tuple[AffineCalibration, ...]:
        """Those that are there, accelerometer first."""
        return tuple(one for one in (self.accel, self.gyro, self.mag) if one is not None)

    def merged(self, other: ImuCalibration) -> ImuCalibration:
        """A bundle of these, with whatever `other` has taking the place of what is here."""
        felt = other.g_sensitivity if other.gyro is not None else self.g_sensitivity
        return ImuCalibration(other.accel or self.accel, other.gyro or self.gyro, other.mag or self.mag, felt)

    def apply(self, recording: ImuRecording) -> ImuRecording:
        """The recording with every sensor calibrated that has a calibration here.

        Raises
        ------
        DataError
            where the recording's unit is not the one that the calibration was made for.
        """
        changed: dict[str, Any] = {}
        for one in self.present:
            raw, unit = getattr(recording, one.kind), getattr(recording, f"{one.kind}_unit")
            if raw is None:
                continue
            if unit != one.unit_in:
                raise DataError(
                    f"the {one.kind} of recording {recording.name!r} is in {unit}, its calibration takes "
                    f"{one.unit_in}: read it as the calibration's recording was read, or use with_counts()"
                )
            known = one.unit_out == SI[one.kind]
            if one.kind == "gyro" and self.g_sensitivity is not None and self.accel and "accel" in changed:
                raw = raw - changed["accel"] @ self.g_sensitivity.T
            changed |= {one.kind: one.apply(raw), f"{one.kind}_unit": one.unit_out if known else unit}
        return replace(recording, **changed)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and strings with the version of the schema, as they stand in the JSON file."""
        head: dict[str, Any] = {"schema": SCHEMA, "version": SCHEMA_VERSION}
        body: dict[str, Any] = {one.kind: one.to_dict() for one in self.present}
        if self.g_sensitivity is not None:
            body["g_sensitivity"] = self.g_sensitivity.tolist()
        return head | {"equation": "calibrated = matrix @ (raw - offset)"} | body

    def to_json(self) -> str:
        """One JSON object."""
        return json.dumps(self.to_dict(), indent=1, allow_nan=False)

    @classmethod
    def from_json(cls, text: str, where: str = "the calibration") -> ImuCalibration:
        """Back from `to_json`.

        Raises
        ------
        FileFormatError
            where the text is no JSON, no calibration, or of a later version.
        """
        values = _parsed(text, where)
        if values.get("schema") != SCHEMA:
            raise FileFormatError(f'{where}: expected "schema": {SCHEMA!r}, got {values.get("schema")!r}')
        if values.get("version") != SCHEMA_VERSION:
            raise FileFormatError(
                f"{where}: schema version {values.get('version')!r}; this program reads {SCHEMA_VERSION}"
            )
        try:
            found = {kind: AffineCalibration.from_dict(values[kind]) for kind in KINDS if kind in values}
            felt = values.get("g_sensitivity")
            matrix = None if felt is None else np.asarray(felt, dtype=np.float64)
            return cls(found.get("accel"), found.get("gyro"), found.get("mag"), matrix)
        except (FileFormatError, TypeError, ValueError) as error:
            raise FileFormatError(f"{where}: {error}") from error

    def save(self, path: str | Path) -> Path:
        """Write the JSON file; returns its path."""
        with replacing(path) as file:
            file.write(self.to_json() + "\n")
        return Path(path)

    @classmethod
    def load(cls, path: str | Path) -> ImuCalibration:
        """Read what `save` wrote.

        Raises
        ------
        DataError, FileFormatError
            where there is no such file, or where it is something else.
        """
        return cls.from_json(read_text(path), str(path))


def _parsed(text: str, where: str) -> dict[str, Any]:
    try:
        values = json.loads(text)
    except ValueError as error:
        raise FileFormatError(f"{where} is not JSON: {error}") from error
    if not isinstance(values, dict):
        raise FileFormatError(f"{where}: expected one JSON object, got a {type(values).__name__}")
    return values


def _sealed(given: ArrayLike, shape: tuple[int, ...], where: str) -> Array:
    own = np.array(given, dtype=np.float64)
    if own.shape != shape:
        raise ShapeError(f"{where} must have shape {shape}, got {own.shape}")
    if not np.isfinite(own).all():
        raise NotFiniteError(f"{where} holds NaN or infinity")
    own.flags.writeable = False
    return own
