"""Names of the marker dictionaries that OpenCV carries, as they are written here: 4x4_50, apriltag_36h11."""

from __future__ import annotations

import difflib
import re
from typing import Any

from sequential.errors import ModelError

__all__ = ["DICTIONARIES", "Dictionary", "dictionary_name", "opencv_dictionary"]


class Dictionary:
    """What is known of a dictionary without OpenCV: bits along a side, and how many markers it has."""

    __slots__ = ("bits", "count", "opencv")

    def __init__(self, bits: int, count: int, opencv: str) -> None:
        self.bits, self.count, self.opencv = bits, count, opencv


DICTIONARIES = {
    **{
        f"{bits}x{bits}_{count}": Dictionary(bits, count, f"DICT_{bits}X{bits}_{count}")
        for bits in (4, 5, 6, 7)
        for count in (50, 100, 250, 1000)
    },
    "aruco_original": Dictionary(5, 1024, "DICT_ARUCO_ORIGINAL"),
    "aruco_mip_36h12": Dictionary(6, 250, "DICT_ARUCO_MIP_36h12"),
    "apriltag_16h5": Dictionary(4, 30, "DICT_APRILTAG_16h5"),
    "apriltag_25h9": Dictionary(5, 35, "DICT_APRILTAG_25h9"),
    "apriltag_36h10": Dictionary(6, 2320, "DICT_APRILTAG_36h10"),
    "apriltag_36h11": Dictionary(6, 587, "DICT_APRILTAG_36h11"),
}
"""Every dictionary by its name here."""


def dictionary_name(text: str) -> str:
    """Give the name of a dictionary however it is written: DICT_4X4_50, 4x4_50, tag36h11, AprilTag 36h11.

    Raises
    ------
    ModelError
        if there is no such dictionary.
    """
    plain = re.sub(r"[\s\-]+", "_", text.strip().lower()).removeprefix("dict_")
    if (tag := re.fullmatch(r"(?:april)?_?(?:tag)?_?(16h5|25h9|36h10|36h11)", plain)) is not None:
        plain = f"apriltag_{tag[1]}"
    plain = {"original": "aruco_original", "mip_36h12": "aruco_mip_36h12", "36h12": "aruco_mip_36h12"}.get(
        plain, plain
    )
    if plain in DICTIONARIES:
        return plain
    near = difflib.get_close_matches(plain, DICTIONARIES, n=1)
    meant = f"; did you mean {near[0]!r}?" if near else ""
    raise ModelError(f"no marker dictionary {text!r}{meant} There are {', '.join(DICTIONARIES)}")


def opencv_dictionary(name: str) -> Any:
    """OpenCV's object for a dictionary, by any way of writing its name."""
    import cv2

    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARIES[dictionary_name(name)].opencv))
