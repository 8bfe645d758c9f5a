from dataclasses import replace

import numpy as np
import pytest

from sequential.errors import DataError, MissingStreamError, UnderConstrainedError
from sequential.manifold.quaternion import quaternion_exp, rotation_matrix
from sequential.readers import read_broad
from sequential.sensors import (
    ImuErrors,
    MagnetometerEllipsoid,
    align_field,
    constant_rate,
    simulate_imu,
    tumble,
)

SOFT = np.array([[1.1, 0.05, 0.0], [0.05, 0.95, 0.02], [0.0, 0.02, 1.0]])
SMALL = rotation_matrix(quaternion_exp(np.radians([3.0, -5.0, 8.0])))
EXCHANGED = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])  # as in an MPU-9250


def board(rng, mag_R_body, *, motion=None, sigma=0.4, noise_free=False):
    errors = ImuErrors(
        gyro_bias=(0.005, -0.003, 0.002),
        mag_matrix=SOFT @ mag_R_body,
        mag_offset=(10.0, -20.0, 5.0),
        mag_sigma=sigma,
    )
    return simulate_imu(motion or tumble(120.0, rng), rng, errors=errors).recording


def angle(a, b):
    return np.degrees(np.arccos(np.clip((np.trace(a.T @ b) - 1) / 2, -1, 1)))


@pytest.mark.parametrize("using", ["gyro", "accel"])
@pytest.mark.parametrize("mag_R_body", [np.eye(3), SMALL.T, EXCHANGED, EXCHANGED @ SMALL.T])
def test_the_rotation_is_found(rng, using, mag_R_body):
    recording = board(rng, mag_R_body)
    done = align_field(MagnetometerEllipsoid(field=47.4).calibrate(recording), recording, using)
    assert angle(done.rotation @ mag_R_body, np.eye(3)) < 0.4
    assert angle(done.rotation @ mag_R_body, np.eye(3)) < 5 * np.degrees(np.sqrt(np.trace(done.cov)))
    # the whole chain: raw readings become the field in the body's frame
    np.testing.assert_allclose(done.fit.calibration.matrix @ SOFT @ mag_R_body, np.eye(3), atol=0.012)
    if using == "accel":
        np.testing.assert_allclose(np.degrees(done.dip), np.degrees(np.arctan2(42, 22)), atol=0.3)


def test_covariance_is_that_of_many_recordings(rng):
    scores = []
    for _ in range(12):
        recording = board(rng, SMALL.T, motion=tumble(40.0, rng), sigma=1.0)
        done = align_field(MagnetometerEllipsoid().calibrate(recording), recording)
        off = SMALL.T @ done.rotation
        error = np.array([off[2, 1], off[0, 2], off[1, 0]])
        scores.append(error @ np.linalg.solve(done.cov, error))
    assert 1.0 < np.mean(scores) < 9.0  # 3; windows share the constants' error


def test_the_norm_stays_and_the_matrix_turns(rng):
    recording = board(rng, SMALL.T)
    fit = MagnetometerEllipsoid().calibrate(recording)
    done = align_field(fit, recording)
    np.testing.assert_allclose(done.fit.calibration.matrix, done.rotation @ fit.calibration.matrix)
    np.testing.assert_allclose(
        np.linalg.norm(done.fit.calibration.apply(recording.mag), axis=1),
        np.linalg.norm(fit.calibration.apply(recording.mag), axis=1),
    )
    assert np.linalg.eigvalsh(done.fit.calibration.cov)[0] > -1e-12
    assert not any("symmetric one" in f.what for f in done.fit.findings)


def test_a_sensor_that_is_missing_is_named(rng):
    recording = board(rng, np.eye(3))
    fit = MagnetometerEllipsoid().calibrate(recording)
    with pytest.raises(MissingStreamError, match="no gyro"):
        align_field(fit, replace(recording, gyro=None))
    with pytest.raises(DataError, match="'gyro' or 'accel'"):
        align_field(fit, recording, "sun")


def test_a_turn_about_one_axis_leaves_a_rotation_free(rng):
    fit = MagnetometerEllipsoid().calibrate(board(rng, np.eye(3)))
    still = board(rng, np.eye(3), motion=constant_rate(60.0, (0.0, 0.0, 1e-4)))
    with pytest.raises(UnderConstrainedError, match="0 turns"):
        align_field(fit, still)


def test_sensors_that_disagree_are_told(rng):
    recording = board(rng, np.eye(3))
    fit = MagnetometerEllipsoid().calibrate(recording)
    wrong = replace(recording, gyro=3 * recording.gyro)
    with pytest.raises(DataError, match="disagree"):
        align_field(fit, wrong)


def test_broad_board_is_aligned_by_construction(data_dir):
    """One sensor in one case: its magnetometer lies within degrees of its gyro."""
    (path,) = (data_dir / "imu" / "broad").glob("05_*.npz")
    imu, _ = read_broad(path)
    fit = MagnetometerEllipsoid().calibrate(imu)
    by = {using: align_field(fit, imu, using) for using in ("gyro", "accel")}
    assert np.degrees(by["gyro"].angle) < 2.0
    assert angle(by["gyro"].rotation, by["accel"].rotation) < 2.0
    np.testing.assert_allclose(np.degrees(by["accel"].dip), 69.5, atol=2.0)  # some 66° outdoors, indoors here
