"""Simulated recordings: rates are the derivative of attitudes, and sensors err as they were told to."""

import numpy as np
import pytest

from sequential.errors import DataError, ShapeError
from sequential.manifold.quaternion import quaternion_inverse, quaternion_log, quaternion_multiply, rotate
from sequential.noise import ImuNoise
from sequential.sensors import (
    SIX_POSITIONS,
    ImuErrors,
    constant_rate,
    simulate_imu,
    stationary,
    tumble,
    waypoints,
)

MOTIONS = {
    "still": lambda _: stationary(10.0, (0.5, 0.5, 0.5, 0.5)),
    "constant": lambda _: constant_rate(10.0, (0.3, -1.0, 2.0)),
    "six": lambda _: waypoints(SIX_POSITIONS, dwell=1.0, travel=0.8),
    "tumble": lambda rng: tumble(10.0, rng, angle=1.0),
    "tumble_after_rest": lambda rng: tumble(10.0, rng, rest=3.0),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_rate_is_the_derivative_of_the_attitude(name, rng):
    motion = MOTIONS[name](rng)
    t, h = np.linspace(0.01, motion.duration - 0.01, 501), 1e-5
    ahead, behind = motion.attitude(t + h)[0], motion.attitude(t - h)[0]
    turned = quaternion_log(quaternion_multiply(quaternion_inverse(behind), ahead)) / (2 * h)
    np.testing.assert_allclose(turned, motion.attitude(t)[1], atol=1e-6)


@pytest.mark.parametrize("name", MOTIONS)
def test_a_body_at_rest_neither_turns_nor_accelerates(name, rng):
    motion = MOTIONS[name](rng)
    t = np.linspace(0.0, motion.duration, 1001)
    at_rest = t[motion.rest(t)]
    assert name in {"constant", "tumble"} or len(at_rest) > 100
    np.testing.assert_allclose(motion.acceleration(at_rest), 0.0, atol=1e-12)
    if name != "constant":
        np.testing.assert_allclose(motion.attitude(at_rest)[1], 0.0, atol=1e-9)


def test_acceleration_of_the_sway_is_a_second_derivative(rng):
    """What starts at rest and is integrated twice stays within the amplitude of the sines."""
    motion = tumble(20.0, rng, sway=0.1, rest=2.0)
    t = np.linspace(0.0, 20.0, 200_001)
    speed = np.cumsum(motion.acceleration(t), axis=0) * 1e-4
    place = np.cumsum(speed, axis=0) * 1e-4
    assert np.abs(place).max() < 2 * 3 * 0.1


def test_six_positions_point_every_axis_up():
    imu, truth = simulate_imu(waypoints(SIX_POSITIONS, dwell=1.0), np.random.default_rng(0))
    at_rest = imu.accel[truth.rest] / 9.80665
    found = {tuple(np.round(row).astype(int)) for row in at_rest}
    assert found == {(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)}


def test_perfect_sensors_say_the_truth(rng):
    imu, truth = simulate_imu(tumble(5.0, rng), rng)
    np.testing.assert_array_equal(imu.gyro, truth.angular_rate)
    np.testing.assert_array_equal(imu.accel, truth.specific_force)
    np.testing.assert_allclose(
        rotate(truth.world_q_body, imu.mag), np.tile([0, 22, -42], (len(imu), 1)), atol=1e-9
    )


def test_errors_are_those_declared(rng):
    gain = np.eye(3) + 0.05 * rng.normal(size=(3, 3))
    errors = ImuErrors(
        gyro_bias=(0.1, 0.2, 0.3),
        accel_matrix=gain,
        accel_bias=(0.5, 0.0, 0.0),
        mag_offset=(5.0, -3.0, 1.0),
        gyro_per_degree=(0.01, 0.0, 0.0),
    )
    imu, truth = simulate_imu(tumble(5.0, rng), rng, errors=errors, temperature=35.0)
    np.testing.assert_allclose(imu.gyro - truth.angular_rate, np.tile([0.2, 0.2, 0.3], (len(imu), 1)))
    np.testing.assert_allclose(imu.accel, truth.specific_force @ gain.T + [0.5, 0, 0])
    np.testing.assert_allclose(imu.mag - truth.field, np.tile([5.0, -3.0, 1.0], (len(imu), 1)))
    np.testing.assert_array_equal(imu.temperature, 35.0)


def test_white_noise_and_walk_have_the_declared_size(rng):
    noise = ImuNoise(0.001, 0.02, 0.01, 0.0)
    imu, truth = simulate_imu(stationary(2000.0), rng, rate=50.0, errors=ImuErrors(noise=noise), field=None)
    white = imu.gyro - truth.gyro_bias
    np.testing.assert_allclose(white.std(axis=0), 0.001 * np.sqrt(50.0), rtol=0.02)
    np.testing.assert_allclose((imu.accel - truth.specific_force).std(axis=0), 0.02 * 50**0.5, rtol=0.02)
    np.testing.assert_allclose(np.diff(truth.gyro_bias, axis=0).std(axis=0), 0.01 / 50**0.5, rtol=0.02)
    assert imu.mag is None


def test_converter_rounds_and_saturates(rng):
    errors = ImuErrors(gyro_lsb=0.01, gyro_range=1.0, mag_lsb=0.15)
    imu, _ = simulate_imu(constant_rate(5.0, (0.123, 3.0, 0.0)), rng, errors=errors, mag_every=4)
    np.testing.assert_allclose(imu.gyro[:, 0], 0.12)
    np.testing.assert_array_equal(imu.gyro[:, 1], 1.0)
    assert np.isfinite(imu.mag[::4]).all()
    assert np.isnan(imu.mag[1::4]).all()


def test_disturbance_and_jitter(rng):
    def near_iron(t):
        return np.where((t > 2.0)[:, None], [10.0, 0.0, 0.0], 0.0)

    imu, truth = simulate_imu(stationary(5.0), rng, disturbance=near_iron, jitter=0.001)
    assert imu.mag[-1, 0] == pytest.approx(10.0)
    assert 0.0005 < imu.dt.std() < 0.003
    np.testing.assert_array_equal(imu.t, truth.t)


def test_bad_settings():
    with pytest.raises(DataError, match="must be positive"):
        simulate_imu(stationary(1.0), np.random.default_rng(0), rate=0.0)
    with pytest.raises(DataError, match="positive number of seconds"):
        stationary(-1.0)
    with pytest.raises(ShapeError, match="3 components"):
        simulate_imu(stationary(1.0), np.random.default_rng(0), errors=ImuErrors(gyro_bias=(1.0, 2.0)))
    with pytest.raises(ShapeError, match="quaternions"):
        waypoints(np.zeros((2, 3)))
