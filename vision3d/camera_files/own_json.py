"""Our own JSON: every lens, by the names of its parameters; also inside a calibration, under "camera"."""

from __future__ import annotations

import json
from typing import Any

from sequential.errors import FileFormatError
from vision3d.camera import Camera
from vision3d.camera_files.numbers import built, row, size_of
from vision3d.lenses import LENSES

__all__ = ["camera_record", "is_record", "json_cameras", "json_text"]

FORMAT = "factorlab camera"


def camera_record(camera: Camera, name: str = "camera") -> dict[str, Any]:
    """What is written of a camera, as plain Python."""
    return {
        "format": FORMAT,
        "name": name,
        "lens": camera.lens,
        "size": list(camera.size),
        "intrinsics": dict(zip(("fx", "fy", "cx", "cy"), camera.intrinsics.tolist(), strict=True)),
        "distortion": dict(zip(LENSES[camera.lens].distortion, camera.distortion.tolist(), strict=True)),
    }


def json_text(camera: Camera, name: str = "camera") -> str:
    """The file of a camera."""
    return json.dumps(camera_record(camera, name), indent=1) + "\n"


def is_record(document: Any) -> bool:
    """Whether a document is a camera of ours, or has one under "camera"."""
    return isinstance(document, dict) and (
        document.get("format") == FORMAT or is_record(document.get("camera"))
    )


def json_cameras(document: dict[str, Any], where: str) -> dict[str, Camera]:
    """The camera of a document, by its name.

    Raises
    ------
    FileFormatError
        where a parameter is missing or none of the lens.
    """
    record = document if document.get("format") == FORMAT else document["camera"]
    if record.get("format") != FORMAT:
        return json_cameras(record, where)
    lens = record.get("lens")
    if lens not in LENSES:
        raise FileFormatError(f"{where}: no lens {lens!r}; known are {', '.join(LENSES)}")
    values = []
    for block, names in (("intrinsics", ("fx", "fy", "cx", "cy")), ("distortion", LENSES[lens].distortion)):
        given = record.get(block)
        if not isinstance(given, dict) or set(given) != set(names):
            listed = ", ".join(names) or "nothing"
            raise FileFormatError(f"{where}: {block} of the lens {lens} holds {listed}; got {given!r}")
        values.append(row([given[name] for name in names], None, f"the {block}", where))
    size = record.get("size")
    pair = None if size is None else size_of(size, where)
    return {str(record.get("name") or "camera"): built(where, lens, values[0], values[1], pair, None)}
