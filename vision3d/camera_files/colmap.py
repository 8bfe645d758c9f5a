"""COLMAP's cameras.txt, in which the centre of the top-left pixel is (0.5, 0.5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from sequential.errors import FileFormatError, ModelError
from vision3d.camera import Camera
from vision3d.camera_files.numbers import LENS_COMMENT, built, commented_lens, number, row, size_of

__all__ = ["camera_of_colmap", "colmap_cameras", "colmap_parameters", "colmap_text", "is_colmap"]

HALF = 0.5
Split = Callable[[list[float]], tuple[list[float], list[float]]]


def _one_focal(p: list[float]) -> tuple[list[float], list[float]]:
    return [p[0], p[0], p[1], p[2]], p[3:]


def _two_focals(p: list[float]) -> tuple[list[float], list[float]]:
    return p[:4], p[4:]


MODELS: dict[str, tuple[int, str, Split]] = {
    "SIMPLE_PINHOLE": (3, "pinhole", _one_focal),
    "PINHOLE": (4, "pinhole", _two_focals),
    "SIMPLE_RADIAL": (4, "brown1", _one_focal),
    "RADIAL": (5, "brown2", _one_focal),
    "OPENCV": (8, "brown4", _two_focals),
    "FULL_OPENCV": (12, "rational8", _two_focals),
    "OPENCV_FISHEYE": (8, "fisheye4", _two_focals),
    "SIMPLE_RADIAL_FISHEYE": (4, "fisheye4", _one_focal),
    "RADIAL_FISHEYE": (5, "fisheye4", _one_focal),
}
"""By COLMAP's name: number of parameters, the lens here, and how the parameters are split."""
WRITTEN = {
    "pinhole": ("PINHOLE", 0),
    "brown1": ("OPENCV", 4),
    "brown2": ("OPENCV", 4),
    "brown4": ("OPENCV", 4),
    "brown5": ("FULL_OPENCV", 8),
    "rational8": ("FULL_OPENCV", 8),
    "fisheye4": ("OPENCV_FISHEYE", 4),
}


def colmap_parameters(camera: Camera, model: str | None = None) -> tuple[str, list[float]]:
    """COLMAP's name of a model for this camera, and its parameters there.

    Parameters
    ----------
    model : one of `MODELS`; by default the smallest with two focal lengths that has the distortion

    Raises
    ------
    ModelError
        for the thin-prism lens; COLMAP has one for fisheyes only.  For a model that cannot say this camera.
    """
    if camera.lens not in WRITTEN:
        raise ModelError(
            f"COLMAP has no model for the lens {camera.lens}; calibrate with --lens rational8, or undistort "
            "the images first (factorlab undistort) and use the pinhole camera"
        )
    fx, fy, cx, cy = camera.intrinsics.tolist()
    name = model or WRITTEN[camera.lens][0]
    if name not in MODELS:
        raise ModelError(
            f"{name} is no camera model of COLMAP that is known here; known: {', '.join(MODELS)}"
        )
    count, lens, split = MODELS[name]
    focals = [fx, fy] if split is _two_focals else [0.5 * (fx + fy)]
    room = count - len(focals) - 2
    coefficients = camera.distortion.tolist()[:room]
    lost = any(camera.distortion[room:]) or (lens == "fisheye4") != (camera.lens == "fisheye4")
    if lost or (len(focals) == 1 and abs(fx - fy) > 1e-9 * fx):
        raise ModelError(
            f"{name} cannot say {camera!r}: it has {count} parameters; use OPENCV or FULL_OPENCV"
        )
    return name, [*focals, cx + HALF, cy + HALF, *coefficients, *[0.0] * (room - len(coefficients))]


def camera_of_colmap(
    model: str,
    parameters: Sequence[float],
    size: Sequence[int],
    *,
    where: str = "the camera",
    wanted: str = "",
) -> Camera:
    """The camera that COLMAP describes so; `wanted` is the lens to prefer where several say the same.

    Raises
    ------
    FileFormatError
        for a model that is not known here, or numbers that are no camera.
    """
    if model not in MODELS:
        raise FileFormatError(f"{where} has the model {model}; known here are {', '.join(MODELS)}")
    _, lens, split = MODELS[model]
    intrinsics, coefficients = split(list(parameters))
    if lens == "fisheye4":
        coefficients += [0.0] * (4 - len(coefficients))
    fx, fy, cx, cy = intrinsics
    return built(where, lens, [fx, fy, cx - HALF, cy - HALF], coefficients, size, wanted or None)


def colmap_text(camera: Camera, name: str = "camera") -> str:
    """The file of a camera, as number 1.

    Raises
    ------
    ModelError
        for the thin-prism lens; COLMAP has one for fisheyes only.
    """
    model, parameters = colmap_parameters(camera)
    return (
        "# Camera list with one line of data per camera:\n"
        "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
        "# Number of cameras: 1\n"
        f"{LENS_COMMENT}{camera.lens}\n"
        f"1 {model} {camera.size[0]} {camera.size[1]} {' '.join(map(number, parameters))}\n"
    )


def is_colmap(text: str) -> bool:
    """Whether the first line that is no comment looks like a camera of COLMAP."""
    words = next(iter(_lines(text)), "").split()
    return len(words) >= 5 and words[0].isdecimal() and words[1].isupper() and words[2].isdecimal()


def colmap_cameras(text: str, where: str) -> dict[str, Camera]:
    """The cameras of a file, by their numbers.

    Raises
    ------
    FileFormatError
        for a model that is not read, or a line that is no camera.
    """
    found, lines = {}, _lines(text)
    wanted = commented_lens(text) if len(lines) == 1 else None
    for line in lines:
        words = line.split()
        if len(words) < 5 or words[1] not in MODELS:
            raise FileFormatError(f"{where}: {line[:60]!r} is no camera of {', '.join(MODELS)}")
        place = f"{where}, camera {words[0]}"
        values = row(words[4:], MODELS[words[1]][0], f"the parameters of {words[1]}", place)
        size = size_of(words[2:4], place)
        found[words[0]] = camera_of_colmap(words[1], values, size, where=place, wanted=wanted or "")
    return found


def _lines(text: str) -> list[str]:
    """Lines that are neither comment nor empty."""
    return [line for line in map(str.strip, text.splitlines()) if line and not line.startswith("#")]
