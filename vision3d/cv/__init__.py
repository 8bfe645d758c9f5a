"""OpenCV 4 and 5 under one form: every call here whose shape, name or arguments differ between the two.

Vectors come out flat, points as (N, 2) float64, ids as (N,) int64, and nothing found as an empty array, never
as None.  Whatever is not here is the same in both: call `cv2` for it.

What differs, 4.14 against 5.0: outputs that are vectors have lost a middle or last axis of 1 (ArUco and
ChArUco, chessboards, circle grids, segments, histograms, `findNonZero`); `stereoRectify` takes a translation
(3, 1) only; `undistortPointsIter` has become a criterion of `undistortPoints`; `calibrateHandEye`,
`cv2.ml`, cascades, HOG, AKAZE, KAZE and BRISK are gone.
"""

from vision3d.cv.boards import (
    CharucoFound,
    MarkersFound,
    detect_charuco,
    detect_markers,
    find_chessboard,
    find_circles,
    match_image_points,
    refine_corners,
)
from vision3d.cv.geometry import Rectification, solve_pnp_all, stereo_rectify, undistort_points
from vision3d.cv.lines import calc_hist, find_nonzero, hough_lines, hough_segments, line_segments
from vision3d.cv.shapes import flat, quads, rows

__all__ = [
    "CharucoFound",
    "MarkersFound",
    "Rectification",
    "calc_hist",
    "detect_charuco",
    "detect_markers",
    "find_chessboard",
    "find_circles",
    "find_nonzero",
    "flat",
    "hough_lines",
    "hough_segments",
    "line_segments",
    "match_image_points",
    "quads",
    "refine_corners",
    "rows",
    "solve_pnp_all",
    "stereo_rectify",
    "undistort_points",
]
