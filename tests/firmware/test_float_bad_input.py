"""What the float filters of the core do with bad input: what their headers say, as the Python filters."""

import ctypes
import math

import numpy as np
import pytest
from attitude_worlds import RATE, seen, swinging
from float_filters import (
    COMPLEMENTARY,
    MAHONY,
    STEP_TOLERANCE,
    TILT,
    FloatFilter,
    recorded_table,
    single_settings,
)

from sequential.attitude import ComplementaryAttitude, Mahony, TiltKalman, attitude_from_angles

FILTERS = {
    "complementary": (COMPLEMENTARY, ComplementaryAttitude()),
    "kalman": (TILT, TiltKalman()),
    "mahony": (MAHONY, Mahony()),
}
GYRO, ACCEL, MAG = slice(0, 3), slice(3, 6), slice(6, 9)
PERIOD = float(np.float32(1 / RATE))
LEAST = 16 * 9.81
BAD = {
    "gyro NaN": (GYRO, (np.nan, 0.1, 0.2)),
    "gyro infinite": (GYRO, (0.1, np.inf, 0.2)),
    "gyro infinite both ways": (GYRO, (np.inf, -np.inf, 0.0)),
    "gyro at 2000 deg/s": (GYRO, (34.9, -34.9, 34.9)),
    "gyro stuck": (GYRO, (0.05, 0.05, 0.05)),
    "accelerometer NaN": (ACCEL, (np.nan, 0.0, 9.81)),
    "accelerometer infinite": (ACCEL, (0.0, -np.inf, 9.81)),
    "accelerometer zero": (ACCEL, (0.0, 0.0, 0.0)),
    "accelerometer saturated": (ACCEL, (LEAST, LEAST, -LEAST)),
    "magnetometer NaN": (MAG, (np.nan, np.nan, np.nan)),
    "magnetometer NaN in one axis": (MAG, (20.0, 20.0, np.nan)),
    "magnetometer infinite": (MAG, (np.inf, 0.0, 0.0)),
    "magnetometer zero": (MAG, (0.0, 0.0, 0.0)),
    "magnetometer saturated": (MAG, (4900.0, 4900.0, -4900.0)),
}
TIMES = {"NaN": math.nan, "negative": -0.01, "zero": 0.0, "2 s": 2.0, "infinite": math.inf}


@pytest.fixture(scope="module", name="folder")
def of_what_is_compiled(tmp_path_factory):
    return tmp_path_factory.mktemp("core")


@pytest.fixture(params=FILTERS, name="filt")
def every_filter(request, c_compiler, folder):
    pair, python = FILTERS[request.param]
    own = FloatFilter(pair, c_compiler, folder)
    python = single_settings(python)
    own.use(python)
    return own, python


@pytest.fixture(scope="module", name="world")
def swinging_world():
    t, angles = swinging(20.0)
    return recorded_table(seen(t, attitude_from_angles(angles), rng=np.random.default_rng(5)), None)[0]


def warmed(own, samples, count=700):
    """A filter after its first samples, past every start."""
    own.start(samples[0])
    for k in range(count):
        own.step(samples[k], PERIOD if k else 0.0)
    return count


def as_python(own, python, sample, dt):
    """Largest difference of the C step to the Python step from the same state."""
    wide = sample.astype(np.float64)
    after = python.step(own.numbers, wide[GYRO], wide[ACCEL], wide[MAG], float(np.float32(dt)))
    own.step(sample, dt)
    expected, found = own.pair.seen(python, after), own.pair.seen(python, own.numbers)
    return float(np.max(np.abs(found - expected) / np.maximum(1.0, np.abs(expected))))


@pytest.mark.parametrize("bad", BAD)
def test_a_bad_sample_does_what_it_does_in_python(filt, world, bad):
    own, python = filt
    where, values = BAD[bad]
    k = warmed(own, world)
    spoilt = world[k : k + 30].copy()
    spoilt[:, where] = values
    for sample in spoilt:
        assert as_python(own, python, sample, PERIOD) <= STEP_TOLERANCE


@pytest.mark.parametrize("dt", TIMES.values(), ids=TIMES)
def test_a_bad_time_step_does_what_it_does_in_python(filt, world, dt):
    own, python = filt
    k = warmed(own, world)
    for sample in world[k : k + 5]:
        assert as_python(own, python, sample, dt) <= STEP_TOLERANCE
        assert as_python(own, python, sample, PERIOD) <= STEP_TOLERANCE


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("axis", range(3))
def test_a_gyro_that_is_not_finite_changes_not_a_bit(filt, world, axis, value):
    own, _ = filt
    k = warmed(own, world)
    before = ctypes.string_at(ctypes.addressof(own.state), ctypes.sizeof(own.state))
    sample = world[k].copy()
    sample[axis] = value
    own.step(sample, PERIOD)
    assert ctypes.string_at(ctypes.addressof(own.state), ctypes.sizeof(own.state)) == before


@pytest.mark.parametrize("bad", BAD)
def test_after_a_second_of_bad_samples_it_is_where_python_is(filt, world, bad):
    own, python = filt
    where, values = BAD[bad]
    spoilt = world.copy()
    spoilt[600:700, where] = values
    state = python.start(spoilt[0, GYRO], spoilt[0, ACCEL])
    own.start(spoilt[0])
    for k, sample in enumerate(spoilt):
        dt = PERIOD if k else 0.0
        own.step(sample, dt)
        wide = sample.astype(np.float64)
        state = python.step(state, wide[GYRO], wide[ACCEL], wide[MAG], dt)
        assert abs(np.linalg.norm(own.quaternion) - 1) < 5e-7
    expected, found = own.pair.seen(python, state), own.pair.seen(python, own.numbers)
    if own.pair is TILT and bad == "gyro at 2000 deg/s":
        # the angles fold thirty times a second, in one filter a sample before the other; variances agree
        expected, found = expected[9:], found[9:]
    np.testing.assert_allclose(found, expected, atol=2e-4, rtol=1e-4)


@pytest.mark.parametrize("gap", [0.1, 0.5, 0.99])
def test_dropped_samples_are_stood_for_by_the_last_reading(filt, gap):
    own, _ = filt
    turn = np.array([0.0, 0.0, 0.5, 0.0, 0.0, 9.81, np.nan, np.nan, np.nan], np.float32)
    own.start(turn)
    own.step(turn, 0.0)
    for _k in range(10):
        own.step(turn, gap)
    yaw = 2 * np.arctan2(own.quaternion[3], own.quaternion[0])
    assert abs(yaw - 10 * gap * 0.5) % (2 * np.pi) < 0.02


def test_a_first_sample_that_says_nothing_starts_level(filt):
    own, _ = filt
    own.start(np.full(9, np.nan, np.float32))
    np.testing.assert_allclose(np.abs(own.quaternion), [1, 0, 0, 0], atol=1e-7)


def test_no_bias_of_mahony_goes_past_its_limit(c_compiler, folder):
    own = FloatFilter(MAHONY, c_compiler, folder)
    own.use(Mahony(integral_gain=5.0, error_limit=math.inf))
    stuck = np.array([0.3, -0.3, 0.3, 9.81, 0.0, 0.0, 0.0, 22.0, -42.0], np.float32)
    own.start(stuck)
    for _k in range(3000):
        own.step(stuck, PERIOD)
        assert np.abs(own.numbers[4:7]).max() <= np.float32(0.1)
