"""The complementary filter in fixed point against the one in double precision, on equal rounded samples."""

import numpy as np
import pytest
from core_library import samples_q
from fixed_filters import FixedFilter, degrees_between, in_si, resampled

from sequential.attitude import ComplementaryAttitude

STATE = [("q", "<i4", 4), ("since_field", "<u2"), ("heading_known", "u1"), ("status", "u1")]
SETTINGS = ("time_constant", "heading_time_constant")
DERIVED = 16
ACCEL_REJECTED = 2
G = 9.81


@pytest.fixture(scope="session")
def filter_q(c_compiler, tmp_path_factory):
    folder = tmp_path_factory.mktemp("complementary_q")
    return FixedFilter(c_compiler, folder, "complementary", STATE, SETTINGS, ("complementary_q_derive.c",))


def error(filter_q, samples, recording, *, rate=100, periods=None, **settings):
    """Degrees (N,) to the double filter, and how far from unit length."""
    _, q = filter_q.run(samples, periods, rate, **settings)
    assert np.abs(np.linalg.norm(q, axis=1) - 1).max() < 2e-5
    return degrees_between(q, ComplementaryAttitude(**settings).estimate(recording).world_q_body)


def still(count, gyro=(0.0, 0.0, 0.0), accel=(0.0, 0.0, G), mag=None):
    """Samples (N,) that say the same."""
    field = None if mag is None else np.tile(mag, (count, 1))
    return samples_q(np.tile(gyro, (count, 1)), np.tile(accel, (count, 1)), field)


@pytest.mark.parametrize("name", ["broad:01", "broad:07", "broad:16", "broad:21", "broad:29", "xio"])
def test_three_minutes_of_a_recording(filter_q, data_dir, name):
    """Without a field the heading gathers the rounding of all turns, with one it does not."""
    off = error(filter_q, *resampled(name, field=False))
    assert np.sqrt(np.mean(off**2)) <= 0.03
    assert off.max() <= 0.05
    off = error(filter_q, *resampled(name))
    assert np.sqrt(np.mean(off**2)) <= 0.006
    assert off.max() <= 0.02


@pytest.mark.parametrize(("rate", "settings"), [
    (50, {}), (200, {}), (400, {"time_constant": 0.5}), (100, {"time_constant": 0.03}),
    (100, {"time_constant": 60.0, "heading_time_constant": 1.0}),
])  # fmt: skip
def test_other_rates_and_time_constants(filter_q, data_dir, rate, settings):
    off = error(filter_q, *resampled("broad:16", rate, part=(60.0, 90.0)), rate=rate, **settings)
    assert off.max() <= 0.04


def test_samples_that_drop_out(filter_q, data_dir, rng):
    """A sample stands for the periods before it; over more than a second nothing is integrated."""
    samples, recording = resampled("broad:21", part=(40.0, 100.0))
    kept = np.flatnonzero(rng.random(len(samples)) < 0.5)
    kept = kept[(kept < 1000) | (kept > 1150)]
    periods = np.minimum(np.diff(kept, prepend=kept[0]), 255)
    assert periods.max() > 100
    off = error(filter_q, np.ascontiguousarray(samples[kept]), recording.select(kept), periods=periods)
    assert off.max() <= 0.03


def test_a_field_that_comes_seldom(filter_q, data_dir):
    samples, _ = resampled("broad:29", part=(0.0, 60.0))
    samples["mag"][np.arange(len(samples)) % 37 != 5] = 0
    assert error(filter_q, samples, in_si(samples)).max() <= 0.02


def test_no_accelerometer_turns_by_the_gyro_alone(filter_q):
    samples = still(1001, gyro=(0.3, 0.0, 0.0), accel=(0.0, 0.0, 0.0))
    states, q = filter_q.run(samples)
    assert (states["status"] == ACCEL_REJECTED).all()
    turned = np.column_stack([np.cos(1.5), np.sin(1.5), 0, 0])
    assert degrees_between(q[-1:], turned) < 0.001


@pytest.mark.parametrize(
    "accel", [(-128.0, 127.0, 127.9), (127.9, -128.0, 0.0), (0.0, 0.0, -G), (1 / 256, 0, 0)]
)
def test_extreme_forces_are_directions(filter_q, accel):
    samples = still(500, gyro=(1.0, -2.0, 0.5), accel=accel)
    assert error(filter_q, samples, in_si(samples)).max() <= 0.01


@pytest.mark.parametrize("rate", [2000.0, -2000.0])
def test_two_thousand_degrees_a_second(filter_q, rate):
    samples = still(1000, gyro=np.radians([rate, rate, rate]))
    assert error(filter_q, samples, in_si(samples)).max() <= 0.08, "after 96 turns"


def test_a_stuck_gyro_is_off_by_its_reading_times_tau(filter_q):
    states, q = filter_q.run(still(6000, gyro=(0.02, 0.0, 0.0)))
    roll = np.degrees(2 * np.arctan2(q[-1, 1], q[-1, 0]))
    assert roll == pytest.approx(np.degrees(0.02 * 5.0), rel=2e-3)
    assert not states["status"].any()


def test_a_vertical_field_tells_no_heading(filter_q):
    field = (0.01, 0.0, -48.0)
    with_field, _ = filter_q.run(still(200, gyro=(0.0, 0.0, 0.1), mag=field))
    without, _ = filter_q.run(still(200, gyro=(0.0, 0.0, 0.1)))
    np.testing.assert_array_equal(with_field["q"], without["q"])
    assert not with_field["heading_known"].any()


@pytest.mark.slow
def test_a_day_without_drift_of_the_length(filter_q, data_dir, pytestconfig):
    """A day at 100 Hz with --full, three hours otherwise; overflow would end the process."""
    samples, _ = resampled("broad:16")
    rounds = (8_640_000 if pytestconfig.getoption("--full") else 1_000_000) // len(samples) + 1
    last, length = filter_q.soak(samples, rounds)
    np.testing.assert_allclose(length, 1.0, atol=5e-5)
    up = [2 * (q[1] * q[3] - q[0] * q[2]) for q in last["q"][[1, -1]] / 2.0**30]
    assert up[0] == pytest.approx(up[1], abs=1e-4), "the tilt at the end of a round stays"


def test_any_state_sample_and_number_of_periods(filter_q, rng):
    """Bits of any kind: nothing overflows (the library traps it), and the length comes back."""
    count = 20_000
    states = np.frombuffer(rng.bytes(count * filter_q.state.itemsize), filter_q.state).copy()
    samples = np.frombuffer(rng.bytes(count * 24), samples_q(np.zeros((1, 3)), np.zeros((1, 3))).dtype).copy()
    states["q"][: count // 2] = rng.choice([-(2**31), 2**31 - 1, 0, 1, 2**30], (count // 2, 4))
    samples["accel"][::3] = rng.choice([-(2**15), 2**15 - 1, 0, 1], samples["accel"][::3].shape)
    filter_q.steps(states, samples, rng.integers(0, 256, count))
    near = states[count // 2 :]
    near["q"] = rng.normal(0, 2**28.5, near["q"].shape)
    for _ in range(40):
        near = filter_q.steps(near, samples[count // 2 :], np.ones(len(near)))
    lengths = np.linalg.norm(near["q"] / 2.0**30, axis=1)
    np.testing.assert_allclose(lengths, 1.0, atol=1e-4)


def test_constants_of_the_header_are_the_derived_ones(filter_q):
    derived, written = filter_q.constants(DERIVED)
    assert derived[:13] == written[:13]
