"""One step of a float filter of the core is one step of the Python filter, from an equal state."""

from dataclasses import replace

import numpy as np
import pytest
from float_filters import (
    COMPLEMENTARY,
    MAHONY,
    STEP_TOLERANCE,
    TILT,
    FloatFilter,
    published_seen,
    single_settings,
)

from sequential.attitude import ComplementaryAttitude, Mahony, TiltKalman
from sequential.readers import read_broad

CASES = {
    "complementary 9-D": (COMPLEMENTARY, ComplementaryAttitude()),
    "complementary 6-D": (COMPLEMENTARY, ComplementaryAttitude(magnetometer=False)),
    "complementary, slow and quick": (COMPLEMENTARY, ComplementaryAttitude(None, 0.02, 0.5)),
    "kalman 9-D": (TILT, TiltKalman()),
    "kalman 6-D": (TILT, TiltKalman(magnetometer=False)),
    "kalman, gated": (TILT, TiltKalman(gate=0.99)),
    "mahony 9-D": (MAHONY, Mahony()),
    "mahony 6-D": (replace(MAHONY, suffix="_step_6d"), Mahony(magnetometer=False)),
    "mahony as published": (MAHONY, Mahony.as_published(0.7, 0.001)),
    "mahony as published, 6-D": (
        replace(MAHONY, suffix="_step_published", seen=published_seen),
        Mahony.as_published(0.7, 0.001, magnetometer=False),
    ),
}
TRIALS = ("07", "21", "29")
"""Fast, long with a wandering bias, and disturbed by a magnet."""


@pytest.fixture(params=CASES, name="case")
def every_case(request):
    return CASES[request.param]


def table(recording, magnetometer):
    """Samples (N, 9) of single precision, and dt (N,) with 0 first."""
    mag = recording.mag if magnetometer is not False else np.full_like(recording.gyro, np.nan)
    samples = np.hstack([recording.gyro, recording.accel, mag]).astype(np.float32)
    return samples, np.diff(recording.t, prepend=recording.t[0]).astype(np.float32) * np.float32(1e-9)


@pytest.mark.parametrize("trial", TRIALS)
def test_a_step_is_the_python_step(case, trial, data_dir, c_compiler, tmp_path):
    pair, python = case
    (path,) = (data_dir / "imu" / "broad").glob(f"{trial}_*.npz")
    samples, dt = table(read_broad(path)[0], python.magnetometer)
    own = FloatFilter(pair, c_compiler, tmp_path)
    python = single_settings(python)
    own.use(python)
    own.start(samples[0])
    worst, compared = 0.0, 0
    for k, (sample, step) in enumerate(zip(samples.astype(np.float64), dt, strict=True)):
        before = own.numbers
        own.step(samples[k], float(step))
        if k % 7 == 0 or k < 100:
            after = python.step(before, sample[:3], sample[3:6], sample[6:], float(step))
            expected, found = pair.seen(python, after), pair.seen(python, own.numbers)
            difference = np.abs(found - expected) / np.maximum(1.0, np.abs(expected))
            worst = max(worst, float(np.max(difference)))
            compared += 1
    assert compared > 3000
    assert worst <= STEP_TOLERANCE, f"{pair.name} differs by {worst:.2e} in one step"
