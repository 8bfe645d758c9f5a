"""What is rendered of boards and markers is found where the truth says it is."""

import cv2
import numpy as np
import pytest

from vision3d.boards import CharucoBoard, Checkerboard, CircleGrid, MarkerBoard, opencv_dictionary
from vision3d.camera import Camera
from vision3d.render import (
    Plane,
    board_pixels,
    board_poses,
    marker_corners,
    marker_texture,
    render_planes,
    render_set,
)

CAMERA = Camera("brown5", (533.0, 533.0, 342.0, 234.0), (-0.28, 0.02, 0.0012, -0.0001, 0.16), (640, 480))
CHECKERBOARD = Checkerboard(9, 6, 0.025)
FACING = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3])


def test_corners_are_found_where_they_are(rng):
    shown = render_set(CAMERA, CHECKERBOARD, 8, rng)
    errors = []
    for image, truth in zip(shown.images, shown.corners, strict=True):
        found, corners = cv2.findChessboardCorners(image, (9, 6))
        assert found
        corners = cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), (3, 60, 1e-3)).reshape(-1, 2)
        errors.append(min((corners - truth, corners[::-1] - truth), key=lambda e: np.abs(e).max()))
    errors = np.concatenate(errors)
    assert np.sqrt(np.mean(errors**2)) < 0.05
    assert np.abs(errors.mean(axis=0)).max() < 0.006, "the truth is not shifted against the image"


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize("rows", [7, 8])
def test_charuco_boards_are_opencv_s(legacy, rows):
    board = CharucoBoard(5, rows, 0.03, 0.022, "4x4_100", legacy=legacy)
    pose = np.array([1.0, 0.0, 0.0, 0.0, -0.075, -0.015 * rows, 0.4])
    image = render_planes(CAMERA, [Plane(pose, _texture(board))], rng=None)
    corners, ids, *_ = cv2.aruco.CharucoDetector(board.opencv()).detectBoard(image)
    assert sorted(np.ravel(ids)) == list(range(board.count))
    truth = board_pixels(CAMERA, board, pose)[np.ravel(ids)]
    assert np.abs(corners.reshape(-1, 2) - truth).max() < 0.3


@pytest.mark.parametrize("asymmetric", [False, True])
def test_circles_are_found_at_their_centres(asymmetric):
    board = CircleGrid(4, 11, 0.012, asymmetric=True) if asymmetric else CircleGrid(7, 5, 0.025)
    pose = np.array([1.0, 0.0, 0.0, 0.0, -0.06, -0.06, 0.35])
    image = render_planes(CAMERA, [Plane(pose, _texture(board))])
    flags = cv2.CALIB_CB_ASYMMETRIC_GRID if asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    found, centres = cv2.findCirclesGrid(image, board.shape, flags=flags)
    assert found
    truth = board_pixels(CAMERA, board, pose)
    centres = centres.reshape(-1, 2)
    near = np.linalg.norm(centres[:, None] - truth[None], axis=2).min(axis=1)
    assert near.max() < 0.25


@pytest.mark.parametrize("dictionary", ["4x4_50", "6x6_250", "aruco_original", "apriltag_36h11"])
def test_markers_are_read(dictionary):
    image = render_planes(CAMERA, [Plane(FACING, marker_texture(dictionary, 17, 0.05))])
    corners, ids, _ = cv2.aruco.ArucoDetector(opencv_dictionary(dictionary)).detectMarkers(image)
    assert np.ravel(ids).tolist() == [17]
    truth = CAMERA.project(marker_corners(0.05) + FACING[4:])
    assert np.abs(np.reshape(corners, (4, 2)) - truth).max() < 1.0


def test_a_board_of_markers_is_a_plane_each(rng):
    board = MarkerBoard.grid(3, 2, 0.03, 0.01)
    shown = render_set(CAMERA, board, 1, rng, noise=1.0)
    corners, ids, _ = cv2.aruco.ArucoDetector(opencv_dictionary("4x4_50")).detectMarkers(shown.images[0])
    assert sorted(np.ravel(ids)) == [0, 1, 2, 3, 4, 5]
    truth = shown.corners[0].reshape(-1, 4, 2)
    for number, found in zip(np.ravel(ids), corners, strict=True):
        assert np.abs(found.reshape(4, 2) - truth[number]).max() < 2.0


def test_poses_keep_the_board_inside(rng):
    poses = board_poses(CAMERA, CHECKERBOARD, 30, rng, tilt_rad=(0.3, 0.5))
    pixels = np.array([board_pixels(CAMERA, CHECKERBOARD, pose) for pose in poses])
    assert (pixels > 25.0).all()
    assert (pixels < [614.0, 454.0]).all()
    assert np.ptp(pixels.mean(axis=1), axis=0).min() > 60.0, "not all in one place"


def _texture(board):
    from vision3d.render import board_texture

    return board_texture(board)
