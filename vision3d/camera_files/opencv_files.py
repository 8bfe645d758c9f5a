"""Files of OpenCV's FileStorage: YAML, XML or JSON, under the names that its programs and tutorials use."""

from __future__ import annotations

from typing import Any

import numpy as np

from sequential.errors import FileFormatError, ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.camera_files.numbers import LENS_COMMENT, built, commented_lens, number, row, size_of
from vision3d.camera_files.opencv_storage import storage_content
from vision3d.camera_files.opencv_vector import lens_of_vector, split_matrix

__all__ = ["opencv_cameras", "opencv_text", "storage_matrix"]

NAMES = (
    ("camera", "camera_matrix", "distortion_coefficients"),
    ("camera", "camera_matrix", "dist_coeffs"),
    ("camera", "camera_matrix", "distortion"),
    ("camera", "cameraMatrix", "distCoeffs"),
    ("camera", "Camera_Matrix", "Distortion_Coefficients"),
    ("camera", "CameraMat", "DistCoeff"),
    ("camera", "K", "D"),
    ("camera", "M", "D"),
    ("left", "M1", "D1"),
    ("right", "M2", "D2"),
    ("left", "K1", "D1"),
    ("right", "K2", "D2"),
    ("left", "cameraMatrix1", "distCoeffs1"),
    ("right", "cameraMatrix2", "distCoeffs2"),
)
"""Camera, matrix and distortion, as they are called in files."""
SIZES = (("image_width", "image_height"), ("image_Width", "image_Height"), ("width", "height"))
SIZE_LISTS = ("image_size", "imageSize", "ImageSize", "size", "resolution")


def opencv_text(camera: Camera, name: str = "camera") -> str:
    """The file of a camera, as OpenCV's own calibration program names things.  Every lens can be said."""
    vector = camera.distortion_opencv
    fisheye = ["fisheye_model: 1"] if camera.lens == "fisheye4" else []
    lines = [
        "%YAML:1.0",
        "---",
        f"{LENS_COMMENT}{camera.lens}",
        f"camera_name: {name}",
        f"image_width: {camera.size[0]}",
        f"image_height: {camera.size[1]}",
        *fisheye,
        *storage_matrix("camera_matrix", camera.matrix),
        *storage_matrix("distortion_coefficients", vector[:, None]),
    ]
    return "\n".join(lines) + "\n"


def opencv_cameras(text: str, where: str, size: tuple[int, int] | None) -> dict[str, Camera]:
    """The cameras of a file, by `camera`, or `left` and `right`.

    Raises
    ------
    FileFormatError
        where it is damaged, or none of the names is in it.
    """
    content = storage_content(text, where)
    if "Camera.fx" in content or "Camera1.fx" in content:
        return {"camera": _orb_slam(content, where, size)}
    found = {}
    for name, matrix, vector in NAMES:
        if name not in found and isinstance(content.get(matrix), np.ndarray):
            distortion = content.get(vector)
            if distortion is not None and not isinstance(distortion, np.ndarray):
                distortion = row(distortion, None, vector, where)
            found[name] = _camera(where, content, content[matrix], distortion, size, text)
    if not found:
        listed = ", ".join(sorted(content)[:8]) or "nothing"
        raise FileFormatError(f"{where} has no camera_matrix (nor cameraMatrix, K, M1 …); it holds {listed}")
    return found


def _camera(
    where: str, content: dict[str, Any], matrix: Any, distortion: Any, size: tuple[int, int] | None, text: str
) -> Camera:
    wanted = commented_lens(text)
    fisheye = bool(content.get("fisheye_model")) or wanted == "fisheye4"
    try:
        lens, vector = lens_of_vector(distortion, "fisheye4" if fisheye else None)
        intrinsics = split_matrix(matrix)
    except (ModelError, ShapeError) as error:
        raise FileFormatError(f"{where}: {error}") from error
    return built(where, lens, intrinsics, vector.tolist(), _size(content, where) or size, wanted)


def _size(content: dict[str, Any], where: str) -> tuple[int, int] | None:
    for width, height in SIZES:
        if width in content and height in content:
            return size_of([content[width], content[height]], where)
    for key in SIZE_LISTS:
        given = content.get(key)
        if isinstance(given, list | np.ndarray) and len(np.ravel(given)) == 2:
            return size_of(list(np.ravel(given)), where)
    return None


def _orb_slam(content: dict[str, Any], where: str, size: tuple[int, int] | None) -> Camera:
    """Settings of ORB-SLAM: one number an entry."""
    prefix = "Camera1." if "Camera1.fx" in content else "Camera."
    own = {key.removeprefix(prefix): value for key, value in content.items() if key.startswith(prefix)}
    fisheye = content.get("Camera.type") == "KannalaBrandt8"
    order = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2", "k3")
    coefficients = row([own.get(name, 0.0) for name in order], None, "Camera.k1 …", where)
    lens = "fisheye4" if fisheye else "brown5"
    try:
        intrinsics = row([own[name] for name in ("fx", "fy", "cx", "cy")], 4, "Camera.fx …", where)
    except KeyError as error:
        raise FileFormatError(f"{where} has no {prefix}{error.args[0]}") from error
    sides = [content.get(f"Camera.{side}") for side in ("width", "height")]
    told = size_of(sides, where) if sides[0] and sides[1] else size
    return built(where, lens, intrinsics, coefficients, told, None)


def storage_matrix(key: str, matrix: Any) -> list[str]:
    """Lines of a matrix (rows, columns) under a key."""
    rows, columns = matrix.shape
    data = ", ".join(number(value) for value in matrix.ravel())
    return [
        f"{key}: !!opencv-matrix",
        f"   rows: {rows}",
        f"   cols: {columns}",
        "   dt: d",
        f"   data: [ {data} ]",
    ]
