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
    recorded_table,
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


@pytest.fixture(scope="module", name="folder")
def of_what_is_compiled(tmp_path_factory):
    return tmp_path_factory.mktemp("core")


@pytest.fixture(params=CASES, name="case")
def every_case(request):
    return CASES[request.param]


@pytest.mark.parametrize("trial", TRIALS)
def test_a_step_is_the_python_step(case, trial, data_dir, c_compiler, folder):
    pair, python = case
    (path,) = (data_dir / "imu" / "broad").glob(f"{trial}_*.npz")
    samples, dt = recorded_table(read_broad(path)[0], python.magnetometer)
    own = FloatFilter(pair, c_compiler, folder)
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
