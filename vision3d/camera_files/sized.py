"""A camera file for images whose size is known."""

from __future__ import annotations

import os

from sequential.errors import DataError, FileFormatError
from vision3d.camera import Camera
from vision3d.camera_files.reading import read_camera

__all__ = ["read_camera_for"]


def read_camera_for(
    path: str | os.PathLike[str], size: tuple[int, int], *, which: str | None = None
) -> Camera:
    """Read the camera of images of one size (width, height); a file that does not say a size is for it.

    Parameters
    ----------
    which : name of the camera, where the file has several

    Raises
    ------
    DataError
        where the file belongs to images of another size; and as `read_camera`.
    FileFormatError
        as `read_camera`.
    """
    try:
        camera = read_camera(path, which=which)
    except FileFormatError as error:
        if "how large its images are" not in str(error):
            raise
        camera = read_camera(path, which=which, size=size)
    if camera.size != size:
        model, images = ("x".join(map(str, one)) for one in (camera.size, size))
        raise DataError(
            f"{path} is the calibration of images of {model} px, these are {images}; calibrate at the size "
            "you use"
        )
    return camera
