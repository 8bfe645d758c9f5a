"""The float filters of the core on an emulated Cortex-M4F: the host's bits, in the instructions allowed."""

import numpy as np
import pytest
from float_filters import COMPLEMENTARY, MAHONY, TILT, FloatFilter, recorded_table

from factorlab.firmware.instructions import count_instructions, imu_f32
from sequential.attitude import ComplementaryAttitude, Mahony, TiltKalman
from sequential.readers import read_broad

PERIOD = float(np.float32(0.01))
ROWS = 6000
BUDGET = {"mahony_f32_step": 260, "mahony_f32_step_6d": 200, "mahony_f32_step_published": 110}
"""Instructions an update, on average over the recording."""
PAIRS = {"complementary": COMPLEMENTARY, "kalman": TILT, "mahony": MAHONY}
PYTHON = {"complementary": ComplementaryAttitude(), "kalman": TiltKalman(), "mahony": Mahony()}


@pytest.fixture(scope="module", name="folder")
def of_what_is_compiled(tmp_path_factory):
    return tmp_path_factory.mktemp("core")


@pytest.fixture(scope="module", name="recording")
def some_of_a_fast_trial(data_dir):
    """Every third sample: 95 Hz, counted as 100; begins at rest."""
    (path,) = (data_dir / "imu" / "broad").glob("07_*.npz")
    return read_broad(path)[0].select(slice(0, 3 * ROWS, 3))


@pytest.mark.usefixtures("arm_toolchain", "qemu")
@pytest.mark.parametrize("name", PAIRS)
def test_single_precision_is_the_host_s_bit_for_bit(name, recording, c_compiler, folder):
    on_target = count_instructions(PAIRS[name].name, imu_f32(recording))
    own = FloatFilter(PAIRS[name], c_compiler, folder)
    own.call("defaults", own.settings)
    own.call("derive", own.settings, own.derived)
    samples, _ = recorded_table(recording, None)
    found = np.array(list(own.run(samples, np.where(np.arange(len(samples)), PERIOD, 0.0))))
    np.testing.assert_array_equal(found.astype(np.float32), on_target.raw)


@pytest.mark.usefixtures("arm_toolchain", "qemu")
@pytest.mark.parametrize(("step", "must"), BUDGET.items())
def test_mahony_keeps_its_budget(step, must, recording):
    counts = count_instructions("mahony_f32", imu_f32(recording), step=step)
    assert counts.mean <= must
