"""BROAD's trials: the packed files decode to the published numbers."""

import json

import numpy as np
import pytest

from sequential.errors import FileFormatError
from sequential.readers import read_broad


@pytest.fixture
def trial(data_dir):
    return read_broad(data_dir / "imu" / "broad" / "01_undisturbed_slow_rotation_A.npz")


def test_units_and_shapes(trial):
    imu, truth = trial
    assert imu.rate == pytest.approx(2000 / 7, rel=1e-6)
    assert len(imu) == len(truth.movement) == 56940
    still = ~truth.movement
    # this accelerometer is 0.8 % too long
    assert np.linalg.norm(imu.accel[still], axis=1).mean() == pytest.approx(9.81, abs=0.15)
    assert np.abs(imu.gyro[still]).max() < 0.5
    assert 30 < np.median(np.linalg.norm(imu.mag, axis=1)) < 70


def test_truth_is_a_unit_quaternion_that_turns_gravity_up(trial):
    imu, truth = trial
    seen = np.isfinite(truth.world_q_body).all(axis=1)
    q = truth.world_q_body[seen]
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-12)
    w, x, y, z = q.T
    up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
    still = ~truth.movement[seen]
    force = imu.accel[seen][still]
    cosine = np.einsum("ij,ij->i", up[still], force) / np.linalg.norm(force, axis=1)
    assert np.rad2deg(np.arccos(np.median(cosine))) < 2.0


def test_groups_file_is_no_trial(data_dir, tmp_path):
    assert json.loads((data_dir / "imu" / "broad" / "trials.json").read_text())["groups"]
    other = tmp_path / "other.npz"
    np.savez(other, gyr=np.zeros(3))
    with pytest.raises(FileFormatError, match="lacks acc, mag"):
        read_broad(other)
