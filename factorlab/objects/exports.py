"""The files that go with a report on objects: a table, the picture with its objects marked, the mask."""

from __future__ import annotations

import csv
import io

import numpy as np
from numpy.typing import NDArray

from factorlab.objects.found import Found

__all__ = ["object_files", "overlay"]

# BGR of Okabe and Ito's colours
MARKS = ((178, 114, 0), (0, 94, 213), (115, 158, 0), (167, 121, 204), (233, 180, 86), (0, 159, 230))
HEADER = ("object", "name", "score", "x", "y", "left", "top", "width", "height", "area", "cut")


def object_files(found: Found) -> dict[str, str | bytes]:
    """By name: objects.csv, objects.png, and mask.png where there is a mask."""
    files: dict[str, str | bytes] = {"objects.csv": _table(found), "objects.png": _png(overlay(found))}
    if found.mask is not None:
        files["mask.png"] = _png(found.mask)
    return files


def overlay(found: Found) -> NDArray[np.uint8]:
    """(h, w, 3) BGR: the picture, a box and a number at every object, what is in the mask outlined."""
    import cv2

    image = np.ascontiguousarray(found.image).copy()
    names = sorted({one.name for one in found.items})
    thick = max(1, round(min(image.shape[:2]) / 600))
    if found.mask is not None:
        outlines, _ = cv2.findContours(
            (found.mask > 0).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
        )
        for ink, width_px in (((0, 0, 0), 2 * thick + 1), ((255, 255, 255), thick)):  # seen on any ground
            cv2.drawContours(image, outlines, -1, ink, width_px)
    size = max(0.4, min(image.shape[:2]) / 900)
    for k, one in enumerate(found.items, 1):
        colour = MARKS[names.index(one.name) % len(MARKS)]
        left, top, width, height = one.box
        first = (round(left), round(top))
        last = (round(left + width) - 1, round(top + height) - 1)
        cv2.rectangle(image, first, last, colour, 2 * thick if min(image.shape[:2]) > 200 else 1)
        x, y = (round(v) for v in one.centre)
        cv2.drawMarker(image, (x, y), colour, cv2.MARKER_CROSS, 8 * thick, thick)
        at = (first[0], max(first[1] - 3 * thick, round(24 * size)))
        for ink, width_px in (((255, 255, 255), 3 * thick), (colour, thick)):
            cv2.putText(image, str(k), at, cv2.FONT_HERSHEY_SIMPLEX, size, ink, width_px, cv2.LINE_AA)
    return image


def _table(found: Found) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    for k, one in enumerate(found.items, 1):
        score = "" if one.score is None else f"{one.score:.4f}"
        area = "" if one.area is None else one.area
        numbers = [f"{v:.3f}" for v in (*one.centre, *one.box)]
        writer.writerow((k, one.name, score, *numbers, area, int(one.cut)))
    return text.getvalue()


def _png(image: NDArray[np.uint8]) -> bytes:
    import cv2

    done, content = cv2.imencode(".png", image)
    assert done, "OpenCV writes PNG"  # noqa: S101 - any image of bytes
    return bytes(content)
