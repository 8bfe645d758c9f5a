"""Kalibr's camchain: one or several cameras, cam0, cam1 and so on."""

from __future__ import annotations

from typing import Any

from sequential.errors import FileFormatError, ModelError
from vision3d.camera import Camera
from vision3d.camera_files.numbers import LENS_COMMENT, built, commented_lens, numbers, row, size_of

__all__ = ["kalibr_cameras", "kalibr_text"]

LENS_OF = {"radtan": "brown4", "equidistant": "fisheye4", "equi": "fisheye4", "none": "pinhole"}


def kalibr_text(camera: Camera, name: str = "camera") -> str:
    """The file of a camera, as cam0, its topic /NAME/image_raw.

    Raises
    ------
    ModelError
        for a lens with more than k1, k2, p1, p2 that is not zero.
    """
    coefficients = camera.distortion.tolist()
    model = "equidistant" if camera.lens == "fisheye4" else "radtan" if coefficients else "none"
    if any(coefficients[4:]):
        raise ModelError(
            f"Kalibr's radtan has k1, k2, p1, p2 only, and this camera is {camera.lens}; calibrate with "
            "--lens brown4, or use another file"
        )
    coefficients = (coefficients + [0.0] * 4)[:4] if coefficients else []
    lines = [
        f"{LENS_COMMENT}{camera.lens}",
        "cam0:",
        "  cam_overlaps: []",
        "  camera_model: pinhole",
        f"  distortion_coeffs: {numbers(coefficients)}",
        f"  distortion_model: {model}",
        f"  intrinsics: {numbers(camera.intrinsics)}",
        f"  resolution: [{camera.size[0]}, {camera.size[1]}]",
        f"  rostopic: /{name.strip('/')}/image_raw",
    ]
    return "\n".join(lines) + "\n"


def kalibr_cameras(
    document: dict[str, Any], text: str, where: str, size: tuple[int, int] | None
) -> dict[str, Camera]:
    """The cameras of a chain, by their names in it.

    Raises
    ------
    FileFormatError
        for a camera or distortion model that is not read.
    """
    found = {}
    wanted = commented_lens(text) if len(document) == 1 else None
    for name, entry in document.items():
        if not (name.startswith("cam") and isinstance(entry, dict)):
            continue
        place = f"{where}, {name}"
        kind, model = entry.get("camera_model"), str(entry.get("distortion_model", "none"))
        if kind != "pinhole" or model not in LENS_OF:
            raise FileFormatError(
                f"{place}: {kind} with {model} is not read; known are pinhole with {', '.join(LENS_OF)}"
            )
        intrinsics = row(entry.get("intrinsics"), 4, "intrinsics", place)
        lens = LENS_OF[model]
        count = 0 if lens == "pinhole" else 4
        coefficients = row(entry.get("distortion_coeffs") or [], count, "distortion_coeffs", place)
        own = entry.get("resolution")
        at = size_of(own, place) if own else size
        found[name] = built(place, lens, intrinsics, coefficients, at, wanted)
    return found
