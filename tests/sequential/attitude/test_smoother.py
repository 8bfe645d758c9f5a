"""The attitude smoother: laws, honesty, odd recordings, and what it reaches on real trials."""

import numpy as np
import pytest
from attitude_worlds import seen, swinging

from sequential.attitude import AttitudeModel, AttitudeSmoother, attitude_from_angles
from sequential.errors import DataError, MissingStreamError, ModelError
from sequential.evaluate.attitude_error import attitude_error
from sequential.readers import read_broad
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


def test_the_filter_of_its_model_knows_less_and_ends_where_the_first_smoothing_does(world):
    t, truth = world
    recording = seen(t, truth, rng=np.random.default_rng(5))
    smoother = AttitudeSmoother(QUIET)
    filtered, smoothed = smoother.filtered(recording), smoother.estimate(recording)
    at = np.searchsorted(recording.t, filtered.t)
    assert filtered.t[-1] == recording.t[-1]
    error = np.degrees(attitude_error(filtered.world_q_body, truth[at]).total)
    hindsight = np.degrees(attitude_error(smoothed.world_q_body[at], truth[at]).total)
    assert hindsight < error < 3.0
    late = slice(len(at) // 2, -10)
    variance = np.trace(filtered.cov, axis1=1, axis2=2)[late]
    assert (variance > np.trace(smoothed.cov[at], axis1=1, axis2=2)[late]).mean() > 0.9


def test_on_a_real_trial_the_filter_is_worse_than_its_smoother_and_fair(data_dir):
    (path,) = sorted((data_dir / "imu" / "broad").glob("16_*.npz"))
    recording, truth = read_broad(path)
    smoother = AttitudeSmoother()
    filtered, smoothed = smoother.filtered(recording), smoother.estimate(recording)
    at = np.searchsorted(recording.t, filtered.t)
    errors = [
        np.degrees(attitude_error(q, truth.world_q_body[at], truth.movement[at]).total)
        for q in (filtered.world_q_body, smoothed.world_q_body[at])
    ]
    assert errors[1] < errors[0] < 2.0


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
    with pytest.raises(DataError, match="zero throughout"):
        AttitudeSmoother().estimate(ImuRecording(good.t, good.accel, good.gyro, np.zeros((len(t), 3))))
    never = ImuRecording(good.t, good.accel, good.gyro, np.full((len(t), 3), np.nan))
    assert AttitudeSmoother().estimate(never).magnetic_disturbance is None


def test_a_setting_out_of_range_is_named():
    with pytest.raises(ModelError, match="gyro_noise"):
        AttitudeModel(gyro_noise=-1.0)
    with pytest.raises(ModelError, match="iterations"):
        AttitudeSmoother(iterations=0)


def test_backwards_in_time_is_the_same_motion(world):
    t, truth = world
    there = seen(t, truth, rng=np.random.default_rng(5))
    back = ImuRecording(t, there.accel[::-1], -there.gyro[::-1], there.mag[::-1])
    one = AttitudeSmoother(QUIET).estimate(there).world_q_body
    other = AttitudeSmoother(QUIET).estimate(back).world_q_body[::-1]
    # a sample's rate leads up to it; read backwards, away from it
    assert np.degrees(attitude_error(other[1:], one[:-1]).total) < 0.2


def test_gaps_slow_fields_and_short_recordings_are_met(world):
    t, truth = world
    whole = seen(t, truth, rng=np.random.default_rng(1))
    kept = (t < 10.0) | (t > 12.0)
    history = AttitudeSmoother(QUIET).estimate(whole.select(kept))
    assert np.isfinite(history.cov).all()
    # nothing is known about the two seconds, so it must start from the other sensors again
    assert np.degrees(attitude_error(history.world_q_body, truth[kept]).total) < 3.0
    sparse = np.where(np.arange(len(t))[:, None] % 10 == 0, whole.mag, np.nan)
    slow = AttitudeSmoother(QUIET).estimate(ImuRecording(t, whole.accel, whole.gyro, sparse))
    assert np.degrees(attitude_error(slow.world_q_body, truth).total) < 1.0
    short = AttitudeSmoother(QUIET).estimate(whole.slice(0.0, 0.02))
    assert np.isfinite(short.world_q_body).all()


def test_a_batch_is_its_recordings_one_by_one(world):
    t, truth = world
    several = [seen(t, truth, rng=np.random.default_rng(k)) for k in range(3)]
    smoother = AttitudeSmoother(QUIET)
    for one, batched in zip(several, smoother.estimate_many(several, threads=2), strict=True):
        np.testing.assert_array_equal(smoother.estimate(one).world_q_body, batched.world_q_body)


def test_a_magnet_that_comes_by_is_noticed(world):
    t, truth = world
    recording = seen(t, truth, rng=np.random.default_rng(2))
    near = (t > 14) & (t < 17)
    field = recording.mag + np.where(near[:, None], [40.0, 10.0, 0.0], 0.0)
    history = AttitudeSmoother(QUIET).estimate(ImuRecording(t, recording.accel, recording.gyro, field))
    assert history.magnetic_disturbance[near].mean() > 0.9
    assert history.magnetic_disturbance[~near].mean() < 0.05
    assert np.degrees(attitude_error(history.world_q_body, truth).heading) < 1.0


def test_the_scale_of_the_accelerometer_matters_little(world):
    t, truth = world
    good = seen(t, truth, rng=np.random.default_rng(4))
    bad = ImuRecording(t, 1.03 * good.accel, good.gyro, good.mag)
    one, other = (AttitudeSmoother(QUIET).estimate(r).world_q_body for r in (good, bad))
    assert np.degrees(attitude_error(other, one).total) < 0.1


def test_a_start_in_the_middle_of_a_fast_turn_is_found(data_dir):
    (path,) = (data_dir / "imu" / "broad").glob("29_*.npz")
    recording, truth = read_broad(path)
    moving = np.flatnonzero(truth.movement)
    some = slice(moving[len(moving) // 4], moving[3 * len(moving) // 4])
    history = AttitudeSmoother().estimate(recording.select(some))
    error = attitude_error(history.world_q_body, truth.world_q_body[some])
    assert np.degrees(error.total) < 2.0  # 1.08; a heading that is wrong by half a turn is a trap here
    assert np.degrees(error.inclination) < 0.8


def test_a_long_gap_in_motion_is_begun_anew(data_dir):
    (path,) = (data_dir / "imu" / "broad").glob("21_*.npz")
    recording, truth = read_broad(path)
    kept = (recording.seconds < 80.0) | (recording.seconds > 83.0)
    history = AttitudeSmoother().estimate(recording.select(kept))
    error = attitude_error(history.world_q_body, truth.world_q_body[kept], truth.movement[kept])
    assert np.degrees(error.total) < 4.0  # 2.38; OfflineVQF takes 9.9
