"""A pair of ROS camera_info files: the pose of the cameras is in their rectifications and projections."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sequential.errors import DataError, FactorlabError, FileFormatError
from vision3d.camera_files.numbers import row
from vision3d.camera_files.ros import block_of, ros_cameras, ros_text
from vision3d.stereo.rectification import rectify
from vision3d.stereo.rig import StereoRig

__all__ = ["ros_rig", "ros_rig_texts"]

OTHERS = (("left", "right"), ("cam0", "cam1"), ("camera0", "camera1"))


def ros_rig(path: Path, size: tuple[int, int] | None = None) -> StereoRig:
    """The rig of the file of one camera and of that of the other, which lies beside it.

    Raises
    ------
    DataError
        where the other file is not there.
    FileFormatError
        where one of them is damaged, or they say nothing of the cameras' pose.

    Notes
    -----
    X_rectified = R1 X_left = R2 X_right - (B, 0, 0), and P2[0, 3] = -f B.
    """
    first, second = _both(path)
    left, right = (_read(one, size) for one in (first, second))
    (camera, R1, _), (other, R2, P2) = left, right
    shift = P2[:, 3] / P2[0, 0]
    if not shift.any():
        raise FileFormatError(
            f"{second} does not say where its camera is to the other: its projection_matrix has no baseline; "
            "the cameras were calibrated apart"
        )
    try:
        return StereoRig.from_opencv(camera, other, R2.T @ R1, R2.T @ shift)
    except FactorlabError as error:
        raise FileFormatError(f"{second}: {error}") from error


def ros_rig_texts(rig: StereoRig) -> dict[str, str]:
    """Names and texts of both files.

    Raises
    ------
    ModelError
        for a lens that ROS has no name for.
    """
    pair = rectify(rig, size=rig.left.size)
    P1, P2 = pair.projections
    return {
        "left.yaml": ros_text(rig.left, "left", (pair.left_R_rectified.T, P1)),
        "right.yaml": ros_text(rig.right, "right", (pair.right_R_rectified.T, P2)),
    }


def _both(path: Path) -> tuple[Path, Path]:
    for left, right in OTHERS:
        for part, wanted, is_left in ((left, right, True), (right, left, False)):
            if part in path.name:
                other = path.with_name(path.name.replace(part, wanted))
                if not other.is_file():
                    raise DataError(
                        f"{path} is the camera_info of one camera; the other one's, {other.name}, is not "
                        "beside it"
                    )
                return (path, other) if is_left else (other, path)
    raise DataError(
        f"{path} is the camera_info of one camera; call the two files left.yaml and right.yaml, and put them "
        "into one folder"
    )


def _read(path: Path, size: tuple[int, int] | None) -> tuple[Any, Any, Any]:
    text, where = path.read_text(encoding="utf-8-sig"), str(path)
    try:
        document = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise FileFormatError(f"{where} is no camera file, or damaged") from error
    if not isinstance(document, dict):
        raise FileFormatError(f"{where} is no camera_info of ROS")
    camera = next(iter(ros_cameras(document, text, where, size).values()))
    R = np.array(row(block_of(document, "rectification_matrix", where), 9, "rectification_matrix", where))
    P = np.array(row(block_of(document, "projection_matrix", where), 12, "projection_matrix", where))
    if not P[0] > 0.0:
        raise FileFormatError(f"{where}: its projection_matrix has no focal length")
    return camera, R.reshape(3, 3), P.reshape(3, 4)
