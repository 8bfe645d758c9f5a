"""Magnetometer readings ready for a fit: missing, repeated and clipped ones left out, the noise found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.sensors.finding import Finding
from sequential.sensors.recording import ImuRecording

__all__ = ["FieldReadings", "difference_noise", "readings_of"]

Array = NDArray[np.float64]
FEWEST = 50
TO_SIGMA = 1.482602218505602  # of a median absolute deviation
CLIPPED_FEWEST, CLIPPED_MOST = 8, 0.2  # samples at one end; share that cannot be left out any more
DIFFERENCE = 20.0  # variance of a third difference over that of a sample: 1 + 9 + 9 + 1


@dataclass(frozen=True, slots=True, eq=False)
class FieldReadings:
    """Points (N, 3) of a recording, the rows (N,) they come from, the covariance of their noise (3, 3)."""

    points: Array
    rows: NDArray[np.int64]
    noise_cov: Array
    findings: tuple[Finding, ...]


def difference_noise(points: Array) -> Array:
    """(3,) standard deviation of the noise of a reading, from third differences of consecutive ones.

    A turn is smooth over four samples, noise is not.  The median makes quick turns and outliers harmless; it
    is too large where all of a recording turns by more than some 20° a sample.
    """
    third = np.abs(np.diff(points, 3, axis=0)) / np.sqrt(DIFFERENCE)
    middle = TO_SIGMA * np.median(third, axis=0)
    coarse = np.sqrt(np.pi / 2) * third.mean(axis=0)  # where a coarse converter leaves most differences zero
    return np.asarray(np.where(middle > 0, middle, coarse))


def readings_of(recording: ImuRecording, noise: float | None = None) -> FieldReadings:
    """Readings that a fit may use.

    Raises
    ------
    MissingStreamError, DataError
        where there is no magnetometer, or a constant axis, or too little left.
    """
    recording.require("mag", si=False)
    assert recording.mag is not None  # noqa: S101 - require() has looked
    rows = np.flatnonzero(np.isfinite(recording.mag).all(axis=1))
    fresh = np.ones(len(rows), dtype=bool)
    fresh[1:] = (np.diff(recording.mag[rows], axis=0) != 0).any(axis=1)
    rows = rows[fresh] if len(rows) else rows
    points = recording.mag[rows]
    _require_alive(points, recording)
    clipped, findings = _clipped(points, recording)
    rows, points = rows[~clipped], points[~clipped]
    if len(rows) < FEWEST:
        raise DataError(
            f"recording {recording.name!r} has {len(rows)} magnetometer readings of use; an ellipsoid needs "
            f"{FEWEST} at least, in every direction: turn the sensor for half a minute"
        )
    sigma = difference_noise(points) if noise is None else np.full(3, float(noise))
    return FieldReadings(points, rows, np.diag(sigma**2), findings)


def _require_alive(points: Array, recording: ImuRecording) -> None:
    stuck = (
        list("xyz")
        if len(points) < 2
        else [axis for axis, width in zip("xyz", np.ptp(points, axis=0), strict=True) if not width > 0]
    )
    if stuck:
        raise DataError(
            f"recording {recording.name!r}: magnetometer axis {', '.join(stuck)} is constant over all "
            f"{len(recording)} samples; the sensor is absent, not started, or stuck"
        )


def _clipped(points: Array, recording: ImuRecording) -> tuple[NDArray[np.bool_], tuple[Finding, ...]]:
    """Readings at the end of the sensor's range: many times the same extreme value, and few just below."""
    bad = np.zeros(len(points), dtype=bool)
    where = []
    for k, axis in enumerate("xyz"):
        values = points[:, k]
        for end, word in ((values.max(), "top"), (values.min(), "bottom")):
            at_end = values == end
            near = (np.abs(values - end) < 0.02 * np.ptp(values)) & ~at_end
            if at_end.sum() >= max(CLIPPED_FEWEST, 0.002 * len(values)) and at_end.sum() > near.sum():
                bad |= at_end
                where.append(f"{axis} at its {word}, {end:g} {recording.mag_unit}")
    if not where:
        return bad, ()
    share = float(bad.mean())
    if share > CLIPPED_MOST:
        raise DataError(
            f"recording {recording.name!r}: {100 * share:.0f} % of the magnetometer's readings are saturated "
            f"({'; '.join(where)}); choose a larger range, or take the magnet away"
        )
    return bad, (
        Finding(
            "warn",
            f"{int(bad.sum())} saturated readings left out ({'; '.join(where)})",
            f"{100 * share:.1f} % of the recording",
            "choose a larger range of the sensor",
        ),
    )
