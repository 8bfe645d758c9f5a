"""EKF against UKF under strong and weak noise: who is lost, who is honest."""

import numpy as np
import pytest

from factorlab.l19.contest import contest, robot
from sequential.evaluate import chi2_band


@pytest.fixture(scope="module")
def strong():
    return contest(60, seed=5)


@pytest.fixture(scope="module")
def weak():
    return contest(60, seed=5, noise="weak")


def test_the_same_seed_gives_the_same_draws():
    one, other = (contest(2, seed=3).error_m["ekf"] for _ in range(2))
    np.testing.assert_array_equal(one, other)
    assert not np.array_equal(one, contest(2, seed=4).error_m["ekf"])


def test_more_runs_begin_with_the_same_ones():
    np.testing.assert_array_equal(contest(4, seed=3).nees["ukf"][:2], contest(2, seed=3).nees["ukf"])


def test_under_strong_noise_the_ekf_is_lost_more_often(strong):
    assert strong.lost("ekf") > 0.05
    assert strong.lost("ukf") < 0.5 * strong.lost("ekf")
    assert strong.rmse("ukf") < strong.rmse("ekf")
    assert strong.anees("ekf").mean > strong.anees("ukf").mean > strong.anees("ukf").band[1]


def test_under_weak_noise_they_are_equal_and_honest(weak):
    low, high = chi2_band(3, 60)
    for name in ("ekf", "ukf"):
        assert weak.lost(name) == 0.0
        assert low <= weak.anees(name).mean <= high
    assert weak.rmse("ekf") == pytest.approx(weak.rmse("ukf"), rel=0.01)


def test_shapes_and_times(weak):
    assert weak.error_m["ekf"].shape == weak.nees["ukf"].shape == (60, len(weak.t))
    assert weak.t[0] == 15.0
    assert weak.late.sum() == 20  # ten seconds at 2 Hz
    assert (weak.worst("ekf") >= weak.error_m["ekf"][:, -1]).all()


def test_weak_noise_is_weaker():
    assert np.linalg.det(robot("weak").prior.cov) < np.linalg.det(robot("strong").prior.cov)
