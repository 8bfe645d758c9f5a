"""Lines to follow: evenly spaced points, and where a robot stands beside them."""

import numpy as np
import pytest

from factorlab.l19.follower import CURVES, track


@pytest.mark.parametrize("name", CURVES)
def test_points_are_a_centimetre_apart_and_smooth(name):
    line = track(name, 2)
    steps = np.linalg.norm(np.diff(line.points, axis=0), axis=1)
    np.testing.assert_allclose(steps, 0.01, rtol=0.01)
    bends = np.diff(line.table[:, 2]) / 0.01
    assert np.abs(bends).max() < 4.5, "1/m: no tighter than the robot can turn"


@pytest.mark.parametrize("name", CURVES)
def test_a_place_beside_the_line_is_found_again(name, rng):
    line = track(name, 2)
    for s in rng.uniform(0.0, line.length_m - 0.7, 20):
        x, y, heading = line.at(s)
        aside = rng.uniform(-0.08, 0.08)
        place = np.array([x - aside * np.sin(heading), y + aside * np.cos(heading)])
        found, offset = line.nearest(place, s + rng.uniform(-0.2, 0.2))
        gap = abs(found - s)
        assert min(gap, line.length_m - gap) < 5e-3
        assert offset == pytest.approx(aside, abs=5e-4)


@pytest.mark.parametrize("name", CURVES)
def test_crossings_lie_on_the_line_and_across_the_robot(name, rng):
    line = track(name, 2)
    aheads = np.array([0.14, 0.23])
    for s in rng.uniform(0.0, line.length_m - 0.7, 10):
        pose = line.at(s) + rng.normal(0.0, [0.02, 0.02, 0.1])
        found = line.crossings(pose, aheads, s)
        away = found[:, :2] - pose[:2]
        np.testing.assert_allclose(away @ [np.cos(pose[2]), np.sin(pose[2])], aheads, atol=1e-9)
        for place in found:
            assert abs(line.nearest(place, s + 0.2)[1]) < 2e-4


def test_a_closed_line_goes_on_where_it_begins():
    line = track("circuit")
    np.testing.assert_allclose(line.points[0], line.points[-1], atol=1e-9)
    s = line.length_m - 0.05
    pose = line.at(s)
    ahead = line.crossings(pose, np.array([0.2]), s)[0]
    np.testing.assert_allclose(ahead[:2], line.at(0.15)[:2], atol=0.01)
    np.testing.assert_allclose(line.at(line.length_m + 1.0)[:2], line.at(1.0)[:2], atol=1e-9)


def test_no_crossing_where_the_line_is_behind():
    line = track("droite")
    assert line.crossings(np.array([5.0, 0.0, np.pi]), np.array([3.0]), 5.5) is None


def test_the_seed_chooses_only_the_curve_at_random():
    assert not np.array_equal(track("hasard", 1).points, track("hasard", 2).points)
    np.testing.assert_array_equal(track("sinus", 1).points, track("sinus", 2).points)
