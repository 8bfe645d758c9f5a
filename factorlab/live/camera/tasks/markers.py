"""Square markers: their numbers, and with a camera model where they are."""

from __future__ import annotations

from importlib import import_module
from typing import ClassVar

import numpy as np

from factorlab.live.camera.reading import Column, Dots, Label, Line, Mark, Number, Reading, Table
from factorlab.live.camera.task import Task
from vision3d.frames import Frame
from vision3d.markers import Marker, find_markers

__all__ = ["MarkersTask"]


class MarkersTask(Task):
    """Finds the markers of a dictionary."""

    name: ClassVar = "markers"
    columns: ClassVar = ("id", "x_px", "y_px", "side_px")

    def __init__(self, dictionary: str = "auto") -> None:
        self._dictionary = dictionary

    def prepare(self) -> None:
        """Compile what fits lines to the sides, by a square that has some."""
        square = np.full((80, 80), 255, np.uint8)
        square[20:60, 20:60] = 0
        find_markers(square, "4x4_50")
        import_module("vision3d.kernels.quad_edges")

    def read(self, frame: Frame) -> Reading:
        """Every marker of the frame."""
        markers, name = find_markers(np.asarray(frame.grey), self._dictionary)
        if name is not None:
            self._dictionary = name
        rows = tuple((marker.id, *marker.centre, marker.side_px) for marker in markers)
        return Reading(
            f"{len(markers)} marker{'s' if len(markers) != 1 else ''}" if markers else "no marker",
            "good" if markers else "idle",
            numbers=(Number("markers", len(markers), "", 0),),
            tables=(
                Table(
                    f"Dictionary {name or self._dictionary}",
                    (
                        Column("id", "", 0),
                        Column("x", "px", 1),
                        Column("y", "px", 1),
                        Column("side", "px", 1),
                    ),
                    rows,
                ),
            ),
            traces={"markers": float(len(markers))},
            marks=tuple(mark for marker in markers for mark in outlined(marker)),
            rows=tuple(dict(zip(self.columns, row, strict=True)) for row in rows),
        )


def outlined(marker: Marker) -> tuple[Mark, ...]:
    """The sides of a marker, its first corner and its number."""
    return (
        Line(marker.corners, "good", closed=True),
        Dots(marker.corners[:1], "warn", 4),
        Label(marker.corners.max(axis=0), str(marker.id), "good"),
    )
