"""Rigs from files and to files: ours, OpenCV's, Kalibr's, ROS's, Middlebury's; a file itself says which.

rig = read_rig("extrinsics.yml", size=(640, 480))   # with intrinsics.yml beside it
write_rig("camchain.yaml", rig)
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml

from sequential.errors import DataError, FileFormatError, ModelError
from vision3d.camera_files.opencv_storage import is_storage
from vision3d.stereo.rig import StereoRig
from vision3d.stereo.rig_json import is_rig_record, json_rig, rig_text
from vision3d.stereo.rig_kalibr import is_camchain, kalibr_rig, kalibr_rig_text
from vision3d.stereo.rig_middlebury import is_middlebury, middlebury_rig, middlebury_text
from vision3d.stereo.rig_opencv import opencv_rig, opencv_rig_text
from vision3d.stereo.rig_ros import ros_rig, ros_rig_texts

__all__ = ["read_rig", "rig_texts", "write_rig"]

Size = tuple[int, int]
IN_FOLDERS = ("rig.json", "camchain.yaml", "extrinsics.yml", "stereo_opencv.yml", "left.yaml", "calib.txt")
"""What is looked for in a folder, in this order."""


def read_rig(
    path: str | os.PathLike[str], *, size: Size | None = None, unit_m: float | None = None
) -> StereoRig:
    """Read a rig from a file of factorlab, OpenCV, Kalibr, ROS or Middlebury, or from a folder with one.

    Parameters
    ----------
    path : of the file; of the file of one camera where there are two (`left.yaml`, `extrinsics.yml`)
    size : (width, height) of the images, where the file does not say it
    unit_m : length of the unit of the file's translation, m; None: a metre (Middlebury: a millimetre)

    Raises
    ------
    DataError
        where there is no such file, or the other one is missing.
    FileFormatError
        where it is none of the formats, or damaged, or does not say the size and none was given.
    """
    where = Path(path)
    if where.is_dir():
        found = [where / name for name in IN_FOLDERS if (where / name).is_file()]
        if not found:
            raise DataError(f"the folder {where} holds none of {', '.join(IN_FOLDERS)}; name the file itself")
        where = found[0]
    if not where.is_file():
        raise DataError(f"there is no file {where}")
    try:
        text = where.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{where} is no text, and so no file of a stereo rig") from error
    return _guessed(text, where, size, unit_m)


def write_rig(path: str | os.PathLike[str], rig: StereoRig) -> Path:
    """Write a rig; returns the path.

    Parameters
    ----------
    path : an existing file is replaced; its name tells the format: .json ours (the only one that keeps the
        covariance), .yml OpenCV, .yaml Kalibr, .txt Middlebury (of a rectified rig)

    Raises
    ------
    ModelError
        for another ending, or a rig that the format cannot say.
    """
    where = Path(path)
    written = {".json": rig_text, ".yml": opencv_rig_text, ".yaml": kalibr_rig_text, ".txt": middlebury_text}
    if where.suffix.lower() not in written:
        raise ModelError(f"{where.name} does not tell its format; end it in {', '.join(written)}")
    where.write_text(written[where.suffix.lower()](rig), encoding="utf-8")
    return where


def rig_texts(rig: StereoRig) -> dict[str, str]:
    """Names and texts of the files of a rig in every format that can say it."""
    texts = {"rig.json": rig_text(rig)}
    for say in (_opencv_texts, _kalibr_texts, ros_rig_texts):
        with suppress(ModelError):  # a format may have no word for the lens
            texts |= say(rig)
    return texts


def _opencv_texts(rig: StereoRig) -> dict[str, str]:
    return {"stereo_opencv.yml": opencv_rig_text(rig)}


def _kalibr_texts(rig: StereoRig) -> dict[str, str]:
    return {"camchain.yaml": kalibr_rig_text(rig)}


def _guessed(text: str, where: Path, size: Size | None, unit_m: float | None) -> StereoRig:
    begin, unit = text.lstrip()[:200], 1.0 if unit_m is None else unit_m
    if not begin:
        raise FileFormatError(f"{where} is empty")
    if begin.startswith("{"):
        document = _json(text, where)
        return (
            json_rig(document, str(where)) if is_rig_record(document) else opencv_rig(text, where, size, unit)
        )
    if is_storage(text):
        return opencv_rig(text, where, size, unit)
    if is_middlebury(text):
        return middlebury_rig(text, str(where), size)
    document = _yaml(text, where)
    if is_camchain(document):
        return kalibr_rig(document, text, str(where), size, unit)
    if "camera_matrix" in document:
        return ros_rig(where, size)
    keys = ", ".join(map(str, list(document)[:6])) or "nothing"
    raise FileFormatError(
        f"{where} is no stereo rig of factorlab, OpenCV, Kalibr, ROS or Middlebury; it holds {keys}"
    )


def _json(text: str, where: Path) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise FileFormatError(f"{where} is damaged: line {error.lineno} is no JSON ({error.msg})") from error


def _yaml(text: str, where: Path) -> dict[str, Any]:
    try:
        document = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise FileFormatError(f"{where} is no file of a stereo rig, or damaged") from error
    return document if isinstance(document, dict) else {}
