"""Markers, ChArUco boards, chessboards and grids of circles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sequential.errors import ModelError
from vision3d.cv.shapes import Array, Ids, flat, quads, rows

__all__ = [
    "CharucoFound",
    "MarkersFound",
    "detect_charuco",
    "detect_markers",
    "find_chessboard",
    "find_circles",
    "match_image_points",
    "refine_corners",
]

Image = NDArray[Any]


class MarkersFound(NamedTuple):
    """Markers of an image: corners (M, 4, 2) px in the marker's order, ids (M,), rejected (R, 4, 2) px."""

    corners: Array
    ids: Ids
    rejected: Array


class CharucoFound(NamedTuple):
    """A ChArUco board: corners (N, 2) px, their ids (N,), and the markers (M, 4, 2) px with ids (M,)."""

    corners: Array
    ids: Ids
    marker_corners: Array
    marker_ids: Ids


def detect_markers(
    image: Image, dictionary: Any, *, parameters: Mapping[str, Any] | None = None
) -> MarkersFound:
    """Find markers.

    Parameters
    ----------
    image : (h, w) or (h, w, 3), uint8
    dictionary : a name as `vision3d.boards.dictionary_name` takes it, or a `cv2.aruco.Dictionary`
    parameters : attributes of `cv2.aruco.DetectorParameters`, such as `{"cornerRefinementMethod": 1}`
    """
    import cv2

    detector = cv2.aruco.ArucoDetector(_dictionary(dictionary), _parameters(parameters))
    corners, ids, rejected = detector.detectMarkers(image)
    return MarkersFound(quads(corners), flat(ids), quads(rejected))


def detect_charuco(
    image: Image,
    board: Any,
    *,
    parameters: Mapping[str, Any] | None = None,
    charuco: Mapping[str, Any] | None = None,
) -> CharucoFound:
    """Find the corners of a ChArUco board.

    Parameters
    ----------
    image : (h, w) or (h, w, 3), uint8
    board : a `cv2.aruco.CharucoBoard`
    parameters : attributes of `cv2.aruco.DetectorParameters`
    charuco : attributes of `cv2.aruco.CharucoParameters`, such as `{"minMarkers": 1}`
    """
    import cv2

    settings = _with_attributes(cv2.aruco.CharucoParameters(), charuco)
    detector = cv2.aruco.CharucoDetector(board, settings, _parameters(parameters))
    corners, ids, marker_corners, marker_ids = detector.detectBoard(image)
    return CharucoFound(rows(corners, 2), flat(ids), quads(marker_corners), flat(marker_ids))


def match_image_points(board: Any, corners: Any, ids: Any) -> tuple[Array, Array]:
    """Points (N, 3) of a board, m, and their pixels (N, 2), for found corners and ids.

    Parameters
    ----------
    board : any board of `cv2.aruco`
    corners : (N, 2) for a ChArUco board, (M, 4, 2) for a board of markers, px
    ids : (N,) or (M,)
    """
    given = np.asarray(corners, dtype=np.float32)
    quads = list(given.reshape(-1, 1, 4, 2)) if given.ndim >= 3 and given.shape[-2] == 4 else None
    found = quads if quads is not None else given.reshape(-1, 1, 2)
    points, pixels = board.matchImagePoints(found, np.asarray(ids, dtype=np.int32).reshape(-1, 1))
    return rows(points, 3), rows(pixels, 2)


def find_chessboard(
    image: Image, columns: int, lines: int, *, flags: int | None = None, sector_based: bool = False
) -> tuple[bool, Array]:
    """Whether a board of columns x lines inner corners was found, and the corners (N, 2) px, perhaps in part.

    Parameters
    ----------
    image : (h, w) or (h, w, 3), uint8
    columns, lines : inner corners
    flags : of `findChessboardCorners`, or of `findChessboardCornersSB` where `sector_based`; OpenCV's default
        where None
    """
    import cv2

    find: Any = cv2.findChessboardCornersSB if sector_based else cv2.findChessboardCorners
    options = {} if flags is None else {"flags": flags}
    whole, corners = find(image, (columns, lines), **options)
    return bool(whole), rows(corners, 2)


def find_circles(
    image: Image, columns: int, lines: int, *, asymmetric: bool = False, detector: Any = None, flags: int = 0
) -> tuple[bool, Array]:
    """Whether a grid of circles was found, and the centres (N, 2) px, perhaps in part."""
    import cv2

    kind = cv2.CALIB_CB_ASYMMETRIC_GRID if asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    find: Any = cv2.findCirclesGrid
    own = {} if detector is None else {"blobDetector": detector}
    whole, centres = find(image, (columns, lines), flags=kind | flags, **own)
    return bool(whole), rows(centres, 2)


def refine_corners(
    image: Image, corners: Any, half_width: int, *, iterations: int = 40, accuracy_px: float = 1e-3
) -> Array:
    """Corners (N, 2) moved to the saddle in a window of 2 half_width + 1 px: `cv2.cornerSubPix`."""
    import cv2

    start = np.array(corners, dtype=np.float32).reshape(-1, 1, 2)
    if not len(start):
        return np.empty((0, 2))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, iterations, accuracy_px)
    return rows(cv2.cornerSubPix(image, start, (half_width, half_width), (-1, -1), criteria), 2)


def _dictionary(given: Any) -> Any:
    if not isinstance(given, str):
        return given
    from vision3d.boards.dictionaries import dictionary_name, opencv_dictionary

    return opencv_dictionary(dictionary_name(given))


def _parameters(given: Mapping[str, Any] | None) -> Any:
    import cv2

    return _with_attributes(cv2.aruco.DetectorParameters(), given)


def _with_attributes(settings: Any, given: Mapping[str, Any] | None) -> Any:
    for name, value in (given or {}).items():
        if not hasattr(settings, name):
            raise ModelError(f"OpenCV's {type(settings).__name__} has no {name!r}")
        setattr(settings, name, value)
    return settings
