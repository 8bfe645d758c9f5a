"""The filter in the loop: its sensor's Jacobian, and a covariance that is honest over many drives."""

import numpy as np
import pytest

from factorlab.l19.follower import FollowerSettings, simulate, track
from factorlab.l19.follower.estimator import Localiser, line_ahead, mixed_rate
from factorlab.l19.follower.eye import aheads


def test_the_line_is_expected_where_the_map_has_it():
    line = track("slalom")
    localiser = Localiser(FollowerSettings(curve="slalom"), line)
    for s in (1.0, 2.3, 5.1):
        pose = line.at(s) + np.array([0.01, -0.02, 0.1])
        left = localiser.expected(pose, s, aheads())
        c, n = np.cos(pose[2]), np.sin(pose[2])
        for ahead, aside in zip(aheads(), left, strict=True):
            place = pose[:2] + np.array([c * ahead - n * aside, n * ahead + c * aside])
            assert abs(line.nearest(place, s + 0.2)[1]) < 3e-4


def test_the_sensor_moves_with_the_robot_as_a_straight_line_does():
    context = np.array(
        [0.14, 0.5, 0.1, 0.0, 0.23, 0.6, 0.1, 0.0, 1.0, 100.0]
    )  # the line y = 0.1, in m and cm
    np.testing.assert_allclose(line_ahead(np.array([0.3, 0.04, 0.0]), context), [0.06, 6.0])
    expected = (0.06 - np.sin(0.1) * np.array([0.14, 0.23])) / np.cos(0.1)
    turned = line_ahead(np.array([0.3, 0.04, 0.1]), context)
    np.testing.assert_allclose(turned, expected / [1.0, 0.01])


def test_the_better_of_wheels_and_gyro_counts_more():
    wheels = np.array([0.29, 0.31])  # 1/6 rad/s
    sharp_gyro, sharp_wheels = (
        mixed_rate(wheels, 1.0, FollowerSettings(wheel_noise=w, gyro_noise=g))
        for w, g in ((0.1, 0.001), (0.0, 0.5))
    )
    assert sharp_gyro[0] == pytest.approx(1.0, abs=1e-3)
    assert sharp_wheels[0] == pytest.approx(1.0 / 6.0, abs=1e-3)
    assert sharp_gyro[1] < 0.001


@pytest.mark.slow
def test_the_covariance_is_honest_and_the_filter_better_than_odometry():
    drives = [simulate(FollowerSettings(noise=60.0, seed=seed), 300) for seed in range(12)]
    anees = np.mean([drive.nees.mean() for drive in drives]) / 3.0
    # independent drives, each some tens of correlated steps: the mean of 12 lies within a third
    assert 0.67 < anees < 1.4
    ends = np.array([(drive.estimates - drive.poses)[-1, :2] for drive in drives])
    alone = np.array([(drive.odometry - drive.poses)[-1, :2] for drive in drives])
    assert np.sqrt(np.mean(ends**2)) < 0.1 * np.sqrt(np.mean(alone**2))


def test_blur_makes_an_image_old_and_the_estimate_knows():
    drive = simulate(FollowerSettings(blur_s=0.3), 300)
    assert drive.kept
    assert np.abs(drive.errors[100:, 1]).max() < 2e-3, "sideways; without it the turns would show"
    assert drive.used.mean() > 0.95
