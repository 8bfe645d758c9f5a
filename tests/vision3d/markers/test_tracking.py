"""Following markers: odds that grow with motion, breaks, returns, and what is refused."""

import numpy as np
import pytest
from marker_worlds import PINHOLE, SIZE_M, corners_of, swaying, tilted

from sequential.errors import TimeOrderError
from sequential.manifold import SE3
from vision3d.markers import Marker, MarkerMotion, MarkerTracker, marker_pose, marker_poses

SE = SE3()
SIGMA_PX = 0.3
FPS = 25.0


def seen(pose, rng, number=7, sigma=SIGMA_PX):
    return Marker(number, corners_of(PINHOLE, pose) + rng.normal(0.0, sigma, (4, 2)), sigma)


def is_wrong(pose, truth):
    angles = [np.linalg.norm(SE.local(mode.camera_T_marker, truth)[:3]) for mode in pose.modes]
    return angles[0] - min(angles) > np.radians(3.0)


@pytest.mark.slow
def test_motion_decides_what_single_pictures_leave_open(rng, seeds):
    alone, tracked, wrong, nees = [], [], [], []
    for _ in seeds:
        path, tracker = swaying(rng), MarkerTracker(PINHOLE, SIZE_M, MarkerMotion(turning=2.0, moving=0.3))
        for k in range(50):
            (told,) = tracker.update(k / FPS, [seen(path(k / FPS), rng)])
        truth = path(49 / FPS)
        alone.append(told.measured.certain)
        tracked.append(told.pose.certain)
        wrong.append(told.pose.certain and is_wrong(told.pose, truth))
        if not is_wrong(told.pose, truth):
            step = SE.local(told.pose.camera_T_marker, truth)
            nees.append(step @ np.linalg.solve(told.pose.cov, step) / 6.0)
    assert np.mean(tracked) >= 0.85
    assert np.mean(tracked) > np.mean(alone) + 0.3
    assert np.mean(wrong) <= 0.05
    assert 0.4 < np.median(nees) < 1.8


def test_one_picture_says_what_the_pose_of_that_picture_says(rng):
    pose = tilted(32.0, 25, rng)
    marker = seen(pose, rng)
    (told,) = MarkerTracker(PINHOLE, SIZE_M).update(0.0, [marker])
    alone = marker_pose(PINHOLE, marker.corners, SIZE_M, SIGMA_PX)
    np.testing.assert_allclose(told.pose.camera_T_marker, alone.camera_T_marker, atol=1e-9)
    np.testing.assert_allclose(told.pose.cov, alone.cov, rtol=1e-6)
    assert told.pose.odds == pytest.approx(alone.odds, rel=1e-6)


def test_many_at_once_are_those_one_by_one(rng):
    markers = [seen(tilted(40.0, 30, rng), rng, number) for number in range(5)]
    sizes = [0.05, 0.1, 0.2, 0.1, 0.1]
    for one, size, marker in zip(marker_poses(PINHOLE, markers, sizes), sizes, markers, strict=True):
        alone = marker_pose(PINHOLE, marker.corners, size, SIGMA_PX)
        np.testing.assert_allclose(one.camera_T_marker, alone.camera_T_marker, atol=1e-7)
        np.testing.assert_allclose(one.cov, alone.cov, rtol=1e-3, atol=1e-12)


def test_a_marker_that_rests_is_known_better_and_better(rng):
    pose, tracker = tilted(80.0, 35, rng), MarkerTracker(PINHOLE, SIZE_M, MarkerMotion(0.01, 0.01, walk=True))
    spread = []
    for k in range(20):
        (told,) = tracker.update(k / FPS, [seen(pose, rng)])
        spread.append(np.trace(told.pose.cov[:3, :3]))
    assert spread[-1] < 0.3 * spread[0]


def test_a_marker_that_vanishes_is_predicted_then_forgotten_and_begins_anew(rng):
    path, tracker = swaying(rng, 60.0), MarkerTracker(PINHOLE, SIZE_M, forget_s=0.5)
    for k in range(10):
        (told,) = tracker.update(k / FPS, [seen(path(k / FPS), rng)])
    last = told
    (told,) = tracker.update(10 / FPS, [])
    assert not told.seen
    assert told.marker is None
    assert told.pose.cov[3, 3] > last.pose.cov[3, 3]
    (told,) = tracker.update(11 / FPS, [seen(path(11 / FPS), rng)])
    assert told.since_s == pytest.approx(11 / FPS)
    assert tracker.update(11 / FPS + 0.6, []) == ()
    (told,) = tracker.update(11 / FPS + 0.7, [seen(path(1.0), rng)])
    assert told.since_s == 0.0


def test_a_marker_that_was_moved_unseen_is_found_again(rng):
    first, second = tilted(90.0, 35, rng), tilted(120.0, 50, rng, at=(0.3, -0.2))
    tracker = MarkerTracker(PINHOLE, SIZE_M)
    for k in range(5):
        tracker.update(k / FPS, [seen(first, rng)])
    for k in range(5, 8):
        (told,) = tracker.update(k / FPS, [seen(second, rng)])
    assert np.linalg.norm(told.pose.camera_T_marker[4:] - second[4:]) < 0.02


def test_sizes_by_number_choose_who_is_followed(rng):
    pose = tilted(80.0, 35, rng)
    told = MarkerTracker(PINHOLE, {7: SIZE_M}).update(0.0, [seen(pose, rng), seen(pose, rng, number=8)])
    assert [one.id for one in told] == [7]


def test_pictures_come_in_order(rng):
    tracker = MarkerTracker(PINHOLE, SIZE_M)
    tracker.update(1.0, [])
    with pytest.raises(TimeOrderError, match="order of time"):
        tracker.update(1.0, [])


def test_of_two_markers_with_one_number_the_first_is_followed(rng):
    near, far = tilted(90.0, 35, rng), tilted(40.0, 35, rng, at=(0.3, 0.0))
    told = MarkerTracker(PINHOLE, SIZE_M).update(0.0, [seen(near, rng), seen(far, rng)])
    assert len(told) == 1
    assert abs(told[0].pose.modes[0].distance_m - np.linalg.norm(near[4:])) < 0.1
