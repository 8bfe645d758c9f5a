"""Mahony's filter in fixed point against the one in double precision, on equal rounded samples."""

import numpy as np
import pytest
from core_library import samples_q
from fixed_filters import FixedFilter, degrees_between, in_si, resampled
from mahony_port import SETTINGS, SOURCES, STATE, still

from sequential.attitude import Mahony

DERIVED = 44  # bytes on this machine
REST, REJECTED = 1, 2
RECORDINGS = ("broad:01", "broad:07", "broad:16", "broad:21", "broad:24", "broad:29", "xio")


@pytest.fixture(scope="session")
def filter_q(c_compiler, tmp_path_factory):
    return FixedFilter(c_compiler, tmp_path_factory.mktemp("mahony_q"), "mahony", STATE, SETTINGS, SOURCES)


def double(recording, **settings):
    return Mahony(magnetometer=False, **settings).estimate(recording)


def lengths(attitudes):
    return np.linalg.norm(attitudes, axis=1)


@pytest.mark.parametrize("name", RECORDINGS)
def test_three_minutes_of_a_recording(filter_q, data_dir, name):
    samples, recording = resampled(name, field=False)
    states, q = filter_q.run(samples)
    reference = double(recording)
    off = degrees_between(q, reference.world_q_body)
    assert np.sqrt(np.mean(off**2)) <= 0.05
    assert off.max() <= 0.15
    assert np.abs(states["bias"] / 2.0**32 - reference.gyro_bias).max() <= 2e-5
    assert ((states["status"] & REST > 0) != reference.rest).sum() <= 5
    assert np.abs(lengths(q) - 1).max() <= 1e-4


@pytest.mark.parametrize("changed", [
    {"gain": 2.0, "integral_gain": 0.01}, {"error_limit": 0.3, "lasting_time": 5.0},
    {"start_time": 0.0}, {"start_gain": 3.0, "start_time": 8.0}, {"rest_time": 1000.0},
    {"rest_constant": 4.0, "rest_gyro": 0.1, "rest_accel": 1.5}, {"bias_limit": 0.003},
])  # fmt: skip
def test_other_settings_are_those_of_the_double_filter(filter_q, data_dir, changed):
    samples, recording = resampled("broad:07", field=False, part=(0, 60))
    states, q = filter_q.run(samples, **changed)
    reference = double(recording, **changed)
    assert degrees_between(q, reference.world_q_body).max() <= 0.1
    assert np.abs(states["bias"] / 2.0**32 - reference.gyro_bias).max() <= 5e-5


@pytest.mark.parametrize("rate", [72, 100, 200, 500, 1000])
def test_other_rates(filter_q, data_dir, rate):
    samples, recording = resampled("broad:16", rate, field=False, part=(20, 40))
    _, q = filter_q.run(samples, rate=rate)
    assert degrees_between(q, double(recording).world_q_body).max() <= 0.1


def test_constants_at_100_hz_are_what_derive_gives(filter_q):
    derived, ours = filter_q.constants(DERIVED)
    assert derived == ours


def test_start_is_level_and_faces_north(filter_q, rng):
    accel = rng.normal(size=(500, 3)) * np.geomspace(0.3, 60, 500)[:, None]
    samples = samples_q(np.zeros((500, 3)), accel)
    for sample in samples[:, None]:
        _, q = filter_q.run(sample)
        start = Mahony().start([0, 0, 0], sample["accel"][0] / 256.0)[:4]
        assert degrees_between(q, start[None]).max() <= 0.05


def test_a_bias_winds_up_to_its_limit_only(filter_q):
    """The accelerometer pulls for ten minutes where the gyro says that nothing turns."""
    count = 60_000
    samples = still(count, accel=(6.0, -3.0, 8.0))
    samples["gyro"] = np.round([0.2 * 2**24, -0.15 * 2**24, 0.09 * 2**24])
    settings = {"integral_gain": 0.05, "rest_time": 1000.0}
    states, q = filter_q.run(samples, **settings)
    reference = double(in_si(samples), **settings)
    bias = states["bias"] / 2.0**32
    assert np.abs(bias).max() <= 0.1 + 1e-7
    assert np.abs(bias).max() >= 0.099, "wound up"
    assert np.abs(bias - reference.gyro_bias).max() <= 1e-3
    assert degrees_between(q, reference.world_q_body)[:6000].max() <= 0.1


def test_turns_on_while_samples_are_missing(filter_q, data_dir):
    """Samples that dropped out are turned by as one that stands for their periods, in both filters."""
    samples, recording = resampled("broad:16", field=False, part=(0, 90))
    kept = np.arange(len(samples))
    kept = kept[(kept % 97 > 4) | (kept < 400)]
    periods = np.diff(kept, prepend=kept[0])
    states, q = filter_q.run(np.ascontiguousarray(samples[kept]), periods)
    reference = double(recording.select(kept))
    off = degrees_between(q, reference.world_q_body)
    assert off.max() <= 0.1
    assert ((states["status"] & REST > 0) != reference.rest).mean() <= 2e-3


def test_over_a_pause_nothing_turns_and_the_start_begins_anew(filter_q):
    samples = still(600, gyro=(0.0, 0.0, 1.0))
    periods = np.ones(600, dtype=np.uint8)
    periods[0], periods[400], periods[500] = 0, 101, 255
    states, q = filter_q.run(samples, periods)
    assert (q[400] == q[399]).all()
    assert states["start_left"][399] == 0
    assert states["start_left"][400] == 300
    assert states["start_left"][499] == 201
    assert states["start_left"][500] == 300


def test_without_accelerometer_the_gyro_goes_on(filter_q):
    samples = still(500, gyro=(0.0, 0.5, 0.0))
    samples["accel"][100:] = 0
    states, q = filter_q.run(samples, start_time=0.0)
    assert (states["status"][101:] == REJECTED).all()
    assert (states["still"][101:] == 0).all()
    turned = degrees_between(q[100:101], q[-1:])[0]
    assert turned == pytest.approx(np.degrees(0.5 * 3.99), rel=2e-4)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("rate_deg_s", [2000.0, -2000.0])
def test_two_thousand_degrees_a_second(filter_q, axis, rate_deg_s):
    """Nothing overflows; the difference is the double filter's fifth order, which both leave out."""
    gyro = np.zeros(3)
    gyro[axis] = np.radians(rate_deg_s)
    samples = still(300, gyro=gyro, accel=(0.0, 0.0, 0.0))
    _, q = filter_q.run(samples)
    assert degrees_between(q, double(in_si(samples)).world_q_body).max() <= 0.3
    assert np.abs(lengths(q) - 1).max() <= 1e-3


def test_a_gyro_beyond_its_range_is_held_at_the_limit(filter_q):
    samples = still(200, accel=(0.0, 0.0, 0.0))
    samples["gyro"][:] = 2**31 - 1, -(2**31), 2**31 - 1
    _, q = filter_q.run(samples)
    most = still(200, gyro=(64.0, -64.0, 64.0), accel=(0.0, 0.0, 0.0))
    most["gyro"][:, [0, 2]] -= 1
    assert (q == filter_q.run(most)[1]).all()


def test_a_stuck_gyro_becomes_bias_at_rest_within_the_limit_only(filter_q):
    for stuck, learnt in ((0.08, True), (0.15, False)):
        states, _ = filter_q.run(still(2000, gyro=(stuck, 0.0, 0.0)), integral_gain=0.0)
        off = abs(states["bias"][-1, 0] / 2.0**32 - stuck)
        assert (off < 1e-4) == learnt
        assert (states["status"][-1] & REST > 0) == learnt


def test_any_state_and_sample_are_defined(filter_q, rng):
    """The library is built to stop at undefined behaviour."""
    count = 20_000
    states = np.frombuffer(rng.bytes(64 * count), dtype=filter_q.state).copy()
    samples = np.frombuffer(rng.bytes(24 * count), dtype=still(1).dtype).copy()
    after = filter_q.steps(states, samples, rng.integers(0, 4, count))
    assert (after["q"] != states["q"]).any()


def test_a_length_that_is_wrong_is_mended(filter_q, rng):
    start, _ = filter_q.run(still(400))
    states = np.repeat(start[-1:], 50)
    states["q"] = (rng.uniform(0.75, 1.25, 50)[:, None] * 2**30 * [0.8, 0.6, 0.0, 0.0]).astype(np.int32)
    for _ in range(4):
        states = filter_q.steps(states, still(50), np.ones(50))
    assert np.abs(lengths(states["q"] / 2.0**30) - 1).max() <= 1e-4


@pytest.mark.slow
def test_an_hour_and_more_without_drift(filter_q, data_dir, pytestconfig):
    samples, _ = resampled("broad:21", field=False)
    rounds = 8_640_000 // len(samples) if pytestconfig.getoption("--full") else 40
    last, length = filter_q.soak(samples, rounds)
    assert abs(length - 1).max() <= 1e-4
    assert np.abs(last["bias"] / 2.0**32).max() <= 0.1
