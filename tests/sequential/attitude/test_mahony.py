"""What our Mahony has beyond the published one."""

import numpy as np
import pytest
from attitude_worlds import FIELD, RATE, seen, still, swinging

from sequential.attitude import Mahony, attitude_from_angles
from sequential.errors import ModelError
from sequential.evaluate import attitude_error
from sequential.sensors import ImuRecording

BIAS = np.array([0.01, -0.02, 0.015])


def test_the_bias_is_found_at_rest_on_every_axis(rng):
    found = Mahony().estimate(still((0.3, 0.2, 0.0), 20.0, mag=False, bias=BIAS, rng=rng))
    np.testing.assert_allclose(found.gyro_bias[-1], BIAS, atol=1e-3)
    assert found.rest[-1]
    assert not found.rest[: int(1.4 * RATE)].any()


@pytest.mark.parametrize("stream", ["gyro", "accel"])
def test_a_first_reading_that_is_no_number_does_not_hide_rest_for_ever(stream, rng):
    recording = still((0.3, 0.2, 0.0), 20.0, mag=False, bias=BIAS, rng=rng)
    filt, readings = Mahony(), {name: np.array(getattr(recording, name)) for name in ("gyro", "accel")}
    readings[stream][0] = np.nan
    state = filt.start(readings["gyro"][0], readings["accel"][0])
    for gyro, accel in zip(readings["gyro"][1:], readings["accel"][1:], strict=True):
        state = filt.step(state, gyro, accel, None, 1 / RATE)
    np.testing.assert_allclose(state[4:7], BIAS, atol=1e-3)


def test_the_integral_finds_the_bias_in_motion(rng):
    t, angles = swinging(200.0)
    recording = seen(t, attitude_from_angles(angles), bias=BIAS, rng=rng)
    found = Mahony(rest_time=np.inf, integral_gain=0.05, heading_gain=0.5).estimate(recording)
    np.testing.assert_allclose(found.gyro_bias[-2000:].mean(axis=0), BIAS, atol=4e-3)
    assert not found.rest.any()


def test_a_bias_that_no_rest_has_shown_does_not_carry_the_tilt_away(rng):
    """3.8 °/s push harder than an error of 0.05 pulls back: the limit has to give way to what lasts."""
    t = np.arange(0, 120.0, 1 / RATE)
    angles = np.column_stack([0.5 * np.sin(0.9 * t), 0.4 * np.sin(0.7 * t + 1), 0.8 * np.sin(0.5 * t)])
    truth = attitude_from_angles(angles)
    recording = seen(t, truth, mag=False, bias=[0.052, -0.035, 0.026], rng=rng)
    worst = []
    for lasting_time in (np.inf, 20.0):
        found = Mahony(lasting_time=lasting_time).estimate(recording)
        assert not found.rest.any()
        worst.append(np.degrees(attitude_error(found.world_q_body, truth).errors[:, 2].max()))
    assert worst[0] > 30.0
    assert worst[1] < 12.0


def test_the_bias_stays_within_its_limit():
    recording = still((0.0, 0.0, 0.0), 60.0, bias=[0.5, -0.5, 0.0])
    found = Mahony(bias_limit=0.03, integral_gain=1.0, error_limit=np.inf).estimate(recording)
    assert np.abs(found.gyro_bias).max() == pytest.approx(0.03)


def test_pushes_move_it_less_than_the_published_filter(rng):
    t, angles = swinging(40.0)
    truth = attitude_from_angles(angles)
    recording = seen(t, truth, rng=rng)
    accel = recording.accel.copy()
    for start in range(1000, 4000, 300):
        accel[start : start + 40] += rng.normal(scale=6.0, size=3)
    pushed = ImuRecording(recording.t, accel, recording.gyro, recording.mag)
    ours, published = (
        attitude_error(filt.estimate(pushed).world_q_body, truth).degrees[2]
        for filt in (Mahony(), Mahony.as_published(0.5))
    )
    assert ours < 0.5 * published


def test_a_disturbed_field_is_refused_until_its_time_is_up(rng):
    recording = still((0.0, 0.0, 0.4), 60.0)
    mag = recording.mag.copy()
    mag[1000:] = mag[1000:] @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = ImuRecording(recording.t, recording.accel, recording.gyro, mag)
    found = Mahony(heading_timeout=15.0, heading_gain=0.5).estimate(turned)
    yaw = found.roll_pitch_yaw()[:, 2]
    assert np.abs(yaw[1000:2490] - 0.4).max() < 1e-6
    assert found.magnetic_disturbance[1001:2490].all()
    assert np.abs(yaw[-1] - 0.4) == pytest.approx(np.pi / 2, abs=0.05)
    assert not found.magnetic_disturbance[-1]


def test_a_disturbance_moves_the_heading_alone(rng):
    recording = still((0.3, -0.2, 0.4), 20.0)
    bent = ImuRecording(
        recording.t, recording.accel, recording.gyro, recording.mag + np.array([9.0, -4.0, 20.0])
    )
    np.testing.assert_allclose(
        Mahony(heading_gain=1.0).estimate(bent).roll_pitch_yaw()[-1, :2], (0.3, -0.2), atol=1e-6
    )
    published = Mahony.as_published(0.5).estimate(bent).roll_pitch_yaw()[-1, :2]
    assert np.isfinite(published).all()


def test_third_order_integrates_fast_turns(rng):
    t = np.arange(0, 10.0, 1 / RATE)
    truth = attitude_from_angles(np.column_stack([np.zeros_like(t), np.zeros_like(t), 12.0 * t]))
    recording = seen(t, truth, mag=False)
    wrong = [
        attitude_error(
            Mahony(order=order, rest_time=np.inf).estimate(recording).world_q_body[-1:], truth[-1:]
        )
        for order in (1, 3)
    ]
    lag = [error.degrees[1] for error in wrong]
    assert lag[0] == pytest.approx(np.degrees(0.12**3 / 12 * 1000), rel=0.05)
    assert lag[1] < 0.02


@pytest.mark.parametrize(
    "wrong",
    [{"gain": 0.0}, {"bias_limit": -1.0}, {"order": 2}, {"integral_gain": np.nan}, {"start_time": -1}],
)
def test_settings_out_of_range_are_told(wrong):
    with pytest.raises(ModelError, match="Mahony"):
        Mahony(**wrong)


def test_the_field_points_north_only_with_a_magnetometer():
    assert FIELD[1] > 0
    recording = still((0.0, 0.0, 0.9), 5.0)
    assert Mahony().estimate(recording).magnetic_disturbance is not None
    blind = Mahony(magnetometer=False).estimate(recording)
    assert blind.magnetic_disturbance is None
    assert abs(blind.roll_pitch_yaw()[-1, 2]) < 1e-9
