"""Poses, rectification and undistorted points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from vision3d.cv.shapes import Array, rows

__all__ = ["Rectification", "solve_pnp_all", "stereo_rectify", "undistort_points"]


class Rectification(NamedTuple):
    """Rotations R1, R2 (3, 3), projections P1, P2 (3, 4), disparity-to-depth Q (4, 4), valid rectangles."""

    R1: Array
    R2: Array
    P1: Array
    P2: Array
    Q: Array
    valid1: tuple[int, int, int, int]
    valid2: tuple[int, int, int, int]


def undistort_points(pixels: Any, matrix: Any, distortion: Any, *, iterations: int = 100) -> Array:
    """Normalised coordinates (N, 2), iterated until they settle (OpenCV stops after five)."""
    import cv2

    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, iterations, 1e-15)
    given, K, d = rows(pixels, 2).reshape(-1, 1, 2), np.asarray(matrix, float), np.asarray(distortion, float)
    if hasattr(cv2, "undistortPointsIter"):
        return rows(cv2.undistortPointsIter(given, K, d, np.eye(3), np.eye(3), criteria), 2)
    return rows(cv2.undistortPoints(given, K, d, criteria=criteria), 2)


def solve_pnp_all(
    points: Any, pixels: Any, matrix: Any, distortion: Any, *, flags: int
) -> list[tuple[Array, Array, float]]:
    """Every pose of `cv2.solvePnPGeneric`, best first: rotation vector (3,), translation (3,), RMS in px."""
    import cv2

    _, turns, shifts, errors = cv2.solvePnPGeneric(
        rows(points, 3),
        rows(pixels, 2),
        np.asarray(matrix, float),
        np.asarray(distortion, float),
        flags=flags,
    )
    rms = rows(errors, 1)[:, 0]
    found = [(rows(r, 3)[0], rows(t, 3)[0], float(e)) for r, t, e in zip(turns, shifts, rms, strict=True)]
    return sorted(found, key=lambda solution: solution[2])


def stereo_rectify(
    matrix1: Any,
    distortion1: Any,
    matrix2: Any,
    distortion2: Any,
    size: Sequence[int],
    R: Any,
    T: Any,
    **options: Any,
) -> Rectification:
    """Rectify a pair: `cv2.stereoRectify`, with a translation T of any shape."""
    import cv2

    K1, K2 = np.asarray(matrix1, float), np.asarray(matrix2, float)
    d1, d2 = np.asarray(distortion1, float), np.asarray(distortion2, float)
    shift = np.asarray(T, dtype=np.float64).reshape(3, 1)
    found: Any = cv2.stereoRectify(K1, d1, K2, d2, tuple(size), np.asarray(R, float), shift, **options)
    valid: list[Any] = [tuple(int(side) for side in rectangle) for rectangle in found[5:7]]
    R1, R2, P1, P2, Q = found[:5]
    return Rectification(R1, R2, P1, P2, Q, valid[0], valid[1])
