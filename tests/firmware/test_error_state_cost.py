"""The error-state filter on a Cortex-M4F: the host's bits, and an exact count of what an update takes."""

import numpy as np
import pytest
from attitude_worlds import seen, still, swinging
from error_state_port import Port, build

from factorlab.firmware.instructions import count_instructions, imu_f32
from sequential.attitude import attitude_from_angles

MOST, MOST_TEXT = 3000, 6144  # instructions an update at 100 Hz, bytes
WORST = 6500  # an update with the field and the rest of a block


@pytest.mark.usefixtures("arm_toolchain", "qemu")
@pytest.mark.parametrize("resting", [True, False])
def test_an_update_takes_less_than_it_may_and_gives_the_host_s_bits(resting, rng, c_compiler, tmp_path):
    t, angles = swinging(6.0)
    moving = seen(t, attitude_from_angles(angles), rng=rng)
    recording = still((0.2, 0.1, 0.3), 6.0, rng=rng) if resting else moving
    counts = count_instructions("error_state_f32", imu_f32(recording), rate=100.0)
    settled = counts.instructions[300:]
    assert settled.mean() < MOST
    assert settled.max() < WORST
    assert np.median(settled) < 600
    assert sum(counts.text.values()) <= MOST_TEXT
    host = Port(build(c_compiler, tmp_path)).run(imu_f32(recording), np.where(np.arange(600), 0.01, 0.0))
    np.testing.assert_array_equal(host.world_q_body.astype(np.float32), counts.raw)
