"""Where the camera sits on the IMU, from the files of those who calibrate it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FileFormatError
from sequential.manifold import quaternion_from_matrix
from vision3d.rigid import inverse

__all__ = ["Extrinsics", "read_extrinsics"]

Array = NDArray[np.float64]
ORTHONORMAL = 1e-4


@dataclass(frozen=True, eq=False)
class Extrinsics:
    """`body_T_camera` (7,), body being the IMU's axes, and by what its clock is ahead of the camera's, s."""

    body_T_camera: Array
    offset_s: float = 0.0


def read_extrinsics(path: str | os.PathLike[str], which: str | None = None) -> Extrinsics:
    """Read `T_cam_imu` and `timeshift_cam_imu` of a camera from Kalibr's camchain-imucam, or a file alike.

    Parameters
    ----------
    which : name of the camera (`cam0`), where there are several

    Raises
    ------
    DataError
        where there is no such file or camera.
    FileFormatError
        where it holds no T_cam_imu, or one that is no pose.
    """
    import yaml

    where = Path(path)
    if not where.is_file():
        raise DataError(f"there is no file {where}; it is the camchain-imucam.yaml of camera and IMU")
    try:
        document = yaml.safe_load(where.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as fault:
        raise FileFormatError(f"{where} is not YAML: {' '.join(str(fault).split())}") from None
    entries = _entries(document)
    if not entries:
        raise FileFormatError(
            f"{where} holds no T_cam_imu; Kalibr writes it for each camera into camchain-imucam.yaml"
        )
    if which is None and len(entries) > 1:
        raise DataError(f"{where} holds several cameras; choose one of {', '.join(entries)} with --which")
    name = next(iter(entries)) if which is None else which
    if name not in entries:
        raise DataError(f"{where} has no camera {name!r} with a T_cam_imu; it holds {', '.join(entries)}")
    entry = entries[name]
    try:
        offset = float(entry.get("timeshift_cam_imu", 0.0))
    except (TypeError, ValueError):
        raise FileFormatError(f"{where}: timeshift_cam_imu is no number of seconds") from None
    return Extrinsics(inverse(_pose(entry["T_cam_imu"], f"{where}, {name}")), offset)


def _entries(document: Any) -> dict[str, dict[str, Any]]:
    """Cameras with a mount, by name; a file may hold the entries of one camera alone."""
    if not isinstance(document, dict):
        return {}
    if "T_cam_imu" in document:
        return {"cam0": document}
    return {
        str(name): entry
        for name, entry in document.items()
        if isinstance(entry, dict) and "T_cam_imu" in entry
    }


def _pose(rows: Any, place: str) -> Array:
    """camera_T_imu (7,) of a matrix (4, 4)."""
    try:
        matrix = np.array(rows, dtype=np.float64).reshape(4, 4)
    except (TypeError, ValueError):
        raise FileFormatError(f"{place}: T_cam_imu is four rows of four numbers") from None
    R = matrix[:3, :3]
    if (
        not np.isfinite(matrix).all()
        or np.abs(R @ R.T - np.eye(3)).max() > ORTHONORMAL
        or np.linalg.det(R) < 0
    ):
        raise FileFormatError(f"{place}: the rotation of T_cam_imu is not one: its rows are no unit axes")
    return np.concatenate([quaternion_from_matrix(R), matrix[:3, 3]])
