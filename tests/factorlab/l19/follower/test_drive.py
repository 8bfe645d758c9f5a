"""A drive as a whole: it keeps the line, and what it tells of itself is true."""

import numpy as np
import pytest

from factorlab.l19.follower import CURVES, Follower, FollowerSettings, simulate


@pytest.mark.parametrize("curve", CURVES)
def test_keeps_every_curve_within_a_centimetre(curve):
    drive = simulate(FollowerSettings(curve=curve), 500)
    assert drive.kept
    assert drive.rms_m < 0.01
    assert drive.driven_m == pytest.approx(0.3 * 25.0, rel=0.02)


def test_steps_and_arrays_are_the_same_drive():
    settings = FollowerSettings(noise=30.0, blur_s=0.02, seed=3)
    drive, follower = simulate(settings, 40, keep_images=True), Follower(settings)
    for k in range(40):
        step = follower.step()
        np.testing.assert_array_equal(step.image, drive.images[k])
        np.testing.assert_array_equal(step.estimate, drive.estimates[k])
        assert (step.t_s, step.offset_m) == (drive.t_s[k], drive.offsets_m[k])
    assert drive.images.shape == (40, 40, 60)
    assert drive.images.dtype == np.uint8
