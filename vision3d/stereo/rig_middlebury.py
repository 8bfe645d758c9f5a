"""Middlebury's calib.txt: a rectified pair, cam0, cam1, doffs and baseline."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FactorlabError, FileFormatError, ModelError
from vision3d.camera import Camera
from vision3d.camera_files.numbers import number, row, size_of
from vision3d.stereo.rig import StereoRig

__all__ = ["is_middlebury", "middlebury_rig", "middlebury_text"]

ENTRY = re.compile(r"^\s*(\w+)\s*=\s*(.+?)\s*$", re.MULTILINE)


def is_middlebury(text: str) -> bool:
    """Whether a text is of this format."""
    return re.search(r"^\s*cam0\s*=", text, re.MULTILINE) is not None


def middlebury_rig(text: str, where: str, size: tuple[int, int] | None = None) -> StereoRig:
    """The rig of a file; its baseline is in millimetres.

    Raises
    ------
    FileFormatError
        where an entry is missing or no number, or where cam1 and doffs contradict each other.
    """
    entries = dict(ENTRY.findall(text))
    left = _matrix(entries, "cam0", where)
    doffs = _number(entries, "doffs", where) if "doffs" in entries else None
    if "cam1" in entries:
        right = _matrix(entries, "cam1", where)
        if doffs is not None and abs(right[0, 2] - left[0, 2] - doffs) > 0.51:
            raise FileFormatError(
                f"{where}: doffs = {doffs:g} px, but the principal points of cam0 and cam1 are "
                f"{right[0, 2] - left[0, 2]:g} px apart"
            )
    else:
        right = left.copy()
        right[0, 2] += doffs or 0.0
    baseline = _number(entries, "baseline", where)
    if "width" in entries and "height" in entries:
        size = size_of([entries["width"], entries["height"]], where)
    if size is None:
        raise FileFormatError(f"{where} does not say the size of its images; add width=… and height=…")
    try:
        cameras = [Camera("pinhole", K[[0, 1, 0, 1], [0, 1, 2, 2]], (), size) for K in (left, right)]
        pose = np.array([1.0, 0.0, 0.0, 0.0, -1e-3 * baseline, 0.0, 0.0])
        return StereoRig(cameras[0], cameras[1], pose)
    except FactorlabError as error:
        raise FileFormatError(f"{where}: {error}") from error


def middlebury_text(rig: StereoRig) -> str:
    """The file of a rectified rig (`Rectification.rig_rectified`).

    Raises
    ------
    ModelError
        where it is not rectified: distorted, turned, or with another baseline than along x.
    """
    same = np.array_equal(rig.left.intrinsics[[0, 1, 3]], rig.right.intrinsics[[0, 1, 3]])
    pinholes = rig.left.lens == rig.right.lens == "pinhole"
    if not (pinholes and same and rig.angle_rad < 1e-9 and np.abs(rig.T[1:]).max() < 1e-9 * rig.baseline_m):
        raise ModelError(
            "Middlebury's calib.txt describes a rectified pair side by side; rectify the rig first"
        )
    width, height = rig.left.size
    lines = [
        *(f"cam{k}={_written(camera)}" for k, camera in enumerate((rig.left, rig.right))),
        f"doffs={number(rig.right.intrinsics[2] - rig.left.intrinsics[2])}",
        f"baseline={number(-1e3 * rig.T[0])}",
        f"width={width}",
        f"height={height}",
    ]
    return "\n".join(lines) + "\n"


def _written(camera: Camera) -> str:
    return "[" + "; ".join(" ".join(number(value) for value in row) for row in camera.matrix) + "]"


def _matrix(entries: dict[str, str], key: str, where: str) -> NDArray[np.float64]:
    values = re.split(r"[\s;,]+", entries.get(key, "").strip("[] "))
    return np.array(row(values, 9, key, where)).reshape(3, 3)


def _number(entries: dict[str, str], key: str, where: str) -> float:
    if key not in entries:
        raise FileFormatError(f"{where} has no {key}")
    return row([entries[key]], 1, key, where)[0]
