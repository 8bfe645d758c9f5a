"""Rigs as OpenCV's `stereo_calib` writes them: M1 D1 M2 D2 and R T, in one file or in two."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FactorlabError, FileFormatError
from vision3d.camera_files.numbers import LENS_COMMENT
from vision3d.camera_files.opencv_files import opencv_cameras, storage_matrix
from vision3d.camera_files.opencv_storage import storage_content
from vision3d.stereo.rectification import rectify
from vision3d.stereo.rig import StereoRig

__all__ = ["opencv_rig", "opencv_rig_text"]

POSES = (("R", "T"), ("rotation", "translation"), ("Rot", "Trans"), ("R_stereo", "T_stereo"))
"""Rotation and translation, as they are called in files."""
PARTS = {
    "extrinsics": "intrinsics",
    "extrinsic": "intrinsic",
    "intrinsics": "extrinsics",
    "intrinsic": "extrinsic",
}
"""What the other file is called, where the cameras stand in one and their pose in another."""


def opencv_rig(text: str, path: Path, size: tuple[int, int] | None = None, unit_m: float = 1.0) -> StereoRig:
    """The rig of a file, and of the file beside it where the cameras are in one and their pose in another.

    Parameters
    ----------
    text : of the file
    path : of the file
    size : (width, height) of the images, where it does not say it: `stereo_calib` does not
    unit_m : length of the unit of the translation, m

    Raises
    ------
    FileFormatError
        where cameras or pose are missing.
    """
    content = storage_content(text, str(path))
    pose = _pose(content)
    other = _other(path)
    if pose is None and other is not None:
        pose = _pose(storage_content(other.read_text(encoding="utf-8-sig"), str(other)))
    cameras = _cameras(text, str(path), size)
    if set(cameras) != {"left", "right"} and other is not None:
        cameras = _cameras(other.read_text(encoding="utf-8-sig"), str(other), size)
    if set(cameras) != {"left", "right"}:
        beside = f"; is its {PARTS.get(path.stem, 'intrinsics')}.yml beside it?" if pose is not None else ""
        raise FileFormatError(f"{path} holds no two cameras (M1 D1 M2 D2){beside}")
    if pose is None:
        beside = f", and {other} neither" if other is not None else ""
        raise FileFormatError(f"{path} holds no pose of the cameras (R and T){beside}")
    try:
        return StereoRig.from_opencv(cameras["left"], cameras["right"], pose[0], unit_m * pose[1])
    except (FactorlabError, ValueError) as error:
        raise FileFormatError(f"{path}: {error}") from error


def opencv_rig_text(rig: StereoRig) -> str:
    """One file with cameras, pose, and the rectification at alpha 0."""
    pair = rectify(rig, size=rig.left.size)
    P1, P2 = pair.projections
    lens = [f"{LENS_COMMENT}{rig.left.lens}"] if rig.left.lens == rig.right.lens else []
    fisheye = ["fisheye_model: 1"] if rig.left.lens == "fisheye4" else []
    matrices = {
        "M1": rig.left.matrix,
        "D1": rig.left.distortion_opencv[None],
        "M2": rig.right.matrix,
        "D2": rig.right.distortion_opencv[None],
        "R": rig.R,
        "T": rig.T[:, None],
        "R1": pair.left_R_rectified.T,
        "R2": pair.right_R_rectified.T,
        "P1": P1,
        "P2": P2,
        "Q": pair.Q,
    }
    lines = [
        "%YAML:1.0",
        "---",
        *lens,
        "# T in metres; R1 R2 P1 P2 Q: rectification without black borders",
        f"image_width: {rig.left.size[0]}",
        f"image_height: {rig.left.size[1]}",
        *fisheye,
        *(line for key, matrix in matrices.items() for line in storage_matrix(key, matrix)),
    ]
    return "\n".join(lines) + "\n"


def _cameras(text: str, where: str, size: tuple[int, int] | None) -> dict[str, Any]:
    try:
        return opencv_cameras(text, where, size)
    except FileFormatError as error:
        if "has no camera_matrix" in str(error):
            return {}
        raise


def _pose(content: dict[str, Any]) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    for turn, shift in POSES:
        R, T = content.get(turn), content.get(shift)
        if isinstance(R, np.ndarray) and isinstance(T, np.ndarray) and T.size == 3 and R.size in (3, 9):
            return _rotation(R), T.reshape(3)
    return None


def _rotation(R: NDArray[np.float64]) -> NDArray[np.float64]:
    from sequential.manifold.quaternion import quaternion_exp, rotation_matrix

    return R.reshape(3, 3) if R.size == 9 else rotation_matrix(quaternion_exp(R.reshape(3)))


def _other(path: Path) -> Path | None:
    for part, wanted in PARTS.items():
        if part in path.stem:
            beside = path.with_name(path.name.replace(part, wanted))
            return beside if beside.is_file() else None
    return None
