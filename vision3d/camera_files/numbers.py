"""Numbers in text files: every digit kept, and read as numbers by every reader of YAML."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from sequential.errors import FileFormatError, ModelError, NotFiniteError, ShapeError
from vision3d.camera import Camera
from vision3d.lenses import LENSES

__all__ = ["LENS_COMMENT", "built", "commented_lens", "number", "numbers", "row", "size_of"]

LENS_COMMENT = "# lens: "
"""A comment that keeps the name of a lens where the format has a larger one only."""


def number(value: float) -> str:
    """The shortest text of a float that reads back the same; with a point, which YAML 1.1 asks for."""
    text = repr(float(value))
    return text if "." in text else re.sub(r"(?=e|$)", ".0", text, count=1)


def numbers(values: Iterable[float]) -> str:
    """Numbers between brackets, as YAML and JSON write a list."""
    return f"[{', '.join(number(value) for value in values)}]"


def row(values: Any, count: int | None, what: str, where: str) -> list[float]:
    """A list of numbers as a file gave it.

    Raises
    ------
    FileFormatError
        where it is no list of `count` numbers.
    """
    try:
        found = [float(value) for value in values]
    except (TypeError, ValueError) as error:
        raise FileFormatError(f"{where}: expected a list of numbers for {what}, got {values!r}") from error
    if count is not None and len(found) != count:
        raise FileFormatError(f"{where}: expected {count} numbers for {what}, got {len(found)}")
    return found


def size_of(values: Any, where: str) -> tuple[int, int]:
    """(width, height) of images as a file gave them.

    Raises
    ------
    FileFormatError
        where they are not two positive whole numbers.
    """
    found = row(values, 2, "the size of the images", where)
    if not all(value >= 1.0 and value.is_integer() for value in found):
        raise FileFormatError(
            f"{where}: expected two whole numbers for the size of the images, got {values!r}"
        )
    return int(found[0]), int(found[1])


def commented_lens(text: str) -> str | None:
    """The lens that a comment of ours names; None where there is none."""
    found = re.search(rf"{re.escape(LENS_COMMENT)}(\w+)", text)
    return found[1] if found and found[1] in LENSES else None


def built(where: str, lens: str, intrinsics: Any, distortion: Any, size: Any, wanted: str | None) -> Camera:
    """A camera from what a file says, under the lens that its comment names if the numbers allow it.

    Raises
    ------
    FileFormatError
        where the numbers are no camera, or the file does not say the size of the images.
    """
    if size is None:
        raise FileFormatError(
            f"{where} does not say how large its images are; give their size too, such as 640x480"
        )
    own = len(LENSES[lens].distortion)
    if wanted is not None and wanted != lens:
        less = len(LENSES[wanted].distortion)
        if (
            LENSES[wanted].is_fisheye == LENSES[lens].is_fisheye
            and less <= own
            and not any(distortion[less:])
        ):
            lens, distortion = wanted, distortion[:less]
    try:
        return Camera(lens, intrinsics, distortion, size)
    except (ModelError, NotFiniteError, ShapeError) as error:
        raise FileFormatError(f"{where}: {error}") from error
