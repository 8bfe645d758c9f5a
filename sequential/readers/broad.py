"""BROAD, the benchmark of orientation estimators with optical truth (Laidig et al., Data 6(7):72, 2021)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FileFormatError
from sequential.log import frozen
from sequential.readers.files import require_file
from sequential.readers.npz import read_arrays
from sequential.sensors.finding import Finding
from sequential.sensors.gravity import STANDARD_GRAVITY
from sequential.sensors.recording import ImuRecording

__all__ = ["BroadTruth", "is_broad", "read_broad"]

Array = NDArray[np.float64]
PACKED = ("gyr", "acc", "mag", "quat", "movement", "rate")
ORIGINAL = ("imu_gyr", "imu_acc", "imu_mag", "opt_quat", "movement", "sampling_rate")


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


def is_broad(names: Mapping[str, Any]) -> bool:
    """Whether these are the arrays of a trial, packed or original."""
    return set(PACKED) <= set(names) or set(ORIGINAL) <= set(names)


def read_broad(path: str | os.PathLike[str]) -> tuple[ImuRecording, BroadTruth]:
    """Read a trial of BROAD: the original `.mat` or `.hdf5`, or integers of differences in a `.npz`.

    Accelerations are taken as g where their median length is about 1, as in the packed trials, and as m/s²
    where it is about 9.8; a finding of the recording says which.

    Raises
    ------
    DataError, FileFormatError
    """
    file = require_file(path)
    arrays = _arrays(file)
    if set(ORIGINAL) <= set(arrays):
        gyro, accel, mag = (_tall(arrays[name], 3) for name in ORIGINAL[:3])
        quaternion = _tall(arrays["opt_quat"], 4)
        movement = np.asarray(arrays["movement"]).ravel().astype(bool)
        rate = float(np.asarray(arrays["sampling_rate"]).ravel()[0])
    elif set(PACKED) <= set(arrays):
        gyro = np.deg2rad(_summed(arrays["gyr"]) * 1e-4)
        accel, mag = _summed(arrays["acc"]) * 1e-6, _summed(arrays["mag"]) * 1e-3
        quaternion = arrays["quat"].T.astype(np.float64)
        movement = np.unpackbits(arrays["movement"], count=len(gyro)).astype(bool)
        rate = float(arrays["rate"])
    else:
        wanted = PACKED if file.suffix.lower() == ".npz" else ORIGINAL
        raise FileFormatError(
            f"{file}: a trial of BROAD holds the arrays {', '.join(wanted)}; this one lacks "
            f"{', '.join(name for name in wanted if name not in arrays)}"
        )
    accel, said = _metric(accel)
    t = np.round(np.arange(len(gyro)) * (1e9 / rate)).astype(np.int64)
    return ImuRecording(t, accel, gyro, mag, name=file.stem, findings=said), _truth(quaternion, movement)


def _arrays(file: Path) -> dict[str, Any]:
    """The arrays of an NPZ, a MAT file or an HDF5 file, by name."""
    ending = file.suffix.lower()
    if ending == ".npz":
        return read_arrays(os.fspath(file))
    if ending == ".mat":
        import scipy.io

        try:
            return {k: v for k, v in scipy.io.loadmat(file).items() if not k.startswith("__")}
        except Exception as fault:  # noqa: BLE001 - a parser of binary files fails in many ways
            raise FileFormatError(
                f"{file} is not a MAT file that SciPy reads ({fault}); save it with -v7"
            ) from None
    try:
        import h5py
    except ImportError:
        raise DataError(
            f"{file} is HDF5, which needs h5py: pip install 'factorlab[hdf5]'; the .mat files hold the same"
        ) from None
    try:
        with h5py.File(file, "r") as opened:
            return {**{k: v[()] for k, v in opened.items() if hasattr(v, "shape")}, **dict(opened.attrs)}
    except Exception as fault:  # noqa: BLE001 - as above
        raise FileFormatError(f"{file} is not an HDF5 file that can be read ({fault})") from None


def _tall(values: Any, width: int) -> Array:
    """(N, width), whichever way round a file holds it."""
    array = np.asarray(values, dtype=np.float64)
    return array.T if array.shape[0] == width != array.shape[-1] else array


def _summed(differences: NDArray[np.int32]) -> Array:
    return np.cumsum(differences.astype(np.int64), axis=1).T.astype(np.float64)


def _metric(accel: Array) -> tuple[Array, tuple[Finding, ...]]:
    """Specific force in m/s², and a sentence where it was in g."""
    usual = float(np.median(np.linalg.norm(accel, axis=1)))
    if usual > 3.0:
        return accel, ()
    return accel * STANDARD_GRAVITY, (Finding("note", f"accelerations are in g (median length {usual:.3f})"),)


def _truth(quaternion: Array, movement: NDArray[np.bool_]) -> BroadTruth:
    length = np.linalg.norm(quaternion, axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        unit = quaternion / np.where(length > 0, length, np.nan)
    movement.flags.writeable = False
    return BroadTruth(frozen(unit), movement)
