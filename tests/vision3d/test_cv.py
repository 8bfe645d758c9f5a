"""One form for what OpenCV 4 and 5 give in different shapes; this file runs on both."""

import cv2
import numpy as np
import pytest

from sequential.errors import ModelError
from vision3d import cv

K = np.array([[500.0, 0.0, 320.0], [0.0, 510.0, 240.0], [0.0, 0.0, 1.0]])
DISTORTION = np.array([-0.3, 0.1, 0.001, -0.002, 0.02])
BOARD_SIZE = (5, 7)


def sheet_of_markers():
    """A white page with the markers 3 and 7 of 4x4_50, of 60 px."""
    page = np.full((200, 300), 255, dtype=np.uint8)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    for x, number in ((40, 3), (180, 7)):
        page[60:120, x : x + 60] = cv2.aruco.generateImageMarker(dictionary, number, 60)
    return page


def charuco_board():
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    return cv2.aruco.CharucoBoard(BOARD_SIZE, 0.04, 0.02, dictionary)


def test_markers():
    found = cv.detect_markers(sheet_of_markers(), "4x4_50", parameters={"cornerRefinementMethod": 1})
    assert sorted(found.ids.tolist()) == [3, 7]
    assert found.corners.shape == (2, 4, 2)
    assert found.ids.dtype == np.int64
    first = found.corners[int(np.argmin(found.ids))]
    np.testing.assert_allclose(first, [[39.5, 59.5], [99.5, 59.5], [99.5, 119.5], [39.5, 119.5]], atol=0.6)


def test_nothing_found_is_an_empty_array():
    blank = np.full((120, 160), 255, dtype=np.uint8)
    markers = cv.detect_markers(blank, "4x4_50")
    assert (markers.corners.shape, markers.ids.shape, markers.rejected.shape) == ((0, 4, 2), (0,), (0, 4, 2))
    charuco = cv.detect_charuco(blank, charuco_board())
    assert (charuco.corners.shape, charuco.ids.shape, charuco.marker_ids.shape) == ((0, 2), (0,), (0,))
    assert cv.hough_lines(blank * 0, 1.0, 0.01, 50).shape == (0, 2)
    assert cv.hough_segments(blank * 0, 1.0, 0.01, 50).shape == (0, 4)
    segments, widths = cv.line_segments(blank)
    assert (segments.shape, widths.shape) == ((0, 4), (0,))
    assert cv.find_nonzero(blank * 0).shape == (0, 2)
    found, corners = cv.find_chessboard(blank, 9, 6)
    assert not found
    assert corners.shape == (0, 2)
    assert cv.find_circles(blank, 4, 5)[1].shape == (0, 2)
    assert cv.refine_corners(blank, np.empty((0, 2)), 3).shape == (0, 2)


def test_charuco_corners_match_points_of_the_board():
    board = charuco_board()
    picture = board.generateImage((500, 700), marginSize=20)
    found = cv.detect_charuco(picture, board)
    assert sorted(found.ids.tolist()) == list(range(24))
    points, pixels = cv.match_image_points(board, found.corners, found.ids)
    assert (points.shape, pixels.shape) == ((24, 3), (24, 2))
    # a flat sheet seen from the front: pixels are points times a scale
    scale = np.ptp(pixels[:, 0]) / np.ptp(points[:, 0])
    np.testing.assert_allclose(np.diff(pixels, axis=0), scale * np.diff(points[:, :2], axis=0), atol=0.5)
    marker_points, marker_pixels = cv.match_image_points(
        cv2.aruco.GridBoard((2, 2), 0.04, 0.01, cv2.aruco.getPredefinedDictionary(0)),
        np.arange(16.0).reshape(2, 4, 2),
        np.array([0, 2]),
    )
    assert (marker_points.shape, marker_pixels.shape) == ((8, 3), (8, 2))


def chessboard(columns=9, rows=6, square=30):
    cells = np.add.outer(np.arange(rows + 1), np.arange(columns + 1)) % 2
    page = np.kron(255 * cells, np.ones((square, square))).astype(np.uint8)
    return np.pad(page, square, constant_values=255)


@pytest.mark.parametrize("sector_based", [False, True])
def test_chessboards(sector_based):
    image = cv2.GaussianBlur(chessboard(), (0, 0), 0.8)
    found, corners = cv.find_chessboard(image, 9, 6, sector_based=sector_based)
    assert found
    refined = cv.refine_corners(image, corners, 4)
    truth = np.stack(np.meshgrid(59.5 + 30.0 * np.arange(9), 59.5 + 30.0 * np.arange(6)), axis=-1).reshape(
        -1, 2
    )
    order = refined if np.linalg.norm(refined[0] - truth[0]) < 5.0 else refined[::-1]
    np.testing.assert_allclose(order, truth, atol=0.02)


@pytest.mark.parametrize("asymmetric", [False, True])
def test_circles(asymmetric):
    image = np.full((400, 400), 255, dtype=np.uint8)
    for row in range(6):
        for column in range(4):
            x = 60 + 70 * column + (35 if asymmetric and row % 2 else 0)
            cv2.circle(image, (x, 60 + (35 if asymmetric else 50) * row), 10, 0, -1)
    found, centres = cv.find_circles(image, 4, 6, asymmetric=asymmetric)
    assert found
    assert centres.shape == (24, 2)
    detector = cv2.SimpleBlobDetector_create()
    assert cv.find_circles(image, 4, 6, asymmetric=asymmetric, detector=detector)[0]


def test_lines():
    image = np.zeros((120, 160), dtype=np.uint8)
    image[:, 50] = 255
    lines = cv.hough_lines(image, 1.0, np.pi / 180.0, 100)
    np.testing.assert_allclose(lines[0], [50.0, 0.0], atol=1.0)
    segments = cv.hough_segments(image, 1.0, np.pi / 180.0, 50, shortest_px=60.0, gap_px=2.0)
    assert segments.shape == (1, 4)
    np.testing.assert_allclose(segments[0, [0, 2]], 50.0)
    block = np.zeros((120, 160), dtype=np.uint8)
    block[30:90, 40:120] = 200
    found, widths = cv.line_segments(block)
    assert found.shape == (len(widths), 4)
    assert len(found) >= 4


def test_histograms_and_masks(rng):
    image = rng.integers(0, 256, (40, 50), dtype=np.uint8)
    histogram = cv.calc_hist(image)
    np.testing.assert_array_equal(histogram, np.bincount(image.ravel(), minlength=256))
    inside = np.zeros_like(image)
    inside[:10] = 1
    assert cv.calc_hist(image, 16, mask=inside).sum() == 500
    rows, columns = np.nonzero(inside)
    np.testing.assert_array_equal(cv.find_nonzero(inside), np.column_stack([columns, rows]))


def test_points_undistort_until_they_settle(rng):
    normalised = rng.uniform(-0.5, 0.5, (30, 2))
    points = np.column_stack([normalised, np.ones(30)])
    pixels = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, DISTORTION)[0]
    np.testing.assert_allclose(cv.undistort_points(pixels, K, DISTORTION), normalised, atol=1e-10)


def test_both_poses_of_a_square():
    square = 0.05 * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])
    turn, shift = np.array([2.8, 0.3, 0.1]), np.array([0.02, 0.01, 0.6])
    pixels = cv2.projectPoints(square, turn, shift, K, DISTORTION)[0]
    solutions = cv.solve_pnp_all(square, pixels, K, DISTORTION, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    assert len(solutions) == 2
    assert solutions[0][2] < 1e-3 < solutions[1][2]
    np.testing.assert_allclose(solutions[0][1], shift, atol=1e-5)
    np.testing.assert_allclose(solutions[0][0], turn, atol=1e-4)


@pytest.mark.parametrize("shape", [(3,), (3, 1), (1, 3)])
def test_a_pair_is_rectified_whatever_the_shape_of_its_translation(shape):
    shift = np.array([-0.1, 0.001, 0.002])
    pair = cv.stereo_rectify(K, DISTORTION, K, DISTORTION, (640, 480), np.eye(3), shift.reshape(shape))
    np.testing.assert_allclose(pair.R1.T @ [1.0, 0.0, 0.0], -shift / np.linalg.norm(shift), atol=1e-12)
    np.testing.assert_allclose(pair.P2[0, 3], -pair.P2[0, 0] * np.linalg.norm(shift))
    assert len(pair.valid1) == 4


def test_an_unknown_parameter_is_named():
    with pytest.raises(ModelError, match="DetectorParameters has no 'cornerRefinement'"):
        cv.detect_markers(sheet_of_markers(), "4x4_50", parameters={"cornerRefinement": 1})
    with pytest.raises(ModelError, match="no marker dictionary '4x4_51'"):
        cv.detect_markers(sheet_of_markers(), "4x4_51")
