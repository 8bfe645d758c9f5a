"""Boards of markers: one joint pose, better than a marker's, that leaves out what does not fit."""

import cv2
import numpy as np
import pytest
from marker_worlds import PINHOLE, tilted

from sequential.errors import DataError
from sequential.manifold import SE3
from vision3d.boards import CharucoBoard, MarkerBoard
from vision3d.camera import Camera
from vision3d.camera_files import read_camera
from vision3d.markers import (
    Marker,
    board_pose,
    detect_markers,
    find_board_pose,
    marker_board_pose,
    marker_pose,
)
from vision3d.pose import project_object
from vision3d.render import board_planes, render_planes
from vision3d.views import View

SE = SE3()
GRID = MarkerBoard.grid(4, 3, 0.04, 0.01, "4x4_50")


def room():
    """Markers on three walls."""
    corner = np.array([[-0.05, -0.05, 0], [0.05, -0.05, 0], [0.05, 0.05, 0], [-0.05, 0.05, 0]])
    sideways = corner[:, [2, 1, 0]]
    corners = np.array(
        [corner, sideways + np.array([0.3, 0.0, -0.1]), corner[:, [0, 2, 1]] + np.array([0.0, 0.3, -0.2])]
    )
    return MarkerBoard(np.array([3, 5, 8]), corners)


def seen(board, pose, rng, sigma=0.2, camera=PINHOLE):
    pixels = project_object(camera, pose, board.points).reshape(-1, 4, 2)
    return [
        Marker(int(k), one + rng.normal(0.0, sigma, (4, 2)), sigma)
        for k, one in zip(board.ids, pixels, strict=True)
    ]


@pytest.mark.parametrize("board", [GRID, room()], ids=["flat", "room"])
def test_exact_corners_give_the_exact_pose(board, rng):
    truth = SE.retract(tilted(60.0, 30, rng), np.r_[0, 0, 0, -0.1, -0.07, 0.0])
    found = marker_board_pose(PINHOLE, board, seen(board, truth, rng, 1e-6))
    assert np.abs(SE.local(found.pose.modes[0].minimum, truth)).max() < 1e-5
    assert found.left_out == ()


@pytest.mark.parametrize("board", [GRID, room()], ids=["flat", "room"])
def test_the_covariance_of_a_board_is_honest(board, rng):
    nees = []
    for _ in range(60):
        truth = tilted(50.0, 40.0 * rng.random(), rng)
        found = marker_board_pose(PINHOLE, board, seen(board, truth, rng))
        steps = [SE.local(mode.camera_T_marker, truth) for mode in found.pose.modes]
        k = int(np.argmin([np.linalg.norm(step[:3]) for step in steps]))
        nees.append(steps[k] @ np.linalg.solve(found.pose.modes[k].cov, steps[k]) / 6.0)
    assert 0.75 < np.mean(nees) < 1.25


def test_a_board_is_surer_than_a_marker(rng):
    truth = tilted(40.0, 25, rng)
    markers = seen(GRID, truth, rng)
    alone = marker_pose(PINHOLE, markers[0].corners, 0.04, 0.2)
    assert np.trace(marker_board_pose(PINHOLE, GRID, markers).cov) < 0.1 * np.trace(alone.cov)


def test_a_marker_that_was_moved_is_left_out(rng):
    truth = tilted(60.0, 25, rng)
    markers = seen(GRID, truth, rng)
    moved = Marker(markers[4].id, markers[4].corners + 9.0, 0.2)
    found = marker_board_pose(PINHOLE, GRID, [*markers[:4], moved, *markers[5:]])
    assert found.left_out == (moved.id,)
    step = SE.local(found.camera_T_board, truth)
    assert step @ np.linalg.solve(found.cov, step) / 6.0 < 4.0


def test_no_marker_of_the_board_is_said(rng):
    markers = seen(GRID, tilted(60.0, 25, rng), rng)
    with pytest.raises(DataError, match="no marker of the board of 1 markers"):
        marker_board_pose(PINHOLE, MarkerBoard.single(40, 0.05), markers)


@pytest.mark.parametrize("board", [GRID, CharucoBoard(5, 4, 0.05, 0.036, "4x4_50")], ids=["grid", "charuco"])
def test_a_rendered_board_is_found_where_it_is(board, rng):
    camera = Camera("brown4", (530, 531, 322, 240), (-0.2, 0.05, 1e-3, -2e-4), (640, 480))
    middle = board.points.mean(axis=0)
    truth = SE.retract(np.r_[1, 0, 0, 0, 0.02, -0.01, 0.45], np.r_[0.3, -0.2, 0.4, -middle])
    picture = render_planes(camera, board_planes(board, truth), rng=rng)
    found = find_board_pose(camera, board, picture)
    step = SE.local(found.camera_T_board, truth)
    assert np.linalg.norm(step[:3]) < np.radians(0.3)
    assert np.linalg.norm(step[3:]) < 1e-3
    assert step @ np.linalg.solve(found.cov, step) / 6.0 < 5.0


def test_the_pose_of_a_view_is_that_of_its_points(rng):
    board = CharucoBoard(5, 4, 0.05, 0.036, "4x4_50")
    truth = tilted(40.0, 30, rng)
    pixels = project_object(PINHOLE, truth, board.points)
    view = View("here", PINHOLE.size, board.points, pixels, np.arange(len(pixels)), np.full(len(pixels), 0.1))
    found = board_pose(PINHOLE, view)
    assert np.abs(SE.local(found.pose.modes[0].minimum, truth)).max() < 1e-6
    with pytest.raises(DataError, match="four points"):
        board_pose(PINHOLE, view.subset(np.arange(3)))


def test_the_tutorial_board_has_24_corners_and_16_behind_the_hand(data_dir):
    from vision3d.calibrate.detection import detect_views

    board = CharucoBoard(5, 7, 0.04, 0.02, "6x6_250", legacy=True)
    counts = []
    for name in ("choriginal.jpg", "chocclusion_original.jpg"):
        picture = cv2.imread(str(data_dir / "vision/aruco" / name), cv2.IMREAD_GRAYSCALE)
        (view,) = detect_views([(name, picture)], board).views
        counts.append(len(view))
    assert counts == [24, 16]


def test_real_markers_agree_with_the_board_that_they_stand_on(data_dir):
    """Every marker of the tutorial's boards alone, 21-31 px wide, held to the pose of all corners."""
    folder = data_dir / "vision/aruco"
    board = CharucoBoard(5, 7, 0.04, 0.02, "6x6_250", legacy=True)
    whole = board.opencv()
    places = dict(zip(np.ravel(whole.getIds()).tolist(), map(np.asarray, whole.getObjPoints()), strict=True))
    certain, wrong, nees = [], [], []
    for name in ("choriginal.jpg", "chocclusion_original.jpg"):
        picture = cv2.imread(str(folder / name), cv2.IMREAD_GRAYSCALE)
        camera = read_camera(folder / "tutorial_camera_charuco.yml", size=picture.shape[::-1])
        board_now = find_board_pose(camera, board, picture).camera_T_board
        for marker in detect_markers(picture, "6x6_250", camera=camera):
            corners = np.asarray(places[marker.id], dtype=np.float64)
            assert np.allclose(corners[1] - corners[0], [0.02, 0.0, 0.0], atol=1e-6)  # parallel to the board
            truth = SE.retract(board_now, np.r_[0.0, 0.0, 0.0, corners.mean(axis=0)])
            pose = marker_pose(camera, marker.corners, 0.02, marker.cov)
            steps = [SE.local(mode.camera_T_marker, truth)[:3] for mode in pose.modes]
            certain.append(pose.certain)
            wrong.append(np.linalg.norm(steps[0]) > np.radians(10.0))
            nees.append(steps[0] @ np.linalg.solve(pose.cov[:3, :3], steps[0]) / 3.0)
    assert len(certain) == 30
    assert not any(wrong)
    assert sum(certain) >= 26
    assert np.median(nees) < 1.6
