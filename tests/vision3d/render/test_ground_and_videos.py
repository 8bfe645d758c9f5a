"""Lines on the ground as a robot sees them, and videos with their truth."""

from itertools import pairwise

import cv2
import numpy as np
import pytest

from sequential.errors import DataError, ModelError, ShapeError
from vision3d.boards import Checkerboard, opencv_dictionary
from vision3d.camera import Camera
from vision3d.frames import open_frames
from vision3d.lines import CameraMount, planar_pose
from vision3d.render import (
    GroundLine,
    board_pixels,
    drive,
    marker_corners,
    moving_board,
    moving_markers,
    random_line,
    render_ground,
    write_video,
)
from vision3d.rigid import compose, inverse, transform

CAMERA = Camera("brown5", (266.0, 266.0, 171.0, 117.0), (-0.28, 0.02, 0.0012, -0.0001, 0.16), (320, 240))
MOUNT = CameraMount(0.2, 0.7)


def test_a_level_camera_looks_ahead_with_its_x_to_the_right():
    pose = CameraMount(0.2, 0.0, forward_m=0.1).pose
    np.testing.assert_allclose(transform(pose, np.array([0.0, 0.0, 1.0])), [1.1, 0.0, 0.2], atol=1e-12)
    np.testing.assert_allclose(transform(pose, np.array([1.0, 0.0, 0.0])), [0.1, -1.0, 0.2], atol=1e-12)


def test_pitch_is_downwards_and_yaw_to_the_left():
    down = CameraMount(0.2, np.pi / 2).pose
    np.testing.assert_allclose(transform(down, np.array([0.0, 0.0, 1.0])), [0.0, 0.0, -0.8], atol=1e-12)
    left = CameraMount(0.2, 0.0, yaw_rad=np.pi / 2).pose
    np.testing.assert_allclose(transform(left, np.array([0.0, 0.0, 1.0])), [0.0, 1.0, 0.2], atol=1e-12)


def test_poses_cancel(rng):
    a, b = (planar_pose(*rng.normal(size=3)) for _ in range(2))
    np.testing.assert_allclose(compose(inverse(a), a), [1, 0, 0, 0, 0, 0, 0], atol=1e-12)
    points = rng.normal(size=(5, 3))
    np.testing.assert_allclose(
        transform(compose(a, b), points), transform(a, transform(b, points)), atol=1e-12
    )


def test_the_stripe_lies_where_the_camera_projects_it():
    line = GroundLine(np.array([[-0.2, 0.03], [1.5, 0.03]]), 0.04)
    image = render_ground(CAMERA, MOUNT, line, np.zeros(3), vignetting=0.0)
    world = MOUNT.world_pose(planar_pose(0.0, 0.0, 0.0))
    for edge, sign in ((0.05, -1), (0.01, 1)):  # left of it, right of it
        x, y = CAMERA.project(transform(world, np.array([[0.25, edge, 0.0]])))[0]
        row = np.interp(x + np.arange(-4, 5), np.arange(320), image[round(y)].astype(float))
        level = 235 * 0.5 * (line.ink + line.floor)
        at = np.interp(-level if sign < 0 else level, sign * row if sign > 0 else -row, np.arange(-4, 5))
        assert abs(at) < 0.6, "half a row off makes some tenths of a pixel"
        assert (np.diff(row) * sign >= -3).all()


def test_where_a_robot_stands_beside_its_line():
    line = GroundLine(np.array([[-1.0, 0.0], [3.0, 0.0]]))
    left, heading = line.seen_from(np.array([0.5, 0.1, 0.2]), 0.3)
    assert heading == pytest.approx(-0.2)
    assert left == pytest.approx((-0.1 - 0.3 * np.sin(0.2)) / np.cos(0.2))
    assert np.isnan(line.seen_from(np.array([0.5, 0.1, np.pi / 2]), 0.3)).all()


def test_a_drive_follows_its_line(rng):
    line = random_line(rng, length_m=1.5)
    views = list(drive(CAMERA, MOUNT, line, rng=rng, fps=10.0, shutter_s=0.02))
    assert len(views) == 16
    for view in views:
        left, _ = line.seen_from(view.pose, 0.0)
        assert abs(left) < 0.05
    assert all(view.image.min() < 60 for view in views)
    assert all(view.image.max() > 120 for view in views)


def test_markers_of_a_video_are_where_the_truth_says(rng):
    detector = cv2.aruco.ArucoDetector(opencv_dictionary("4x4_50"))
    seen = 0
    for frame in moving_markers(CAMERA, [3, 17], 0.05, rng=rng, seconds=0.5, fps=10.0, shutter_s=0.005):
        corners, ids, _ = detector.detectMarkers(frame.image)
        for number, found in zip(np.ravel(ids) if ids is not None else [], corners, strict=True):
            truth = CAMERA.project(transform(frame.poses[int(number)], marker_corners(0.05)))
            assert np.abs(found.reshape(4, 2) - truth).max() < 2.0
            seen += 1
    assert seen >= 8


def test_a_board_is_held_still_and_moved(rng):
    board = Checkerboard(7, 5, 0.02)
    frames = list(moving_board(CAMERA, board, 2, rng=rng, fps=10.0, hold_s=0.5, move_s=0.5))
    steps = [
        np.abs(board_pixels(CAMERA, board, b.poses[-1]) - board_pixels(CAMERA, board, a.poses[-1])).max()
        for a, b in pairwise(frames)
    ]
    assert steps[:4] == [0.0] * 4
    assert max(steps) > 1.0


def test_a_video_is_read_back(rng, tmp_path):
    images = [np.full((48, 64), 40 * k, np.uint8) for k in range(5)]
    path = write_video(tmp_path / "a.avi", images, fps=20.0)
    with open_frames(path) as source:
        grey = [frame.image.mean() for frame in source]
        assert source.fps == pytest.approx(20.0)
    np.testing.assert_allclose(grey, [0, 40, 80, 120, 160], atol=2)


def test_videos_that_cannot_be_written_say_why(tmp_path):
    with pytest.raises(DataError, match="no image"):
        write_video(tmp_path / "a.avi", [])
    with pytest.raises(DataError, match="one size"):
        write_video(tmp_path / "a.avi", [np.zeros((48, 64), np.uint8), np.zeros((48, 60), np.uint8)])
    with pytest.raises(DataError, match="cannot be written"):
        write_video(tmp_path / "none" / "a.avi", [np.zeros((48, 64), np.uint8)])


def test_lines_and_mounts_that_mean_nothing_are_refused():
    with pytest.raises(ShapeError, match="two or more"):
        GroundLine(np.zeros((1, 2)))
    with pytest.raises(ModelError, match="width_m"):
        GroundLine(np.eye(2), 0.0)
    with pytest.raises(ModelError, match="height_m"):
        CameraMount(0.0, 0.3)
