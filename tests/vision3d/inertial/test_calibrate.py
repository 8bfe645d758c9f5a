"""Camera-IMU calibration against simulated truth: near, honest, and robust."""

import numpy as np
import pytest
from cam_imu_worlds import errors, recorded, within


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
