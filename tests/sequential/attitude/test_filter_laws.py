"""Laws of every recursive attitude filter, and of those whose state is a quaternion and little more."""

import math
from dataclasses import replace

import numpy as np
import pytest
from attitude_worlds import FIELD, RATE, seen, still, swinging

from sequential.attitude import (
    ComplementaryAttitude,
    ErrorStateAttitude,
    Madgwick,
    Mahony,
    TiltKalman,
    attitude_from_angles,
    attitude_from_vectors,
    roll_pitch_yaw,
)
from sequential.evaluate import attitude_error
from sequential.manifold.quaternion import quaternion_inverse, quaternion_multiply, rotate
from sequential.sensors import ImuRecording

FILTERS = {
    "complementary": ComplementaryAttitude(),
    "kalman": TiltKalman(),
    "mahony": Mahony(),
    "mahony as published": Mahony.as_published(0.7, 0.001),
    "madgwick": Madgwick(),
    "madgwick as published": Madgwick.as_published(0.1),
}
TREMBLE = {"madgwick as published": 3e-3}  # rad: its steps do not end at the minimum
QUATERNION = [name for name in FILTERS if name != "kalman"]


EVERY = {**FILTERS, "error-state": ErrorStateAttitude()}


@pytest.fixture(params=EVERY, name="filt")
def every_estimator(request):
    return EVERY[request.param]


@pytest.fixture(params=FILTERS, name="simple")
def every_simple_filter(request):
    return FILTERS[request.param]


@pytest.fixture(name="tremble")
def how_far_it_trembles(filt):
    return next((size for name, size in TREMBLE.items() if FILTERS[name] is filt), 0.0)


@pytest.fixture(params=QUATERNION, name="quaternion_filter")
def every_quaternion_filter(request):
    return FILTERS[request.param]


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.6, -0.4, 2.0), (-1.2, 0.9, -2.5), (3.0, 0.2, 1.0)])
def test_at_rest_it_is_the_accelerometer_s_tilt_and_the_field_s_north(filt, tremble, angles):
    recording = still(angles, 2.0)
    found = filt.estimate(recording)
    expected = attitude_from_vectors(recording.accel, recording.mag)
    assert attitude_error(found.world_q_body, expected).degrees[0] < 1e-4 + np.degrees(tremble)
    np.testing.assert_allclose(found.roll_pitch_yaw()[-1], angles, atol=1e-5 + tremble)


def test_it_recovers_from_a_wrong_start(filt, rng):
    recording = still((0.5, -0.3, 1.0), 60.0, rng=rng)
    wrong = recording.accel.copy()
    wrong[0] = [3.0, 2.0, 9.0]
    found = filt.estimate(ImuRecording(recording.t, wrong, recording.gyro, recording.mag))
    np.testing.assert_allclose(found.roll_pitch_yaw()[-1], (0.5, -0.3, 1.0), atol=0.03)


def test_it_follows_a_motion(filt, rng):
    t, angles = swinging()
    truth = attitude_from_angles(angles)
    for mag in (True, False):
        found = filt.estimate(seen(t, truth, mag=mag, rng=rng))
        error = attitude_error(found.world_q_body, truth, heading_offset="none" if mag else "mean")
        assert error.degrees[0] < 1.5, mag


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_each_axis_turns_the_way_its_gyro_says(filt, axis):
    t = np.arange(0, 1.0, 1 / RATE)
    angles = np.zeros((len(t), 3))
    angles[:, axis] = 0.5 * t
    found = filt.estimate(seen(t, attitude_from_angles(angles), mag=False))
    np.testing.assert_allclose(found.roll_pitch_yaw()[-1], angles[-1], atol=0.01)


def test_the_length_of_gravity_and_of_the_field_says_nothing(simple, rng):
    t, angles = swinging()
    one = seen(t, attitude_from_angles(angles), rng=rng)
    longer = ImuRecording(one.t, one.accel * 1.7, one.gyro, one.mag * 0.3)
    if isinstance(simple, Mahony):  # rest is judged in m/s², so it may begin at another sample
        simple = replace(simple, rest_time=math.inf)
    same, other = simple.estimate(one).world_q_body, simple.estimate(longer).world_q_body
    np.testing.assert_allclose(other, same, atol=1e-9)


def test_a_sensor_that_starts_turned_about_the_vertical_is_answered_so(filt):
    t, angles = swinging()
    plain = filt.estimate(seen(t, attitude_from_angles(angles)))
    turned = filt.estimate(seen(t, attitude_from_angles(angles + np.array([0.0, 0.0, 1.1]))))
    expected = quaternion_multiply(attitude_from_angles([0.0, 0.0, 1.1]), plain.world_q_body)
    # not exactly: a tilt error leaks into the heading that the field gives, by where north is
    assert attitude_error(turned.world_q_body, expected).degrees[0] < 0.15


def test_turning_the_sensor_in_its_box_turns_the_answer(quaternion_filter, rng):
    t, angles = swinging()
    truth = attitude_from_angles(angles)
    box_q_sensor = attitude_from_angles([1.2, -0.7, 2.0])
    recording = seen(t, truth, rng=rng)
    inside = [
        rotate(quaternion_inverse(box_q_sensor), v) for v in (recording.accel, recording.gyro, recording.mag)
    ]
    turned = quaternion_filter.estimate(ImuRecording(recording.t, *inside)).world_q_body
    expected = quaternion_multiply(quaternion_filter.estimate(recording).world_q_body, box_q_sensor)
    # yaw at the start, which the field sets, and the axis-wise limits of the bias are all that could differ
    assert attitude_error(turned, expected).degrees[0] < 0.05


def test_the_rate_of_sampling_does_not_matter(filt, rng):
    t, angles = swinging(rate=400.0)
    truth = attitude_from_angles(angles)
    quick = seen(t, truth)
    slow = seen(t[::8], truth[::8])
    for recording, true in ((quick, truth), (slow, truth[::8])):
        found = filt.estimate(recording)
        assert attitude_error(found.world_q_body, true).degrees[0] < 0.7


def test_a_slow_magnetometer_is_as_good(filt, rng):
    t, angles = swinging(60.0)
    truth = attitude_from_angles(angles)
    recording = seen(t, truth, rng=rng)
    mag = recording.mag.copy()
    mag[np.arange(len(mag)) % 10 != 3] = np.nan
    found = filt.estimate(ImuRecording(recording.t, recording.accel, recording.gyro, mag))
    assert attitude_error(found.world_q_body[50:], truth[50:]).degrees[0] < 1.5


def test_many_recordings_are_each_as_one_bit_for_bit(filt, rng):
    t, angles = swinging(5.0)
    recordings = [seen(t, attitude_from_angles(angles + k), rng=rng) for k in 0.1 * np.arange(5)]
    alone = [filt.estimate(one).world_q_body for one in recordings]
    for threads in (1, 3, None):
        together = filt.estimate_many(recordings, threads=threads)
        for one, other in zip(alone, together, strict=True):
            np.testing.assert_array_equal(one, other.world_q_body)


def test_a_step_is_what_the_whole_recording_makes(simple, rng):
    t, angles = swinging(3.0)
    recording = seen(t, attitude_from_angles(angles), rng=rng)
    state = simple.start(recording.gyro[0], recording.accel[0])
    path = []
    for k in range(len(recording)):
        dt = (recording.t[k] - recording.t[k - 1]) * 1e-9 if k else 0.0
        state = simple.step(state, recording.gyro[k], recording.accel[k], recording.mag[k], dt)
        path.append(state[:4])
    if isinstance(simple, TiltKalman):
        np.testing.assert_array_equal(np.array(path), simple.path(recording)[:, :4])
    else:
        path = np.array(path)
        positive = np.copysign(1.0, path[:, :1]) * path
        np.testing.assert_array_equal(positive, simple.estimate(recording).world_q_body)


def test_bad_samples_do_what_they_are_said_to_do(simple):
    a = np.array([0.1, 0.2, 9.7])
    state = simple.start([0.01, 0.0, 0.02], a)
    state = simple.step(state, [0.01, 0.0, 0.02], a, FIELD, 0.01)
    for bad in (np.nan, np.inf):
        np.testing.assert_array_equal(simple.step(state, [bad, 0.0, 0.0], a, FIELD, 0.01), state)
    for none in (np.zeros(3), np.full(3, np.nan)):
        free = simple.step(state, [0.1, 0.2, 0.3], none, none, 0.01)
        assert np.isfinite(free).all()
        assert not np.array_equal(free[:4], state[:4])
    for dt in (-0.01, 5.0):
        jumped = simple.step(state, [3.0, 0.0, 0.0], a, None, dt)
        assert np.isfinite(jumped).all()
        np.testing.assert_allclose(jumped[:2], state[:2], atol=1e-9)


@pytest.mark.parametrize("seconds", [1.001, 20.0])
def test_nothing_is_integrated_over_a_pause(filt, seconds):
    recording = still((0.2, 0.1, 0.3), 10.0)
    t = recording.t + np.where(np.arange(len(recording)) >= 500, round(seconds * 1e9), 0)
    gyro = recording.gyro.copy()
    gyro[500] = [3.0, -2.0, 1.0]
    found = filt.estimate(ImuRecording(t, recording.accel, gyro, recording.mag))
    # the reading after the pause may count for half of the interval that follows
    assert np.abs(found.roll_pitch_yaw() - [0.2, 0.1, 0.3]).max() < 0.04


def test_quaternions_stay_unit_over_a_long_time(quaternion_filter, rng):
    t = np.arange(0, 300.0, 1 / RATE)
    recording = ImuRecording(
        t,
        12 * rng.normal(size=(len(t), 3)),
        5 * rng.normal(size=(len(t), 3)),
        40 * rng.normal(size=(len(t), 3)),
    )
    found = quaternion_filter.estimate(recording).world_q_body
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-12)


def test_any_readings_give_unit_quaternions_with_w_at_least_zero(filt, rng):
    """Saturated, zero, huge, missing and irregular: the answer may be wrong, never undefined."""
    count = 3000
    t = np.cumsum(rng.choice([1e-4, 0.01, 0.3, 3.0], p=[0.2, 0.75, 0.04, 0.01], size=count))
    accel, gyro, mag = (scale * rng.normal(size=(count, 3)) for scale in (30.0, 20.0, 60.0))
    for values in (accel, gyro, mag):
        values[rng.random(count) < 0.1] = 0.0
        values[rng.random(count) < 0.02] *= 1e6
    accel[100:150], gyro[100:150] = accel[100], gyro[100]
    mag[rng.random(count) < 0.5] = np.nan
    found = filt.estimate(ImuRecording(t, accel, gyro, mag))
    np.testing.assert_allclose(np.linalg.norm(found.world_q_body, axis=1), 1.0, atol=1e-12)
    assert found.world_q_body[:, 0].min() >= 0.0
    for name in ("cov", "gyro_bias", "gyro_bias_cov"):
        if (values := getattr(found, name)) is not None:
            assert np.isfinite(values).all(), name
    if found.cov is not None:
        assert np.linalg.eigvalsh(found.cov).min() > 0


def test_angles_of_a_full_turn(filt):
    t = np.arange(0, 8.0, 1 / RATE)
    angles = np.column_stack([np.zeros_like(t), np.zeros_like(t), 2 * math.pi * t / 8])
    found = filt.estimate(seen(t, attitude_from_angles(angles)))
    assert np.abs(np.unwrap(found.roll_pitch_yaw()[:, 2])[-1] - angles[-1, 2]) < 0.02
    assert np.abs(roll_pitch_yaw(found.world_q_body)[:, :2]).max() < 0.01
