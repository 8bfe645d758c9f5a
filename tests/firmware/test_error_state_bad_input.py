"""The error-state filter in C on what sensors and clocks do wrong: as its header says, and as Python does."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest
from attitude_worlds import seen, still, swinging
from error_state_port import SAMPLE, STRICT, Port, build, samples_of

from sequential.attitude import attitude_from_angles
from sequential.evaluate import attitude_error
from sequential.manifold.quaternion import quaternion_inverse, rotate
from sequential.sensors import ImuRecording

DT = 0.01
APART = 0.1  # degrees between single and double precision
EXTREMES = np.array([0.0, -0.0, 1e-45, 1e-30, 1.0, 1e4, 1e9, 1e19, 3e38, np.inf, np.nan], np.float32)


@pytest.fixture(scope="module")
def port(c_compiler, tmp_path_factory):
    return Port(build(c_compiler, tmp_path_factory.mktemp("error_state"), *STRICT))


def moving(rng, seconds=20.0, mag=True):
    t, angles = swinging(seconds)
    return seen(t, attitude_from_angles(angles), mag=mag, rng=rng)


def as_samples(recording):
    return samples_of(recording.gyro, recording.accel, recording.mag)


def compared(port, recording, samples=None):
    """What C makes of a recording, and by how much Python's answer is off it where both stand, degrees."""
    dt = np.diff(recording.t, prepend=recording.t[:1]) * 1e-9
    c = port.run(as_samples(recording) if samples is None else samples, dt)
    python = port.design.estimate(recording)
    dots = np.abs((c.world_q_body * python.world_q_body).sum(1))
    return c, np.degrees(2 * np.arccos(np.minimum(dots, 1.0)))[~c.closing].max()


def numbers_of(struct):
    """Every number of a struct, those of the structs in it too."""
    for name, _ in struct._fields_:
        value = getattr(struct, name)
        yield from numbers_of(value) if isinstance(value, ctypes.Structure) else np.atleast_1d(value)


def assert_sane(state):
    """Every number finite, the quaternion of unit length, no negative variance."""
    assert np.isfinite(list(numbers_of(state))).all()
    assert np.linalg.norm(state.turn) == pytest.approx(1.0, abs=1e-5)
    assert np.linalg.norm(state.half) == pytest.approx(1.0, abs=1e-5)
    for name, n in (("tilt_cov", 10), ("heading_cov", 7)):
        assert (np.array(getattr(state, name))[np.arange(n) * (np.arange(n) + 3) // 2] >= 0).all(), name


def test_bad_readings_here_and_there_are_passed_over(port, rng):
    recording = moving(rng)
    accel, gyro, mag = (np.array(one) for one in (recording.accel, recording.gyro, recording.mag))
    accel[rng.choice(2000, 100)] = 0.0
    accel[rng.choice(2000, 100)] = np.nan
    mag[rng.choice(2000, 500)] = np.nan
    mag[rng.choice(2000, 100)] = 0.0
    gyro[rng.choice(np.arange(1, 2000), 60, replace=False)] = np.nan
    bad = replace(recording, accel=np.nan_to_num(accel), mag=mag)
    state = port.start(as_samples(bad)[0])
    samples = samples_of(gyro, accel, mag)
    c = port.run(samples, np.full(2000, DT), state)
    truth = attitude_from_angles(swinging(20.0)[1])
    assert attitude_error(c.world_q_body, truth).degrees[0] < 1.5
    assert_sane(state)


@pytest.mark.parametrize("gyro", [(np.nan, 0, 0), (0, np.inf, 0), (0, 0, -np.inf), (2000.0, 0, 0)])
def test_a_gyro_that_cannot_be_is_waited_for(port, gyro, rng):
    """The sample after turns for both."""
    samples = as_samples(moving(rng))
    state = port.start(samples[0])
    port.run(samples[:1003], np.full(1003, DT), state)
    skipped = samples[1003:1005].copy()
    skipped["gyro"][0] = gyro
    before, bias = np.array(state.turn), np.array(state.tilt)
    port.run(skipped[:1], [DT], state)
    np.testing.assert_array_equal(state.turn, before)
    np.testing.assert_array_equal(state.tilt, bias)
    assert state.unread
    port.run(skipped[1:], [DT], state)
    assert state.sums.elapsed == pytest.approx(2 * DT, abs=1e-6) or state.closing
    assert not state.unread


@pytest.mark.parametrize("limit", [9.0, 11.0, 20.0])
def test_a_saturated_accelerometer_is_an_acceleration_like_others(port, limit, rng):
    recording = moving(rng)
    shaken = recording.accel + 8.0 * rng.normal(size=recording.accel.shape)
    c, apart = compared(port, replace(recording, accel=np.clip(shaken, -limit, limit)))
    assert apart < APART
    truth = attitude_from_angles(swinging(20.0)[1])
    assert attitude_error(c.world_q_body, truth).degrees[0] < 15.0


@pytest.mark.parametrize("sensor", ["gyro", "accel", "mag"])
def test_a_stuck_sensor_is_what_python_makes_of_it(port, sensor, rng):
    recording = moving(rng)
    values = np.array(getattr(recording, sensor))
    values[800:1600] = values[800]
    c, apart = compared(port, replace(recording, **{sensor: values}))
    assert apart < APART
    if sensor == "mag":
        good = compared(port, recording)[0]
        assert np.trace(c.cov[1590]) > 1.002 * np.trace(good.cov[1590])


def test_a_stuck_magnetometer_from_the_start_is_none_after_its_first_reading(port, rng):
    recording = moving(rng)
    stuck = port.run(
        as_samples(replace(recording, mag=np.tile(recording.mag[0], (2000, 1)))), np.full(2000, DT)
    )
    none = port.run(as_samples(replace(recording, mag=None)), np.full(2000, DT))
    np.testing.assert_array_equal(stuck.heading_free, none.heading_free)
    turned = attitude_error(stuck.world_q_body, none.world_q_body, heading_offset="mean").degrees[0]
    assert turned < 0.5


def test_two_thousand_degrees_a_second(port):
    t = np.arange(0, 10.0, DT)
    angles = np.column_stack([0 * t, 0 * t, np.radians(2000.0) * np.maximum(0.0, t - 2.0)])
    recording = seen(t, attitude_from_angles(angles))
    c, apart = compared(port, recording)
    assert apart < APART
    up = rotate(c.world_q_body, np.tile([0.0, 0.0, 1.0], (len(t), 1)))
    assert np.degrees(np.arccos(np.minimum(up[:, 2], 1.0))).max() < 0.2


@pytest.mark.parametrize("pause", [0.2, 0.3, 0.5, 1.0, 20.0])
def test_over_a_gap_it_becomes_unsure_as_in_python(port, pause, rng):
    recording, other = still((0.2, 0.1, 0.3), 10.0, rng=rng), still((1.0, -0.5, -2.0), 10.0, rng=rng)
    rows = np.arange(1000)[:, None] < 500
    late = recording.t + (np.arange(1000) >= 500) * int(1e9 * (pause - DT))
    both = [np.where(rows, getattr(recording, one), getattr(other, one)) for one in ("accel", "gyro", "mag")]
    c, apart = compared(port, ImuRecording(late, *both))
    assert apart < APART
    if pause > 0.25:
        sure = np.sqrt(np.trace(c.cov, axis1=1, axis2=2))
        assert sure[500] > 1.3 * sure[499]


@pytest.mark.parametrize("dt", [np.nan, -1.0, -np.inf, 0.0])
def test_a_wrong_interval_is_none(port, dt, rng):
    samples = as_samples(moving(rng))
    state = port.start(samples[0])
    port.run(samples[:503], np.full(503, DT), state)
    elapsed = state.sums.elapsed
    port.run(samples[503:504], [dt], state)
    assert state.sums.elapsed == elapsed
    assert_sane(state)


def test_a_clock_that_stands_still_or_leaps_does_no_harm(port, rng):
    samples = np.tile(as_samples(moving(rng, 2.0)), 350)
    state = port.start(samples[0])
    port.run(samples, np.zeros(len(samples)), state, every=1000)
    assert len(samples) > 65_536
    assert_sane(state)
    port.run(samples[:200], np.tile([np.inf, 3e38, 1e6, 0.24, 1e-30], 40), state)
    assert_sane(state)
    port.run(samples[:200], np.full(200, DT), state)
    assert_sane(state)


@pytest.mark.parametrize("wrong", [(0.0, 0.0, -9.8), (9.0, 2.0, 0.1), (0.01, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_it_recovers_from_a_start_in_a_throw_as_python_does(port, wrong, rng):
    recording = still((0.5, -0.3, 1.0), 12.0, rng=rng)
    accel = np.array(recording.accel)
    accel[:5] = wrong
    c, apart = compared(port, replace(recording, accel=accel))
    assert apart < APART or wrong == (0.0, 0.0, -9.8)  # which way up from there is a matter of the last digit
    truth = np.tile(attitude_from_angles((0.5, -0.3, 1.0)), (200, 1))
    assert attitude_error(c.world_q_body[-200:], truth).degrees[0] < 2.0


def test_without_an_accelerometer_it_becomes_unsure_and_finds_back(port, rng):
    recording = still((0.4, 0.2, -1.0), 10.0, rng=rng)
    samples = as_samples(recording)
    state = port.start(samples[0])
    blind = np.tile(samples, 60)
    blind["accel"] = np.nan
    port.run(samples, np.full(len(samples), DT), state, every=100)
    known = state.tilt_cov[0]
    port.run(blind, np.full(len(blind), DT), state, every=1000)
    assert 100 * known < state.tilt_cov[0] <= 1.1
    assert_sane(state)
    found = port.run(samples, np.full(len(samples), DT), state)
    truth = np.tile(attitude_from_angles((0.4, 0.2, -1.0)), (100, 1))
    up = rotate(quaternion_inverse(found.world_q_body[-100:]), np.tile([0.0, 0.0, 1.0], (100, 1)))
    expected = rotate(quaternion_inverse(truth), np.tile([0.0, 0.0, 1.0], (100, 1)))
    assert np.degrees(np.arccos(np.minimum((up * expected).sum(1), 1.0))).max() < 1.0


WILD_CLOCK = (0.0, -1.0, 0.2, 0.3, 5.0, 1e9, np.nan)  # s


@pytest.mark.slow
def test_a_million_random_samples_leave_it_sane(port, pytestconfig, rng):
    """Wild motion, one reading in a hundred an extreme, clocks that stop, run back and leap."""
    state, count = port.start(np.zeros(1, SAMPLE)[0]), 10_000
    for _ in range(100 if pytestconfig.getoption("--full") else 10):
        scale = np.exp(rng.uniform(-5, 5))
        gyro, accel, mag = (scale * one * rng.normal(size=(count, 3)) for one in (0.5, 10.0, 30.0))
        samples = samples_of(gyro, accel + np.array([0.0, 0.0, 9.8]), mag + np.array([20.0, 0.0, -40.0]))
        for name in ("gyro", "accel", "mag"):
            rows = rng.choice(count, count // 100)
            samples[name][rows, rng.integers(0, 3, len(rows))] = rng.choice(EXTREMES, len(rows))
        dt = np.where(rng.random(count) < 0.999, DT, rng.choice(WILD_CLOCK, count))
        port.run(samples, dt, state, every=count)
        assert_sane(state)
    good = still((0.4, 0.2, -1.0), 60.0, rng=rng)
    dt = np.where(np.arange(len(good)) == 0, 20.0, DT)  # a pause, and what it has learned does not count
    found = port.run(as_samples(good), dt, state)
    truth = np.tile(attitude_from_angles((0.4, 0.2, -1.0)), (100, 1))
    assert attitude_error(found.world_q_body[-100:], truth, heading_offset="mean").degrees[0] < 1.0


@pytest.mark.slow
def test_hours_at_rest_neither_turn_it_nor_wear_it_out(port, pytestconfig, rng):
    recording = still((0.4, 0.2, -1.0), 100.0, rng=rng)
    samples, dt = as_samples(recording), np.full(10_000, DT)
    state = port.start(samples[0])
    for _ in range(100 if pytestconfig.getoption("--full") else 10):
        found = port.run(samples, dt, state, every=1000)
        assert_sane(state)
    truth = np.tile(attitude_from_angles((0.4, 0.2, -1.0)), (10, 1))
    assert attitude_error(found.world_q_body, truth).degrees[0] < 0.3
    assert state.resting
