"""Find out which format a camera file is, and read it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from sequential.errors import DataError, FileFormatError
from vision3d.camera import Camera
from vision3d.camera_files.colmap import colmap_cameras, is_colmap
from vision3d.camera_files.kalibr import kalibr_cameras
from vision3d.camera_files.opencv_files import opencv_cameras
from vision3d.camera_files.opencv_storage import is_storage
from vision3d.camera_files.own_json import is_record, json_cameras
from vision3d.camera_files.ros import ros_cameras

__all__ = ["read_camera", "read_cameras"]

Size = tuple[int, int]


def read_camera(
    path: str | os.PathLike[str], *, which: str | None = None, size: Size | None = None
) -> Camera:
    """Read a camera from a file of OpenCV, ROS, Kalibr, COLMAP or ours.

    Parameters
    ----------
    path : of the file
    which : name of the camera where the file has several (`left`, `cam1`, `2`)
    size : (width, height) of the images, where the file does not say it

    Raises
    ------
    DataError
        where there is no such file or camera, or where there are several and none was chosen.
    FileFormatError
        where it is none of the formats, or damaged, or does not say the size and none was given.
    """
    cameras = read_cameras(path, size=size)
    if which is None and len(cameras) == 1:
        return next(iter(cameras.values()))
    if which in cameras:
        return cameras[which]
    names = ", ".join(cameras)
    if which is None:
        raise DataError(f"{path} holds several cameras; choose one of {names}")
    raise DataError(f"{path} has no camera {which!r}; it holds {names}")


def read_cameras(path: str | os.PathLike[str], *, size: Size | None = None) -> dict[str, Camera]:
    """Every camera of a file, by its name; see `read_camera`."""
    where = Path(path)
    if not where.is_file():
        raise DataError(f"there is no file {where}" + (": it is a folder" if where.is_dir() else ""))
    try:
        text = where.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{where} is no text, and so no camera file") from error
    cameras = _guessed(text, str(where), size)
    if not cameras:
        raise FileFormatError(f"{where} holds no camera")
    return cameras


def _guessed(text: str, where: str, size: Size | None) -> dict[str, Camera]:
    begin = text.lstrip()[:200]
    if not begin:
        raise FileFormatError(f"{where} is empty")
    if begin.startswith("{"):
        document = _json(text, where)
        return json_cameras(document, where) if is_record(document) else opencv_cameras(text, where, size)
    if is_storage(text):
        return opencv_cameras(text, where, size)
    if is_colmap(text):
        return colmap_cameras(text, where)
    document = _yaml(text, where)
    if any(str(key).startswith("cam") and "intrinsics" in value for key, value in _maps(document)):
        return kalibr_cameras(document, text, where, size)
    if "camera_matrix" in document:
        return ros_cameras(document, text, where, size)
    keys = ", ".join(map(str, list(document)[:6])) or "nothing"
    raise FileFormatError(
        f"{where} is no camera file of OpenCV, ROS, Kalibr, COLMAP or factorlab; it holds {keys}"
    )


def _maps(document: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    return [(key, value) for key, value in document.items() if isinstance(value, dict)]


def _json(text: str, where: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise FileFormatError(f"{where} is damaged: line {error.lineno} is no JSON ({error.msg})") from error


def _yaml(text: str, where: str) -> dict[str, Any]:
    import yaml

    try:
        document = yaml.safe_load(text)
    except yaml.YAMLError as error:
        line = getattr(getattr(error, "problem_mark", None), "line", None)
        place = "" if line is None else f" at line {line + 1}"
        raise FileFormatError(f"{where} is no camera file, or damaged{place}") from error
    return document if isinstance(document, dict) else {}
