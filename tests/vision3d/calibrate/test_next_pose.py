"""The next pose: its promise is kept, it is better than others, and it can be held."""

from itertools import pairwise

import numpy as np
import pytest
from calibration_worlds import CAMERAS, board, poses_in_view, world

from sequential.errors import DataError
from sequential.manifold.quaternion import rotate
from vision3d.boards import CharucoBoard, Checkerboard
from vision3d.calibrate import calibrate, next_pose, next_poses, projection_uncertainty
from vision3d.calibrate.pose_candidates import pose_candidates
from vision3d.views import View

BOARD = Checkerboard(9, 6, square_m=0.025)


def with_view(found, pose, rng):
    """The calibration with one more view, of the board at a pose as the camera found would see it."""
    pixels = found.camera.project(rotate(pose[:4], BOARD.points) + pose[4:])
    noisy = pixels + 0.2 * rng.standard_normal(pixels.shape)
    view = View("next", found.camera.size, BOARD.points, noisy, np.arange(54), 0.2)
    return calibrate([*found.views, view])


def mean_square(found):
    return projection_uncertainty(found).mean_px ** 2


@pytest.fixture(scope="module")
def poorly():
    """Five views of one kind."""
    scene = world("brown5", n=5, seed=31, tilt_rad=0.25)
    return calibrate(scene.views(np.random.default_rng(0)))


def test_the_promised_fall_of_the_variance_is_what_comes(poorly):
    advised, rng = next_pose(poorly, BOARD), np.random.default_rng(1)
    after = [mean_square(with_view(poorly, advised.camera_T_board, rng)) for _ in range(8)]
    assert advised.std_before_px**2 == pytest.approx(mean_square(poorly), rel=1e-6)
    assert advised.gain > 1.5
    assert np.median(after) == pytest.approx(advised.std_after_px**2, rel=0.35)


def test_it_beats_poses_at_random(poorly):
    rng = np.random.default_rng(2)
    advised = mean_square(with_view(poorly, next_pose(poorly, BOARD).camera_T_board, rng))
    others = [
        mean_square(with_view(poorly, pose, rng)) for pose in poses_in_view(poorly.camera, board(), 10, rng)
    ]
    assert advised < np.min(others) * 1.05
    assert advised < 0.8 * np.median(others)


def test_several_are_chosen_one_after_the_other(poorly):
    found = next_poses(poorly, BOARD, 3)
    assert found[0].camera_T_board == pytest.approx(next_pose(poorly, BOARD).camera_T_board)
    for before, after in pairwise(found):
        assert after.std_before_px == pytest.approx(before.std_after_px)
        assert after.std_after_px < after.std_before_px


@pytest.mark.parametrize("lens", CAMERAS)
def test_every_pose_that_is_tried_shows_the_board_whole(lens):
    camera = CAMERAS[lens]
    poses, seen = pose_candidates(camera, BOARD)
    assert len(poses) > 50
    assert seen.all()
    for pose in poses[:: max(1, len(poses) // 40)]:
        for points in (BOARD.points, BOARD.outline):
            pixels = camera.project(rotate(pose[:4], points) + pose[4:])
            assert np.all((pixels > 0.0) & (pixels < np.array(camera.size) - 1.0))
        assert (
            rotate(pose[:4], np.array([0.0, 0.0, 1.0])) @ (rotate(pose[:4], BOARD.points[0]) + pose[4:])
        ) > 0.0


def test_a_board_whose_corners_know_their_numbers_may_leave_the_image():
    charuco = CharucoBoard(10, 7, 0.025, 0.018, "4x4_100")
    _, seen = pose_candidates(CAMERAS["brown5"], charuco)
    assert not seen.all()
    assert seen.mean(axis=1).min() >= 0.4


def test_it_is_said_in_words_where_to_hold_the_board(poorly):
    advised = next_pose(poorly, BOARD)
    assert advised.words.startswith("hold the board ")
    assert f"{advised.distance_m:.2f} m away" in advised.words
    assert advised.outline_px.shape == (4, 2)
    assert ("parallel" in advised.words) == (advised.tilt_rad < np.radians(10))


def test_parallel_views_are_told_to_tilt():
    scene = world("brown5", n=6, seed=33, tilt_rad=0.06)
    found = calibrate(scene.views(np.random.default_rng(3), sigma_px=0.05))
    assert next_pose(found, BOARD).tilt_rad > np.radians(25)


def test_the_turn_freed_asks_for_another_pose_or_promises_less(poorly):
    held, freed = next_pose(poorly, BOARD), next_pose(poorly, BOARD, freed_rotation=True)
    assert freed.std_before_px < held.std_before_px


def test_a_board_that_no_image_holds_is_a_sentence(poorly):
    with pytest.raises(DataError, match="no pose shows"):
        next_pose(poorly, Checkerboard(60, 60, square_m=0.025))
