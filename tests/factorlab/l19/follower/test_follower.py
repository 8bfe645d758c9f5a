"""The loop itself: settings that change on the way, losing the line, finding it again, the line's end."""

from dataclasses import replace

import numpy as np
import pytest

from factorlab.l19.follower import BOTTOM, DETECTORS, MIDDLE, OFF_M, Follower, FollowerSettings, simulate
from sequential.errors import DataError, ModelError


def driven(follower, steps):
    return [follower.step() for _ in range(steps)]


def test_reset_and_the_seed_make_the_same_drive_again():
    follower = Follower(FollowerSettings(noise=20.0, seed=4))
    first = driven(follower, 30)
    follower.reset()
    again = driven(follower, 30)
    np.testing.assert_array_equal(first[-1].image, again[-1].image)
    np.testing.assert_array_equal(first[-1].pose, again[-1].pose)
    other = driven(Follower(FollowerSettings(noise=20.0, seed=5)), 30)
    assert not np.array_equal(first[-1].pose, other[-1].pose)


def test_a_change_of_gains_drives_on_and_a_change_of_curve_begins_anew():
    follower = Follower()
    before = driven(follower, 20)[-1]
    follower.change(replace(follower.settings, kp=5.0, wheel_noise=0.1, noise=30.0))
    after = follower.step()
    assert after.t_s == pytest.approx(before.t_s + 0.05)
    assert np.linalg.norm(after.pose[:2] - before.pose[:2]) < 0.05
    follower.change(replace(follower.settings, curve="circuit"))
    assert follower.step().t_s == 0.0
    assert len(follower.line) < 1000


def test_too_much_noise_stops_it_and_less_lets_it_drive_on():
    follower = Follower(FollowerSettings(noise=250.0))
    blind = driven(follower, 60)
    assert blind[-1].lost
    assert blind[-1].command == (0.0, 0.0)
    still = driven(follower, 20)
    assert np.linalg.norm(still[-1].pose[:2] - still[2].pose[:2]) < 1e-3
    follower.change(replace(follower.settings, noise=10.0))
    again = driven(follower, 100)
    assert not again[-1].lost
    assert abs(again[-1].offset_m) < 0.01


def test_a_map_bridges_what_the_camera_does_not_see():
    seeing, blind = (simulate(FollowerSettings(noise=105.0, bridging_s=s)) for s in (1.0, 0.0))
    assert seeing.kept
    assert not blind.kept


def test_gains_of_zero_leave_the_line():
    drive = simulate(FollowerSettings(kp=0.0), 300)
    assert drive.lost[-1]
    assert np.abs(drive.offsets_m).max() > OFF_M


def test_it_stops_at_the_end_of_an_open_line():
    drive = simulate(FollowerSettings(curve="droite", speed_m_s=1.0), 400)
    assert drive.arrived[-1]
    assert drive.kept
    assert np.linalg.norm(drive.poses[-1, :2] - drive.line[-1]) < 0.6


@pytest.mark.parametrize("detector", DETECTORS)
def test_every_detector_follows(detector):
    drive = simulate(FollowerSettings(detector=detector, bridging_s=0.0), 60)
    assert drive.kept
    assert drive.used.all()
    assert drive.rms_m < 0.02


def test_a_detector_of_one_s_own_is_in_the_loop():
    def darkest(image):
        smooth = np.apply_along_axis(
            np.convolve, 1, image[[BOTTOM, MIDDLE]].astype(float), np.ones(5), "valid"
        )
        return smooth.argmin(axis=1) + 2.0

    drive = simulate(FollowerSettings(bridging_s=0.0), 100, detect=darkest)
    assert drive.kept
    assert drive.rms_m < 0.02
    np.testing.assert_array_equal(drive.columns % 1.0, 0.0)
    blind = simulate(FollowerSettings(), 40, detect=lambda _: None)
    assert blind.lost[-1]
    assert np.isnan(blind.columns).all()
    with pytest.raises(DataError, match="two columns, in rows 37 and 20"):
        simulate(FollowerSettings(), 1, detect=lambda _: 29.5)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"curve": "spirale"}, "no curve 'spirale'"),
        ({"detector": "eye"}, "no detector 'eye'"),
        ({"noise": -1.0}, "noise of the line follower must be 0 to 255"),
        ({"speed_m_s": float("nan")}, "speed_m_s"),
    ],
)
def test_refuses_settings_without_meaning(wrong, words):
    with pytest.raises(ModelError, match=words):
        FollowerSettings(**wrong)
