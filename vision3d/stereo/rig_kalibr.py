"""Kalibr's camchain of two cameras: cam0 is the left one; T_cn_cnm1 of cam1 is right_T_left."""

from __future__ import annotations

from typing import Any

import numpy as np

from sequential.errors import FactorlabError, FileFormatError
from vision3d.camera_files.kalibr import kalibr_cameras, kalibr_text
from vision3d.camera_files.numbers import LENS_COMMENT, numbers, row
from vision3d.stereo.rig import StereoRig

__all__ = ["is_camchain", "kalibr_rig", "kalibr_rig_text"]


def is_camchain(document: dict[str, Any]) -> bool:
    """Whether a document is a chain of two cameras or more."""
    return isinstance(document.get("cam0"), dict) and isinstance(document.get("cam1"), dict)


def kalibr_rig(
    document: dict[str, Any], text: str, where: str, size: tuple[int, int] | None = None, unit_m: float = 1.0
) -> StereoRig:
    """The first two cameras of a chain.

    Raises
    ------
    FileFormatError
        where a camera is not read, or cam1 does not say where it is.
    """
    cameras = kalibr_cameras({name: document[name] for name in ("cam0", "cam1")}, text, where, size)
    given = document["cam1"].get("T_cn_cnm1")
    if not isinstance(given, list) or len(given) not in (3, 4):
        raise FileFormatError(f"{where}: cam1 has no T_cn_cnm1 (4 rows), the pose of cam0 in its frame")
    matrix = np.array([row(one, 4, "T_cn_cnm1", where) for one in given])
    R = matrix[:3, :3]
    if not np.allclose(R @ R.T, np.eye(3), atol=1e-3) or np.linalg.det(R) < 0.0:
        raise FileFormatError(f"{where}: T_cn_cnm1 of cam1 holds no rotation")
    try:
        return StereoRig.from_opencv(cameras["cam0"], cameras["cam1"], R, unit_m * matrix[:3, 3])
    except FactorlabError as error:
        raise FileFormatError(f"{where}: {error}") from error


def kalibr_rig_text(rig: StereoRig) -> str:
    """The file of a rig.

    Raises
    ------
    ModelError
        for a lens that Kalibr cannot say.
    """
    left, right = (
        [line for line in kalibr_text(camera, name).splitlines() if not line.startswith(LENS_COMMENT)]
        for camera, name in ((rig.left, "left"), (rig.right, "right"))
    )
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rig.R, rig.T
    pose = ["  T_cn_cnm1:", *(f"  - {numbers(one)}" for one in matrix)]
    lines = [*left, "cam1:", *pose, *right[1:]]
    text = "\n".join(lines) + "\n"
    return text.replace("cam_overlaps: []", "cam_overlaps: [1]", 1).replace(
        "cam_overlaps: []", "cam_overlaps: [0]"
    )
