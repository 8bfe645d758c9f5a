"""BROAD, the benchmark of orientation estimators with optical truth (Laidig et al., Data 6(7):72, 2021)."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError
from sequential.log import frozen
from sequential.readers.files import require_file
from sequential.readers.npz import read_arrays
from sequential.sensors.finding import Finding
from sequential.sensors.recording import ImuRecording

__all__ = ["BroadTruth", "read_broad"]

Array = NDArray[np.float64]
PACKED = ("gyr", "acc", "mag", "quat", "movement", "rate")
GRAVITY = 9.80665  # m/s² in one g


@dataclass(frozen=True, slots=True, eq=False)
class BroadTruth:
    """What the cameras saw, sample by sample.

    Parameters
    ----------
    world_q_body : (N, 4) w x y z, unit, world east-north-up; rows of NaN where the markers were not seen
    movement : (N,) the sensor was being moved: the samples that the benchmark scores
    """

    world_q_body: Array
    movement: NDArray[np.bool_]


def read_broad(path: str | os.PathLike[str]) -> tuple[ImuRecording, BroadTruth]:
    """Read a trial of BROAD: integers of differences in a `.npz`.

    Accelerations are taken as g where their median length is about 1, as in the packed trials, and as m/s²
    where it is about 9.8; a finding of the recording says which.

    Raises
    ------
    DataError, FileFormatError
    """
    file = require_file(path)
    arrays = read_arrays(os.fspath(file))
    if missing := [name for name in PACKED if name not in arrays]:
        raise FileFormatError(
            f"{file}: a packed trial of BROAD holds the arrays {', '.join(PACKED)}; this one lacks "
            f"{', '.join(missing)}"
        )
    gyro = np.deg2rad(_summed(arrays["gyr"]) * 1e-4)
    accel, said = _metric(_summed(arrays["acc"]) * 1e-6)
    mag = _summed(arrays["mag"]) * 1e-3
    count = len(gyro)
    t = np.round(np.arange(count) * (1e9 / float(arrays["rate"]))).astype(np.int64)
    movement = np.unpackbits(arrays["movement"], count=count).astype(bool)
    recording = ImuRecording(t, accel, gyro, mag, name=file.stem, findings=said)
    return recording, _truth(arrays["quat"].T.astype(np.float64), movement)


def _summed(differences: NDArray[np.int32]) -> Array:
    return np.cumsum(differences.astype(np.int64), axis=1).T.astype(np.float64)


def _metric(accel: Array) -> tuple[Array, tuple[Finding, ...]]:
    """Specific force in m/s², and a sentence where it was in g."""
    usual = float(np.median(np.linalg.norm(accel, axis=1)))
    if usual > 3.0:
        return accel, ()
    return accel * GRAVITY, (Finding("note", f"accelerations are in g (median length {usual:.3f})"),)


def _truth(quaternion: Array, movement: NDArray[np.bool_]) -> BroadTruth:
    length = np.linalg.norm(quaternion, axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        unit = quaternion / np.where(length > 0, length, np.nan)
    movement.flags.writeable = False
    return BroadTruth(frozen(unit), movement)
