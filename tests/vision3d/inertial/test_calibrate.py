"""Camera-IMU calibration against simulated truth: near, honest, and robust."""

from dataclasses import replace

import numpy as np
import pytest
from cam_imu_worlds import errors, recorded, within

from factorlab.cam_imu.checked import checked
from sequential.noise import ImuNoise
from vision3d.inertial.simulated import Rig


@pytest.fixture(scope="module")
def world():
    return recorded(0)


@pytest.fixture(scope="module")
def found(world):
    return world.calibrated()


def test_the_truth_comes_out(world, found):
    assert found.adjusted.settled
    assert within(world, found)
    state = found.adjusted.state
    cosine = (
        state.gravity
        @ world.motion.gravity
        / np.linalg.norm(state.gravity)
        / np.linalg.norm(world.motion.gravity)
    )
    assert np.degrees(np.arccos(cosine)) < 0.2
    np.testing.assert_allclose(state.gyro_bias.mean(axis=0), world.rig.gyro_bias, atol=1e-3)
    np.testing.assert_allclose(state.accel_bias.mean(axis=0), world.rig.accel_bias, atol=0.05)


def test_the_noise_of_every_sensor_is_found(world, found):
    dt = 0.01
    assert found.problem.gyro_sigma * dt**0.5 == pytest.approx(world.rig.noise.gyro_density, rel=0.06)
    assert found.problem.accel_sigma * dt**0.5 == pytest.approx(world.rig.noise.accel_density, rel=0.06)
    assert found.problem.corner_scale == pytest.approx(1.0, rel=0.05)


def test_turns_alone_find_clocks_and_rotation(world, found):
    aligned = found.aligned
    assert abs(aligned.time_offset_s - world.rig.time_offset_s) < 2e-3
    assert aligned.correlation > 0.98
    assert 0.95 < aligned.gain < 1.05


@pytest.mark.slow
def test_the_uncertainty_is_honest(seeds):
    """NEES of the seven over many recordings: 7 on average where the covariance is right."""
    values, z = [], []
    for seed in list(seeds)[:8] if len(seeds) < 50 else seeds:
        world = recorded(100 + seed, seconds=8.0)
        found = world.calibrated(knots_per_s=9.0)
        error = errors(world, found)
        values.append(error @ np.linalg.solve(found.cov[:7, :7], error))
        z.append(error / found.std[:7])
    mean, spread = np.mean(values) / 7.0, np.sqrt(2.0 / 7.0 / len(values))
    assert abs(mean - 1.0) < 4.0 * spread
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.5


@pytest.mark.parametrize("model", ["scale", "scale-misalignment"])
def test_gains_and_misalignment_are_found(model):
    rng = np.random.default_rng(4)
    accel, gyro = np.diag([1.012, 0.991, 1.006]), np.diag([0.985, 1.01, 1.004])
    if model == "scale-misalignment":
        accel[np.tril_indices(3, -1)] = 0.004, -0.006, 0.005
        gyro = gyro + 0.006 * rng.normal(size=(3, 3))
    world = recorded(2, seconds=16.0, rig=Rig(accel_matrix=accel, gyro_matrix=gyro))
    found = world.calibrated(imu_model=model)
    assert within(world, found, degrees=0.15, millimetres=4.0, milliseconds=0.2)
    state, names = found.adjusted.state, found.names
    std = dict(zip(names, found.std, strict=True))
    for name, estimate, truth in (
        ("accel_matrix", state.accel_matrix, accel),
        ("gyro_matrix", state.gyro_matrix, gyro),
    ):
        for i, j in zip(*np.nonzero(truth), strict=True):
            sigma = std[f"{name}.{i}{j}"]
            assert sigma < 0.01
            assert abs(estimate[i, j] - truth[i, j]) < 4.0 * sigma


def test_unmodelled_gains_show_where_they_are_estimated():
    """An IMU whose gains are off is calibrated worse without them than with them."""
    world = recorded(2, seconds=10.0, rig=Rig(accel_matrix=1.02 * np.eye(3)))
    plain, scaled = (world.calibrated(imu_model=model) for model in ("calibrated", "scale"))
    assert scaled.problem.accel_sigma < 0.8 * plain.problem.accel_sigma


def test_bias_walks_come_from_the_noise_file(world):
    noise = ImuNoise(1.6e-4, 2e-3, 1e-7, 1e-6)
    still = world.calibrated(noise=noise)
    assert still.walk.gyro == 1e-7
    drift = np.ptp(still.adjusted.state.gyro_bias, axis=0)
    assert (drift < 1e-5).all()


def test_more_knots_change_little(world, found):
    denser = world.calibrated(knots_per_s=25.0)
    difference = np.abs(errors(world, denser) - errors(world, found))
    assert (difference < 1.5 * found.std[:7]).all()


def test_a_trajectory_is_that_of_the_truth(world, found):
    t = np.linspace(1.0, 11.0, 50)
    R, rate, position, _, acceleration = found.adjusted.state.motion(t + found.time_offset_s)
    truth = world.motion.pose(t)
    np.testing.assert_allclose(position, truth[:, 4:], atol=5e-3)
    np.testing.assert_allclose(rate, world.motion.rate(t), atol=0.01)
    lifted = np.einsum("nji,nj->ni", R, acceleration - found.adjusted.state.gravity)
    np.testing.assert_allclose(lifted, world.motion.specific_force(t), atol=0.15)


def test_the_board_is_measured_by_the_accelerometer(world):
    corners = replace(world.corners, points=world.corners.points / 1.1)
    found = checked(world.changed(corners=corners).calibrated())
    assert found.board_scale == pytest.approx(1.1, abs=4.0 * found.board_scale_std)
    assert found.board_scale_std < 0.01
