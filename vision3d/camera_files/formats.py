"""Every format that a camera is written in."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sequential.errors import ModelError
from vision3d.camera import Camera
from vision3d.camera_files.colmap import colmap_text
from vision3d.camera_files.kalibr import kalibr_text
from vision3d.camera_files.opencv_files import opencv_text
from vision3d.camera_files.own_json import json_text
from vision3d.camera_files.ros import ros_text

__all__ = ["FORMATS", "Format", "camera_text", "formats_for", "write_camera"]


@dataclass(frozen=True, slots=True)
class Format:
    """A format of camera files.

    Parameters
    ----------
    name : key of `FORMATS`
    title : what people call it
    file_name : what such a file is usually called
    text : writes a camera under a name
    """

    name: str
    title: str
    file_name: str
    text: Callable[[Camera, str], str]

    def can_say(self, camera: Camera) -> bool:
        """Whether the format has a word for everything in this camera."""
        try:
            self.text(camera, "camera")
        except ModelError:
            return False
        return True


FORMATS: dict[str, Format] = {
    one.name: one
    for one in (
        Format("json", "factorlab JSON", "camera.json", json_text),
        Format("opencv", "OpenCV YAML", "camera_opencv.yml", opencv_text),
        Format("ros", "ROS camera_info", "camera_info.yaml", ros_text),
        Format("kalibr", "Kalibr camchain", "camchain.yaml", kalibr_text),
        Format("colmap", "COLMAP cameras.txt", "cameras.txt", colmap_text),
    )
}
"""By name; `json` and `opencv` can say every lens."""


def camera_text(camera: Camera, format_name: str, name: str = "camera") -> str:
    """The file of a camera as text.

    Parameters
    ----------
    camera : to write
    format_name : key of `FORMATS`
    name : what the camera is called in the file

    Raises
    ------
    ModelError
        for an unknown format, or a lens that it cannot say.
    """
    if format_name not in FORMATS:
        raise ModelError(f"no format {format_name!r} of camera files; known are {', '.join(FORMATS)}")
    return FORMATS[format_name].text(camera, name)


def formats_for(camera: Camera) -> tuple[Format, ...]:
    """The formats that can say this camera."""
    return tuple(one for one in FORMATS.values() if one.can_say(camera))


def write_camera(
    camera: Camera, path: str | os.PathLike[str], format_name: str | None = None, *, name: str = "camera"
) -> Path:
    """Write a camera to a file; returns its path.

    Parameters
    ----------
    camera : to write
    path : of the file; an existing one is replaced
    format_name : key of `FORMATS`; None: by the name of the file (.json, .txt COLMAP, .yml OpenCV,
        camchain….yaml Kalibr, other .yaml ROS)
    name : what the camera is called in the file

    Raises
    ------
    ModelError
        for an unknown format, or a lens that it cannot say.
    """
    where = Path(path)
    where.write_text(camera_text(camera, format_name or _format_of(where), name), encoding="utf-8")
    return where


def _format_of(path: Path) -> str:
    by_suffix = {".json": "json", ".txt": "colmap", ".yml": "opencv", ".yaml": "ros"}
    suffix = path.suffix.lower()
    if suffix not in by_suffix:
        raise ModelError(
            f"{path.name} does not tell its format; name one of {', '.join(FORMATS)}, or end it in "
            f"{', '.join(by_suffix)}"
        )
    return "kalibr" if suffix == ".yaml" and path.name.startswith("camchain") else by_suffix[suffix]
