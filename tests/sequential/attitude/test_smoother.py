"""The attitude smoother: laws, honesty, odd recordings, and what it reaches on real trials."""

import numpy as np
import pytest
from attitude_worlds import seen, swinging

from sequential.attitude import AttitudeModel, AttitudeSmoother, attitude_from_angles
from sequential.errors import DataError, MissingStreamError, ModelError
from sequential.evaluate.attitude_error import attitude_error
from sequential.sensors import ImuRecording


@pytest.fixture(scope="module")
def world():
    t, angles = swinging(30.0)
    return t, attitude_from_angles(angles)


QUIET = AttitudeModel(latency=0.0)


def test_it_follows_perfect_sensors(world):
    t, truth = world
    history = AttitudeSmoother(QUIET).estimate(seen(t, truth, bias=(0.01, -0.02, 0.005)))
    assert np.degrees(attitude_error(history.world_q_body, truth).total) < 0.1
    np.testing.assert_allclose(history.gyro_bias[-1], [0.01, -0.02, 0.005], atol=2e-4)
    assert np.degrees(attitude_error(history.heading_free, truth, heading_offset="mean").total) < 0.1


def test_without_magnetometer_the_heading_is_free(world):
    t, truth = world
    recording = seen(t, truth, mag=False, rng=np.random.default_rng(3))
    history = AttitudeSmoother(QUIET).estimate(recording)
    error = attitude_error(history.world_q_body, truth, heading_offset="mean")
    assert np.degrees(error.total) < 0.5
    assert history.heading_free is None
    assert history.magnetic_disturbance is None


def test_a_recording_without_gyro_is_refused():
    with pytest.raises(MissingStreamError, match="gyro"):
        AttitudeSmoother().estimate(ImuRecording(np.arange(10) * 0.01, accel=np.ones((10, 3))))


def test_a_stuck_magnetometer_is_named(world):
    t, truth = world
    good = seen(t, truth)
    stuck = ImuRecording(good.t, good.accel, good.gyro, np.tile([20.0, 1.0, -40.0], (len(t), 1)))
    with pytest.raises(DataError, match="stuck"):
        AttitudeSmoother().estimate(stuck)


def test_a_setting_out_of_range_is_named():
    with pytest.raises(ModelError, match="gyro_noise"):
        AttitudeModel(gyro_noise=-1.0)
    with pytest.raises(ModelError, match="iterations"):
        AttitudeSmoother(iterations=0)
