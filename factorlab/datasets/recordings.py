"""Recordings of inertial sensors by name: `broad:07`, `mpu6050:imu_static_test`, or a path of one's own."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError
from sequential.readers import read_broad, read_imu, read_repoimu
from sequential.readers.broad import is_broad
from sequential.readers.imu.arrays import is_imu_tk_text
from sequential.readers.imu.euroc import euroc_truth
from sequential.sensors.recording import ImuRecording

__all__ = ["RECORDINGS", "OpenedRecording", "ReferenceAttitude", "open_recording"]

# What is known about the sets under FACTORLAB_DATA/imu, besides what their files say.
RECORDINGS = {
    "broad": "BROAD (Laidig et al. 2021, CC-BY-4.0): 9-axis at 286 Hz with optical truth",
    "imu_tk": "IMU-TK's Xsens, multi-position, raw counts",
    "imucal": "imucal's Ferraris sessions, 102.4 Hz",
    "mpu6050": "MPU-6050 counts at 100 Hz: still, multi-position, a 90° turn",
    "qmc5883l": "QMC5883L magnetometer turned by hand, counts at 50 Hz",
    "repoimu": "RepoIMU (Szczęsna et al. 2016): wand and pendulum with optical truth",
    "vqf": "the test recording of VQF, 47 s",
    "xio": "x-IMU3 moved by hand, 135 s",
}
RATES = {"imucal": 102.4}  # Hz, of files that state none
ENDINGS = {".csv", ".npz", ".mat", ".hdf5", ".ulg", ".zip", ".json"}


class ReferenceAttitude(NamedTuple):
    """What an instrument far better than the IMU saw.

    `world_q_body` (N, 4) is w x y z, world east-north-up (EuRoC's has z up and a heading of its own), NaN
    where nothing was seen; `movement` (N,) marks the samples that are scored.
    """

    world_q_body: NDArray[np.float64]
    movement: NDArray[np.bool_]


class OpenedRecording(NamedTuple):
    """A recording, the truth that came with it, and the file."""

    recording: ImuRecording
    truth: ReferenceAttitude | None
    path: Path


def open_recording(
    source: str | os.PathLike[str],
    *,
    kind: str | None = None,
    units: Mapping[str, str] | str | None = None,
    columns: Mapping[str, str] | Sequence[str] | str | None = None,
    rate: float | None = None,
) -> OpenedRecording:
    """Open a file, a folder, or a recording of a known set.

    Parameters
    ----------
    source : a path; or SET:PART, such as `broad:07`, where PART is the beginning of a file's name or a piece
        of it; or SET alone where it has one file.  Sets lie under FACTORLAB_DATA/imu
    kind, units, columns, rate : as `sequential.readers.read_imu` takes them

    Raises
    ------
    DataError
        naming the nearest set or file.
    """
    path, stated = Path(source), rate
    if not path.exists():
        path, stated = _of_a_set(os.fspath(source), rate)
    if kind is None and units is None and columns is None:
        if _is_broad(path):
            recording, seen = read_broad(path)
            return OpenedRecording(recording, ReferenceAttitude(seen.world_q_body, seen.movement), path)
        if _is_repoimu(path):
            recording, vicon = read_repoimu(path)
            everywhere = np.ones(len(recording), dtype=bool)
            return OpenedRecording(recording, ReferenceAttitude(vicon, everywhere), path)
    recording = read_imu(path, kind=kind, units=units, columns=columns, rate=stated)
    world_q_body = euroc_truth(path, recording.t) if path.is_dir() else None
    if world_q_body is None:
        return OpenedRecording(recording, None, path)
    known = np.isfinite(world_q_body[:, 0])
    return OpenedRecording(recording, ReferenceAttitude(world_q_body, known), path)


def _of_a_set(source: str, rate: float | None) -> tuple[Path, float | None]:
    """The file that SET:PART names, and the rate of its set where its files state none."""
    name, _, part = source.partition(":")
    if name not in RECORDINGS:
        near = get_close_matches(name, RECORDINGS, n=1, cutoff=0.6)
        beside = Path(source).parent
        files = [str(beside / p.name) for p in beside.iterdir()] if beside.is_dir() else []
        near = near or get_close_matches(source, files, n=1, cutoff=0.6)
        hint = f"did you mean {near[0]!r}?" if near else f"the sets are {', '.join(RECORDINGS)}"
        msg = f"{source!r} is neither a file nor a recording of a known set, such as broad:07; {hint}"
        raise DataError(msg)
    folder = Path(os.environ.get("FACTORLAB_DATA") or "FACTORLAB_DATA") / "imu" / name
    files_of = sorted(p for p in folder.rglob("*") if p.suffix in ENDINGS and p.stem != "trials")
    if not files_of:
        what = f"{folder} has no recording of {RECORDINGS[name]}"
        msg = f"{what}; set FACTORLAB_DATA to the folder that holds imu/{name}"
        raise DataError(msg)
    found = [p for p in files_of if p.stem.lower() == part.lower()]
    found = found or [p for p in files_of if p.stem.lower().startswith(part.lower())]
    found = found or [p for p in files_of if part.lower() in p.stem.lower()]
    if len(found) != 1:
        many = f"{len(found)} recordings" if found else "no recording"
        names = ", ".join(f"{name}:{p.stem}" for p in found or files_of)
        msg = f"{source!r} names {many} of {name}; it has {names}"
        raise DataError(msg)
    return found[0], rate or RATES.get(name)


def _is_broad(path: Path) -> bool:
    """Whether a file holds a trial of BROAD, packed or original."""
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as archive:
            return is_broad(dict.fromkeys(archive.files))
    return path.suffix in {".mat", ".hdf5", ".h5"} and path.is_file() and not is_imu_tk_text(path)


def _is_repoimu(path: Path) -> bool:
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    with path.open("rb") as file:
        return b"Vicon Orientation" in file.readline(500)
