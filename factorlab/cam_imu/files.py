"""Files that say how a camera and an IMU are mounted: Kalibr's camchain-imucam, and our own JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.marker_map.extrinsics import read_extrinsics
from sequential.errors import FileFormatError
from sequential.readers.files import read_text
from vision3d.camera_files.numbers import row
from vision3d.rigid import inverse

__all__ = ["Mounting", "read_mounting"]

Array = NDArray[np.float64]
OWN_NAMES = ("calibration.json", "report.json")


@dataclass(frozen=True, eq=False)
class Mounting:
    """How an IMU is mounted to a camera.

    Parameters
    ----------
    camera_T_imu : (7,) qw qx qy qz px py pz: Kalibr's T_cam_imu
    time_offset_s : added to a camera's stamp it gives the IMU's: Kalibr's timeshift_cam_imu; 0 where unsaid
    cov : (7, 7) of rotation, translation (right chart of camera_T_imu) and offset; None where unsaid
    """

    camera_T_imu: Array
    time_offset_s: float
    cov: Array | None = None


def read_mounting(path: str | Path, which: str | None = None) -> Mounting:
    """Read Kalibr's camchain-imucam.yaml, or calibration.json or report.json of `calibrate cam-imu`.

    Parameters
    ----------
    path : of the file, or of the folder that the command wrote
    which : camera of a chain, where it has several

    Raises
    ------
    DataError, FileFormatError
        where it does not say how the IMU is mounted.
    """
    file = Path(path)
    if file.is_dir():
        file = next((file / name for name in OWN_NAMES if (file / name).is_file()), file / OWN_NAMES[0])
    if file.suffix == ".json":
        return _own(file, read_text(file))
    found = read_extrinsics(file, which)
    return Mounting(inverse(found.body_T_camera), found.offset_s)


def _own(file: Path, text: str) -> Mounting:
    try:
        document = json.loads(text)
        pose = document["camera_T_imu"]
        values = row(pose["qw_qx_qy_qz_px_py_pz"], 7, "camera_T_imu", str(file))
        cov = np.zeros((7, 7))
        cov[:6, :6] = pose["cov"]
        cov[6, 6] = float(document["time_offset_std_s"]) ** 2
        offset = float(document["time_offset_s"])
    except (json.JSONDecodeError, KeyError, TypeError, ValueError) as fault:
        raise FileFormatError(
            f"{file} is no calibration of a camera and an IMU ({type(fault).__name__}: {fault}); give "
            "calibration.json of factorlab calibrate cam-imu, or Kalibr's camchain-imucam.yaml"
        ) from None
    return Mounting(_pose(file, np.array(values)), offset, cov)


def _pose(file: Path, values: Array) -> Array:
    """Finite, with a unit quaternion."""
    norm = float(np.linalg.norm(values[:4]))
    if not np.isfinite(values).all() or abs(norm - 1.0) > 1e-3:
        raise FileFormatError(f"{file}: camera_T_imu holds no rotation, or numbers that are not finite")
    values[:4] /= norm
    values.flags.writeable = False
    return values
