"""Markers at known places, on one board or around a room."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, final

import numpy as np

from sequential.errors import ModelError, ShapeError
from vision3d.boards.board import Array, Board, Integers, millimetres, positive, rectangle, whole
from vision3d.boards.dictionaries import DICTIONARIES, dictionary_name, opencv_dictionary

__all__ = ["MarkerBoard"]


@final
@dataclass(frozen=True, eq=False)
class MarkerBoard(Board):
    """Markers with known corners; corner k of the i-th marker is point 4 i + k.

    Parameters
    ----------
    ids : (M,) of the markers, each once
    corners : (M, 4, 3) in metres in the board's frame, from each marker's top left on, clockwise
    dictionary : of the markers, any way of writing it
    """

    ids: Integers
    corners: Array
    dictionary: str = "4x4_50"
    kind: ClassVar[str] = "markers"

    def __post_init__(self) -> None:
        object.__setattr__(self, "dictionary", dictionary_name(self.dictionary))
        ids = np.array(self.ids, dtype=np.int64).reshape(-1)
        corners = np.array(self.corners, dtype=np.float64)
        if corners.shape != (len(ids), 4, 3) or not len(ids):
            raise ShapeError(
                f"corners of {len(ids)} markers have the shape ({len(ids)}, 4, 3), got {corners.shape}; "
                "give one id and four corners for every marker"
            )
        if len(np.unique(ids)) < len(ids):
            raise ModelError(f"a marker stands on a board once, and the ids {ids.tolist()} repeat")
        known = DICTIONARIES[self.dictionary].count
        if ids.min() < 0 or ids.max() >= known:
            raise ModelError(f"ids of {self.dictionary} go from 0 to {known - 1}, got {ids.tolist()}")
        for name, array in (("ids", ids), ("corners", corners)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @staticmethod
    def grid(
        columns: int, rows: int, marker_m: float, gap_m: float, dictionary: str = "4x4_50", first: int = 0
    ) -> MarkerBoard:
        """Columns by rows of markers with a gap between them, counted row by row from the id `first`.

        The origin is the top left corner of the first marker, as in OpenCV's GridBoard.
        """
        whole("columns of markers", columns, 1)
        whole("rows of markers", rows, 1)
        positive("marker", marker_m)
        positive("gap", gap_m)
        cell = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 1, 2)
        step = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * marker_m
        corners = np.zeros((columns * rows, 4, 3))
        corners[..., :2] = cell * (marker_m + gap_m) + step
        return MarkerBoard(first + np.arange(columns * rows), corners, dictionary)

    @staticmethod
    def single(identity: int, size_m: float, dictionary: str = "4x4_50") -> MarkerBoard:
        """One marker, the origin in its middle."""
        positive("marker", size_m)
        h = 0.5 * size_m
        corners = np.array([[[-h, -h, 0.0], [h, -h, 0.0], [h, h, 0.0], [-h, h, 0.0]]])
        return MarkerBoard(np.array([identity]), corners, dictionary)

    @property
    def name(self) -> str:
        """How many markers, and their size."""
        return f"board of {len(self.ids)} markers of {self.dictionary}, {millimetres(self.pitch_m)} wide"

    @property
    def shape(self) -> tuple[int, int]:
        """No lattice."""
        return 0, 0

    @property
    def pitch_m(self) -> float:
        """Shortest side of a marker."""
        return float(np.linalg.norm(self.corners - np.roll(self.corners, 1, axis=1), axis=2).min())

    @cached_property
    def points(self) -> Array:
        """Corners of the markers in turn, (4 M, 3) m."""
        return self.corners.reshape(-1, 3)

    @cached_property
    def outline(self) -> Array:
        """The smallest upright rectangle around all corners, at their mean depth, (4, 3) m."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        around = np.array(rectangle(low[0], low[1], high[0], high[1]))
        around[:, 2] = self.points[:, 2].mean()
        around.flags.writeable = False
        return around

    def opencv(self) -> Any:
        """The same board as OpenCV's object."""
        import cv2

        corners = [c.astype(np.float32) for c in self.corners]
        return cv2.aruco.Board(corners, opencv_dictionary(self.dictionary), self.ids.astype(np.int32))
