"""Mahony's filter in fixed point with magnetometer against the one in double precision."""

import numpy as np
import pytest
from core_library import compiled, pointer, samples_q
from fixed_filters import degrees_between, in_si, resampled
from mahony_port import SOURCES, G

from sequential.attitude import Mahony

DISTURBED = 4
LOOP = """
#include "mahony_q9.h"
void run(const struct imu_q *samples, const uint8_t *periods, int32_t count, uint16_t hz,
         const float *heading, int32_t *attitudes, int32_t *biases, uint8_t *status);
void run(const struct imu_q *samples, const uint8_t *periods, int32_t count, uint16_t hz,
         const float *heading, int32_t *attitudes, int32_t *biases, uint8_t *status)
{
    struct mahony_q9_settings settings;
    struct mahony_q9_derived derived;
    struct mahony_q9_state state;
    mahony_q_defaults_9d(&settings);
    settings.heading_gain = heading[0];
    settings.heading_gate = heading[1];
    settings.heading_timeout = heading[2];
    mahony_q_derive_9d(&settings, hz, &derived);
    mahony_q_start_9d(&state, &derived, samples);
    for (int32_t k = 0; k < count; k++) {
        mahony_q_step_9d(&state, &derived, &samples[k], periods[k]);
        mahony_q_attitude_9d(&state, &attitudes[4 * k]);
        for (int i = 0; i < 3; i++) {
            biases[3 * k + i] = state.tilt.bias[i];
        }
        status[k] = state.tilt.status;
    }
}
"""
FIELD = np.array([0.0, 20.0, -40.0])  # uT, to the north and down


@pytest.fixture(scope="session")
def core(c_compiler, tmp_path_factory):
    files = ("mahony_q.c", "mahony_q9.c", "mahony_q9_derive.c", "fixed_q.c", *SOURCES)
    return compiled(c_compiler, tmp_path_factory.mktemp("mahony_q9"), *files, text=LOOP)


def run(core, samples, periods=None, *, gain=0.05, gate=0.34906585, timeout=20.0, rate=100):
    """Attitudes (N, 4), biases (N, 3) and status (N,)."""
    count = len(samples)
    given = np.minimum(np.arange(count), 1) if periods is None else periods
    q, bias = np.zeros((count, 4), np.int32), np.zeros((count, 3), np.int32)
    status = np.zeros(count, np.uint8)
    heading = np.array([gain, gate, timeout], np.float32)
    core.run(pointer(samples), pointer(np.ascontiguousarray(given, np.uint8)), count, rate, pointer(heading),
             pointer(q), pointer(bias), pointer(status))  # fmt: skip
    return q / 2.0**30, bias / 2.0**32, status


def still(count, field=FIELD):
    return samples_q(np.zeros((count, 3)), np.tile([0, 0, G], (count, 1)), np.tile(field, (count, 1)))


@pytest.mark.parametrize("name", ["broad:01", "broad:07", "broad:21", "broad:29", "broad:34", "xio"])
def test_three_minutes_of_a_recording(core, data_dir, name):
    samples, recording = resampled(name)
    q, bias, status = run(core, samples)
    reference = Mahony(magnetometer=True).estimate(recording)
    off = degrees_between(q, reference.world_q_body)
    assert np.sqrt(np.mean(off**2)) <= 0.05
    assert off.max() <= 0.15
    assert np.abs(bias - reference.gyro_bias).max() <= 2e-5
    assert ((status & DISTURBED > 0) != reference.magnetic_disturbance).mean() <= 1e-3
    assert np.abs(np.linalg.norm(q[1:], axis=1) - 1).max() <= 1e-4


@pytest.mark.parametrize(
    ("gain", "gate", "timeout"), [(0.15, 0.6, 2.0), (0.02, 2.5, 20.0), (0.05, np.pi, 1.0)]
)
def test_other_settings_are_those_of_the_double_filter(core, data_dir, gain, gate, timeout):
    samples, recording = resampled("broad:34", part=(0, 80))
    q, _, _ = run(core, samples, gain=gain, gate=gate, timeout=timeout)
    double = Mahony(magnetometer=True, heading_gain=gain, heading_gate=gate, heading_timeout=timeout)
    assert degrees_between(q, double.estimate(recording).world_q_body).max() <= 0.15


@pytest.mark.parametrize("heading_deg", [-179.9, -90.0, -3.0, 0.0, 45.0, 135.0, 180.0])
def test_the_first_field_gives_the_heading(core, heading_deg):
    angle = np.radians(heading_deg)
    field = np.array([20.0 * np.sin(angle), 20.0 * np.cos(angle), -40.0])
    samples = still(3, field)
    q, _, _ = run(core, samples)
    reference = Mahony(magnetometer=True).estimate(in_si(samples)).world_q_body
    assert degrees_between(q, reference).max() <= 0.05


def test_a_magnetometer_slower_than_the_gyro(core, data_dir):
    samples, _ = resampled("broad:07", part=(20, 80))
    samples["mag"][np.arange(len(samples)) % 5 > 0] = 0
    q, _, _ = run(core, samples)
    reference = Mahony(magnetometer=True).estimate(in_si(samples)).world_q_body
    assert degrees_between(q, reference).max() <= 0.15


def test_without_a_field_it_is_the_filter_without_magnetometer(core, data_dir):
    samples, recording = resampled("broad:16", field=False, part=(0, 60))
    q, _, status = run(core, samples)
    reference = Mahony(magnetometer=False).estimate(recording).world_q_body
    assert degrees_between(q, reference).max() <= 0.05
    assert not (status & DISTURBED).any()


@pytest.mark.parametrize("field", [(0.0, 0.0, -40.0), (0.01, 0.01, 127.0), (0.0, 0.0, 0.0)])
def test_a_field_that_tells_no_heading_corrects_nothing(core, field):
    samples = still(600)
    samples["mag"][300:] = np.round(np.multiply(field, 256))
    q, _, _ = run(core, samples)
    assert degrees_between(q[300:], q[299]).max() <= 0.01


def test_a_disturbance_is_held_off_until_it_lasts(core):
    samples = still(4000)
    samples["mag"][500:] = np.round(np.multiply([20.0, 0.0, -40.0], 256))  # from the east
    q, _, status = run(core, samples, timeout=10.0)
    assert degrees_between(q[500:1495], q[499]).max() <= 0.01
    assert (status[500:1495] & DISTURBED).all()
    assert degrees_between(q[-1:], q[499])[0] >= 30.0


def test_any_sample_is_defined(core, rng):
    """The library is built to stop at undefined behaviour."""
    count = 20_000
    samples = np.frombuffer(rng.bytes(24 * count), dtype=still(1).dtype).copy()
    samples["mag"][rng.random(count) < 0.2] = 0
    q, _, _ = run(core, samples, rng.integers(0, 5, count))
    assert np.abs(np.linalg.norm(q[1:], axis=1) - 1).max() <= 0.1
