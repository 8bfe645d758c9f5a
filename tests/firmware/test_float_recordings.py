"""Whole recordings through the float filters of the core: near the double filters all the way."""

import numpy as np
import pytest
from float_filters import COMPLEMENTARY, MAHONY, TILT, FloatFilter, recorded_table, single_settings

from sequential.attitude import ComplementaryAttitude, Mahony, TiltKalman
from sequential.manifold.quaternion import quaternion_inverse, quaternion_log, quaternion_multiply
from sequential.readers import read_broad

CASES = {
    "complementary": (COMPLEMENTARY, ComplementaryAttitude()),
    "kalman": (TILT, TiltKalman()),
    "mahony": (MAHONY, Mahony()),
}
NEAR = {"complementary": 0.002, "kalman": 0.01, "mahony": 0.01}
"""RMS of the angle between both, degrees: a hundredth of what the filters are right to."""


@pytest.fixture(scope="module", name="folder")
def of_what_is_compiled(tmp_path_factory):
    return tmp_path_factory.mktemp("core")


@pytest.mark.parametrize("trial", ["01", "07", "16", "21", "29"])
@pytest.mark.parametrize("name", CASES)
def test_a_recording_stays_with_the_double_filter(name, trial, data_dir, c_compiler, folder):
    pair, python = CASES[name]
    (path,) = (data_dir / "imu" / "broad").glob(f"{trial}_*.npz")
    recording = read_broad(path)[0]
    samples, dt = recorded_table(recording, python.magnetometer)
    own = FloatFilter(pair, c_compiler, folder)
    own.use(single_settings(python))
    found = np.array(list(own.run(samples, dt)))
    expected = python.estimate(recording).world_q_body
    between = np.linalg.norm(quaternion_log(quaternion_multiply(quaternion_inverse(expected), found)), axis=1)
    assert np.degrees(np.sqrt(np.mean(between**2))) < NEAR[name]
    assert np.abs(np.linalg.norm(found, axis=1) - 1).max() < 5e-7
