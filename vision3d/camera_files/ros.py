"""ROS camera_info as YAML: what `camera_calibration` writes and `camera_info_manager` reads."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import FileFormatError, ModelError
from vision3d.camera import Camera
from vision3d.camera_files.numbers import LENS_COMMENT, built, commented_lens, numbers, row, size_of

Array = NDArray[np.float64]

__all__ = ["block_of", "ros_cameras", "ros_text"]

MODELS = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}
LENS_OF = {
    "plumb_bob": {0: "pinhole", 4: "brown4", 5: "brown5"},
    "rational_polynomial": {8: "rational8"},
    "equidistant": {4: "fisheye4"},
    "fisheye": {4: "fisheye4"},
    "none": {0: "pinhole"},
    "": {0: "pinhole"},
}


def ros_text(
    camera: Camera,
    name: str = "camera",
    rectified: tuple[Array, Array] | None = None,
) -> str:
    """The file of a camera.

    Parameters
    ----------
    camera : to write
    name : what it is called
    rectified : rectification (3, 3) and projection (3, 4) of a camera of a stereo pair; None: it stands alone

    Raises
    ------
    ModelError
        for the thin-prism lens, for which ROS has no name.
    """
    model = {"rational8": "rational_polynomial", "fisheye4": "equidistant"}.get(camera.lens, "plumb_bob")
    if camera.lens == "thin12":
        raise ModelError(
            "ROS camera_info has no distortion model with a thin prism (thin12); calibrate with "
            "--lens rational8, or use the OpenCV or JSON file"
        )
    coefficients = [*camera.distortion.tolist(), *[0.0] * (MODELS[model] - len(camera.distortion))]
    fx, fy, cx, cy = camera.intrinsics.tolist()
    # what a rectified image is an image of: alone, the same intrinsics without distortion
    turn, projection = (
        (np.eye(3), np.array([[fx, 0.0, cx, 0.0], [0.0, fy, cy, 0.0], [0.0, 0.0, 1.0, 0.0]]))
        if rectified is None
        else rectified
    )
    blocks: dict[str, tuple[int, int, Any]] = {
        "camera_matrix": (3, 3, camera.matrix.ravel()),
        "distortion_coefficients": (1, len(coefficients), coefficients),
        "rectification_matrix": (3, 3, turn.ravel()),
        "projection_matrix": (3, 4, projection.ravel()),
    }
    lines = [
        f"{LENS_COMMENT}{camera.lens}",
        f"image_width: {camera.size[0]}",
        f"image_height: {camera.size[1]}",
        f"camera_name: {name}",
        f"distortion_model: {model}",
    ]
    for key, (rows, columns, data) in blocks.items():
        lines += [f"{key}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: {numbers(data)}"]
    return "\n".join(lines) + "\n"


def ros_cameras(
    document: dict[str, Any], text: str, where: str, size: tuple[int, int] | None
) -> dict[str, Camera]:
    """The camera of a document, by its name.

    Raises
    ------
    FileFormatError
        where an entry is missing, or a distortion model is another one.
    """
    matrix = row(block_of(document, "camera_matrix", where), 9, "camera_matrix", where)
    model = str(document.get("distortion_model") or "")
    coefficients: list[float] = []
    if "distortion_coefficients" in document:
        coefficients = row(
            block_of(document, "distortion_coefficients", where), None, "distortion_coefficients", where
        )
    elif model:
        raise FileFormatError(f"{where} names the model {model} and has no distortion_coefficients")
    lenses = LENS_OF.get(model)
    if lenses is None or len(coefficients) not in lenses:
        known = ", ".join(f"{one} ({MODELS[one]})" for one in MODELS)
        raise FileFormatError(
            f"{where}: distortion_model {model or 'absent'} with {len(coefficients)} coefficients is not "
            f"read; known are {known}"
        )
    if document.get("image_width") and document.get("image_height"):
        size = size_of([document["image_width"], document["image_height"]], where)
    intrinsics = [matrix[0], matrix[4], matrix[2], matrix[5]]
    camera = built(where, lenses[len(coefficients)], intrinsics, coefficients, size, commented_lens(text))
    return {str(document.get("camera_name") or "camera"): camera}


def block_of(document: dict[str, Any], key: str, where: str) -> Any:
    """The numbers of a matrix of a document.

    Raises
    ------
    FileFormatError
        where it has none of that name.
    """
    block = document.get(key)
    if isinstance(block, dict) and "data" in block:
        return block["data"]
    if isinstance(block, list):
        return [value for line in block for value in (line if isinstance(line, list) else [line])]
    raise FileFormatError(f"{where} has no {key} with data")
