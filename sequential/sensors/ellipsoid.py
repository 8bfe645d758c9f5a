"""Magnetometer calibration: hard and soft iron from turns in every direction, or in a plane."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, UnderConstrainedError
from sequential.sensors.calibration import AffineCalibration
from sequential.sensors.direction_cells import CellMeans, cell_means
from sequential.sensors.ellipsoid_findings import doubts_of, weakest
from sequential.sensors.ellipsoid_fit import EllipsoidFit, excess, fit_ellipsoid, symmetric_index
from sequential.sensors.field_readings import FieldReadings, readings_of
from sequential.sensors.finding import Finding
from sequential.sensors.recording import ImuRecording

__all__ = ["FieldCheck", "MagnetometerEllipsoid", "MagnetometerFit"]

Array = NDArray[np.float64]
FLAT, NEARLY_FLAT = 0.05, 0.25  # thickness of the readings over their width: a planar turn, perhaps one
RADIUS_KNOWN = 0.03  # relative standard deviation of a radius that is observed
SEEN = 2.5  # spread along the thinnest direction over the noise of a reading
PLANAR_SECTORS, RIM = 8, 0.1  # of 12; scatter of the radius that is still a rim and no disc
EXACT = 1e-6  # scatter of a norm without any noise
NOISE_ROUNDS, NOISE_FITS = 2, 0.9  # more fits; scatter over noise under which the noise was overrated
UNMEASURED = 0.3  # relative, of a gain that a planar turn says nothing about


@dataclass(frozen=True, slots=True, eq=False)
class FieldCheck:
    """How constant the norm of a recording is.

    Parameters
    ----------
    raw, calibrated : means of the norm over 24 cells of direction, before and after, mean excess by noise off
    raw_scatter, scatter : standard deviation over mean of the norm of single readings
    noise_share : what the noise of a reading alone would make of `scatter`
    norms : (N,) calibrated norms over the field, mean excess by noise taken off
    vectors : (N, 3) calibrated readings
    """

    raw: CellMeans
    calibrated: CellMeans
    raw_scatter: float
    scatter: float
    noise_share: float
    norms: Array
    vectors: Array

    @property
    def cell_noise(self) -> float:
        """What the noise of readings alone would make of the spread over the cells."""
        filled = np.isfinite(self.calibrated.mean)
        return float(self.noise_share * np.sqrt(np.mean(1 / self.calibrated.count[filled])))


@dataclass(frozen=True, slots=True, eq=False)
class MagnetometerFit:
    """A calibrated magnetometer.

    Parameters
    ----------
    calibration : symmetric matrix (soft iron is known up to a rotation from norms alone), offset (hard iron)
    field : norm of a calibrated reading, in the calibration's unit_out
    readings : points of the fit, and the covariance of their noise
    outliers : (N,) points without weight
    radii, radii_sigma : semi-axes of the ellipsoid in the raw unit, smallest first; two for a planar turn
    normal : (3,) of the plane of a planar turn, None for turns in space
    fit : the ellipsoid in its own two or three dimensions
    check : how constant the norm is on the recording itself
    """

    calibration: AffineCalibration
    field: float
    readings: FieldReadings
    outliers: NDArray[np.bool_]
    radii: Array
    radii_sigma: Array
    normal: Array | None
    fit: EllipsoidFit
    check: FieldCheck
    findings: tuple[Finding, ...]

    @property
    def planar(self) -> bool:
        """Whether only two dimensions could be calibrated."""
        return self.normal is not None

    def verify(self, recording: ImuRecording) -> FieldCheck:
        """How constant the norm of another recording of the same sensor is.

        Raises
        ------
        MissingStreamError, DataError
        """
        if recording.mag_unit != self.calibration.unit_in:
            raise DataError(
                f"recording {recording.name!r} is in {recording.mag_unit}, the calibration takes "
                f"{self.calibration.unit_in}; read both in the same way"
            )
        return check_field(self.calibration, self.field, readings_of(recording), self.normal)


@dataclass(frozen=True, slots=True)
class MagnetometerEllipsoid:
    """Settings of the fit.

    Parameters
    ----------
    field : norm that a calibrated reading is to have, µT (the local field: 25 to 65); None keeps the raw
        unit, with gains whose geometric mean is one
    noise : standard deviation of a reading in the raw unit; None: from third differences of the recording
    planar : True for a robot that only turns on the floor, False for turns in space; None: the readings
        decide
    sphere : take all gains to be equal and find the hard iron alone, where directions are too few for more
    """

    field: float | None = None
    noise: float | None = None
    planar: bool | None = None
    sphere: bool = False

    def __post_init__(self) -> None:
        for name in ("field", "noise"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise DataError(f"MagnetometerEllipsoid.{name} is {value}; expected more than zero, or None")

    def calibrate(self, recording: ImuRecording, rng: np.random.Generator | None = None) -> MagnetometerFit:
        """Fit the readings of a recording; `rng` draws subsets in the search for a start (seed 0 if None).

        Raises
        ------
        MissingStreamError, DataError, UnderConstrainedError, NotConvergedError
            UnderConstrainedError where the directions leave a gain free, naming the direction.
        """
        readings = readings_of(recording, self.noise)
        rng = np.random.default_rng(0) if rng is None else rng
        fit, basis = self._fitted(recording, readings, rng)
        for _ in range(NOISE_ROUNDS if self.noise is None else 0):
            ratio = fit.sigma / max(fit.expected, 1e-12)
            if ratio > NOISE_FITS or fit.sigma < EXACT:
                break
            # outliers and quick turns look like noise in differences: no norm scatters less than its noise
            readings = replace(readings, noise_cov=readings.noise_cov * ratio**2)
            fit, basis = self._fitted(recording, readings, rng)
        return self._finished(recording, readings, fit, basis)

    def _fitted(
        self, recording: ImuRecording, readings: FieldReadings, rng: np.random.Generator
    ) -> tuple[EllipsoidFit, Array]:
        """The ellipsoid, and the axes (3, d) that it lies in."""
        plane, thickness = _plane(readings)
        fit, basis = None, np.eye(3)
        if self.planar is not True and thickness > FLAT and _above_noise(readings):
            fit = fit_ellipsoid(readings.points, readings.noise_cov, rng, sphere=self.sphere)
        if self.planar is not False and not _observed(fit) and (thickness < NEARLY_FLAT or self.planar):
            basis = plane[:2].T
            flat_noise = basis.T @ readings.noise_cov @ basis
            fit = fit_ellipsoid(readings.points @ basis, flat_noise, rng, sphere=self.sphere)
            fit = fit if fit is not None and _goes_round(readings.points @ basis, fit) else None
        if fit is None or not _observed(fit):
            raise UnderConstrainedError(weakest(readings.points, fit, basis, recording.name))
        return fit, basis

    def _finished(
        self, recording: ImuRecording, readings: FieldReadings, fit: EllipsoidFit, basis: Array
    ) -> MagnetometerFit:
        dim = len(fit.centre)
        radius = float(np.linalg.det(fit.root) ** (-1 / dim))
        field = radius if self.field is None else float(self.field)
        normal = np.cross(basis[:, 0], basis[:, 1]) if dim == 2 else None
        matrix, offset, cov = _embedded(fit, basis, normal, field, readings.points)
        unit = recording.mag_unit if self.field is None else "uT"
        residual = float(np.sqrt(np.mean(fit.residuals[fit.weights > 0] ** 2)) * field)
        calibration = AffineCalibration(
            matrix, offset, cov, "mag", recording.mag_unit, unit, residual, recording.name
        )
        check = check_field(calibration, field, readings, normal)
        radii, sigmas = _radii(fit)
        doubts = doubts_of(fit, radii, check.calibrated, normal, recording, sphere=self.sphere)
        return MagnetometerFit(
            calibration,
            field,
            readings,
            fit.weights == 0,
            radii,
            sigmas,
            normal,
            fit,
            check,
            (*recording.findings, *readings.findings, *doubts),
        )


def _plane(readings: FieldReadings) -> tuple[Array, float]:
    """Principal axes (3, 3) as rows, widest first, and the thickness of the points over their width."""
    centred = readings.points - np.median(readings.points, axis=0)
    values, vectors = np.linalg.eigh(centred.T @ centred / len(centred) - readings.noise_cov)
    axes = vectors.T[::-1].copy()
    if np.abs(axes[2]).max() > 0.9:  # sensor axes stay in their own order where the plane is one of theirs
        k = int(np.argmax(np.abs(axes[2])))
        normal = axes[2] * np.sign(axes[2, k])
        first = np.eye(3)[(k + 1) % 3]
        first = first - (first @ normal) * normal
        first /= np.linalg.norm(first)
        axes = np.array([first, np.cross(normal, first), normal])
    return axes, float(np.sqrt(max(values[0], 0.0) / max(values[-1], 1e-300)))


def _above_noise(readings: FieldReadings) -> bool:
    """Whether the readings differ by more than noise along every direction, or no curvature can be seen."""
    cov = np.cov(readings.points.T) - readings.noise_cov
    values, vectors = np.linalg.eigh(cov)
    noise = np.einsum("ik,ij,jk->k", vectors, readings.noise_cov, vectors)
    return bool((values > SEEN**2 * noise).all())


def _radii(fit: EllipsoidFit) -> tuple[Array, Array]:
    values, vectors = np.linalg.eigh(fit.root)
    index = symmetric_index(len(values))
    sigmas = []
    for vector in vectors.T:
        slope = np.array([vector[i] * vector[j] * (1 if i == j else 2) for i, j in index])
        sigmas.append(np.sqrt(max(0.0, slope @ fit.cov[: len(index), : len(index)] @ slope)))
    return 1 / values[::-1], (np.array(sigmas) / values**2)[::-1]


def _observed(fit: EllipsoidFit | None) -> bool:
    if fit is None:
        return False
    radii, sigmas = _radii(fit)
    return bool((sigmas < RADIUS_KNOWN * radii).all())


def _goes_round(points: Array, fit: EllipsoidFit) -> bool:
    """Whether a planar turn comes through eight twelfths of the circle at least, and stays on its rim."""
    x, y = ((points - fit.centre) @ fit.root).T
    sectors = np.bincount(np.int64((np.arctan2(y, x) / np.pi + 1) * 5.999999), minlength=12)
    return int((sectors >= 3).sum()) >= PLANAR_SECTORS and fit.sigma < max(RIM, 2 * fit.expected)


def _embedded(
    fit: EllipsoidFit, basis: Array, normal: Array | None, field: float, points: Array
) -> tuple[Array, Array, Array]:
    """Matrix, offset and covariance (12, 12) in space; along the normal of a plane a gain is assumed."""
    index = symmetric_index(len(fit.centre))
    units = []
    for i, j in index:
        unit = np.outer(basis[:, i], basis[:, j])
        units.append((unit if i == j else unit + unit.T).ravel() * field)
    spread = np.zeros((12, len(index) + len(fit.centre)))
    spread[:9, : len(index)] = np.array(units).T
    spread[9:, len(index) :] = basis
    cov = spread @ fit.cov @ spread.T
    matrix, offset = field * basis @ fit.root @ basis.T, basis @ fit.centre
    if normal is not None:
        gain = np.trace(fit.root) / 2
        matrix = matrix + field * gain * np.outer(normal, normal)
        offset = offset + normal * float(np.median(points @ normal))
        free = np.outer(normal, normal).ravel() * field * gain * UNMEASURED
        cov[:9, :9] += np.outer(free, free)
        cov[9:, 9:] += np.outer(normal, normal) / gain**2  # somewhere within the field's strength
    return matrix, offset, (cov + cov.T) / 2


def check_field(
    calibration: AffineCalibration, field: float, readings: FieldReadings, normal: Array | None = None
) -> FieldCheck:
    """Norm of calibrated readings over 24 cells of direction; of their part in the plane with a normal."""
    vectors = calibration.apply(readings.points) / field
    keep = np.eye(3) if normal is None else np.eye(3) - np.outer(normal, normal)
    flat = vectors @ keep
    matrix = keep @ calibration.matrix / field
    noise = matrix @ readings.noise_cov @ matrix.T
    too_long, along = excess(flat, noise)
    norms = np.linalg.norm(flat, axis=1) - too_long
    raw = np.linalg.norm(readings.points @ keep, axis=1)
    raw_norms = raw - excess(readings.points @ keep, keep @ readings.noise_cov @ keep)[0]
    return FieldCheck(
        cell_means(flat, raw_norms),
        cell_means(flat, norms),
        float(raw.std() / raw.mean()),
        float(norms.std() / norms.mean()),
        float(np.sqrt(along.mean())),
        norms,
        vectors,
    )
