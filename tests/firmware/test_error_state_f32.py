"""The error-state filter in C against the Python one: a step from an equal state, and whole recordings."""

import ctypes

import numpy as np
import pytest
from attitude_worlds import seen, still, swinging
from error_state_port import NAN, Port, Settings, build, samples_of

from sequential.attitude import ErrorStateAttitude, attitude_from_angles
from sequential.attitude import error_state_layout as at
from sequential.evaluate import attitude_error
from sequential.readers.broad import read_broad

TRIALS = ("01", "05", "07", "11", "16", "21", "24", "27", "29", "34")
RMS = 0.01  # degrees between single and double precision over a trial, ...
FARTHEST = 0.003  # ... and between blocks, where both have used the same readings
ROTATIONS = {name: np.s_[place : place + 4] for name, place in (("turn", at.Q), ("begin", at.START))}


@pytest.fixture(scope="module")
def library(c_compiler, tmp_path_factory):
    return build(c_compiler, tmp_path_factory.mktemp("error_state"))


@pytest.fixture(scope="module")
def port(library):
    return Port(library)


def intervals(recording):
    return np.diff(recording.t, prepend=recording.t[:1]) * 1e-9


def both(port, recording, every=1):
    """What C and Python make of a recording."""
    c = port.run(
        samples_of(recording.gyro, recording.accel, recording.mag), intervals(recording), every=every
    )
    return c, port.design.estimate(recording)


def apart(one, other):
    """Angles (N,) between quaternions, degrees, without losing digits near zero."""
    other = other * np.sign((one * other).sum(1, keepdims=True))
    return np.degrees(4 * np.arcsin(np.minimum(1.0, np.linalg.norm(one - other, axis=1) / 2)))


def test_defaults_are_those_of_the_python_filter(port):
    settings = Settings()
    port.calls.error_state_f32_defaults(ctypes.byref(settings))
    for name, _ in Settings._fields_:
        assert getattr(settings, name) == pytest.approx(getattr(ErrorStateAttitude(), name), rel=1e-6), name


def scales(numbers):
    """How large each number of a state may be: what an error of single precision is a share of."""
    size = np.ones(at.STATE)
    size[at.FORCE : at.FORCE + 3] = size[at.SPECIFIC : at.SPECIFIC + 3] = 10 * max(1, numbers[at.FORCES])
    size[at.FIELD : at.FIELD + 3] = size[at.LAST_FIELD : at.LAST_FIELD + 3] = 50 * max(1, numbers[at.FIELDS])
    size[at.TURNED : at.TURNED + 9] = size[at.RATE : at.RATE + 3] = max(1, numbers[at.SAMPLES])
    size[[at.SLOW_ACCEL, at.SLOW_ACCEL + 1, at.SLOW_ACCEL + 2, at.SCALE, at.RATE_SQUARED]] = 50
    size[at.MEAN_FORCE : at.MEAN_FORCE + 3] = 10
    for place, n in ((at.P, at.ERRORS), (at.D, at.HEADING_ERRORS)):
        sigma = np.sqrt(np.diag(numbers[place : place + n * n].reshape(n, n)))
        size[place : place + n * n] = (np.outer(sigma, sigma) + 1e-14).ravel()
    return np.maximum(size, np.abs(numbers))


def assert_equal_states(c, python, tolerance):
    """Every number of two states, as a share of its scale; the sign of a quaternion does not matter."""
    python = python.copy()
    python[at.STILL], python[at.AGE] = min(python[at.STILL], 1.0), min(python[at.AGE], 1.0)
    python[at.UNSEEN] = min(python[at.UNSEEN], 0.5)
    python[at.X : at.MEAN_FORCE] = c[at.X : at.MEAN_FORCE]  # errors that were put in, and what is scratch
    difference = np.abs(c - python)
    difference[at.DELTA] = abs(np.angle(np.exp(1j * (c[at.DELTA] - python[at.DELTA]))))
    half = python[at.HALF : at.HALF + 2]
    difference[at.HALF : at.HALF + 2] = np.abs(
        c[at.HALF : at.HALF + 2] - half * np.sign(half @ c[at.HALF :][:2])
    )
    worst = np.argmax(difference / scales(python))
    assert difference[worst] <= tolerance * scales(python)[worst], (worst, c[worst], python[worst])


@pytest.mark.parametrize("trial", ["07", "16", "34"])
@pytest.mark.parametrize("mag", [True, False])
def test_one_step_from_an_equal_state_is_the_same(port, data_dir, rng, trial, mag):
    """At 200 places of a trial the state of the Python filter is stepped on by both."""
    recording = recorded(data_dir, trial).slice(0.0, 60.0)
    dt, field = intervals(recording), recording.mag if mag else np.tile(NAN, (len(recording), 1))
    samples = samples_of(recording.gyro, recording.accel, field)
    python, c = port.design.start(recording.gyro[0], recording.accel[0]), None
    places = iter([*np.sort(rng.choice(5900, 200, replace=False)), 6000])
    place = next(places)
    for k in range(6000):
        now = samples[k]
        if k >= place and c is None:
            c, place = port.into_c(python), next(places)
        python = port.design.step(python, now["gyro"], now["accel"], now["mag"], dt[k])
        if c is not None:
            port.step(ctypes.addressof(c), ctypes.addressof(port.derived), samples[k:].ctypes.data, dt[k])
            if not c.closing:  # else rest and field follow with the next sample
                assert_equal_states(port.into_python(c), python, 2e-5)
                c = None


def recorded(folder, trial):
    return read_broad(next((folder / "imu" / "broad").glob(f"{trial}_*.npz")))[0]


@pytest.mark.parametrize("trial", TRIALS)
def test_a_real_trial_ends_where_double_precision_does(port, data_dir, trial):
    recording = recorded(data_dir, trial)
    c, python = both(port, recording, every=4)
    for name in ("world_q_body", "heading_free"):
        angle = apart(getattr(c, name), getattr(python, name)[::4])
        assert np.sqrt(np.mean(angle**2)) < RMS, name
        assert angle[~c.closing].max() < FARTHEST, name
    for name in ("cov", "cov_6d", "gyro_bias_cov"):
        expected = getattr(python, name)[::4]
        largest = np.abs(expected).max((1, 2))
        difference = np.abs(getattr(c, name) - expected).max((1, 2))
        assert (difference < 1e-3 * largest)[~c.closing].all(), name
    np.testing.assert_allclose(c.gyro_bias[~c.closing], python.gyro_bias[::4][~c.closing], atol=2e-6)
    np.testing.assert_array_equal(c.rest, python.rest[::4])
    same = c.magnetic_disturbance == python.magnetic_disturbance[::4]
    assert same[~c.closing].all()


@pytest.mark.parametrize("trial", TRIALS)
def test_without_magnetometer_it_is_the_answer_without_heading(port, data_dir, trial):
    recording = recorded(data_dir, trial).slice(0.0, 60.0)
    samples, dt = samples_of(recording.gyro, recording.accel), intervals(recording)
    without = port.run(samples, dt, every=10)
    samples["mag"] = recording.mag
    with_field = port.run(samples, dt, every=10)
    for name in ("heading_free", "cov_6d", "gyro_bias"):
        np.testing.assert_array_equal(getattr(without, name), getattr(with_field, name), err_msg=name)
    np.testing.assert_array_equal(without.world_q_body, without.heading_free)


@pytest.mark.parametrize("rate", [25.0, 100.0, 1000.0])
@pytest.mark.parametrize("mag", [True, False])
def test_any_rate_gives_what_double_precision_gives(port, rate, mag, rng):
    t, angles = swinging(20.0, rate)
    c, python = both(port, seen(t, attitude_from_angles(angles), mag=mag, rng=rng))
    farthest = 0.01 if rate < 1000 else 0.05  # what 20 000 roundings of the quaternion add up to
    assert apart(c.world_q_body, python.world_q_body)[~c.closing].max() < farthest


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.6, -0.4, 2.0), (-1.2, 0.9, -2.5), (3.1, 0.2, 1.0)])
def test_at_rest_it_is_level_and_faces_north_from_the_first_sample(port, angles):
    recording = still(angles, 3.0)
    found = both(port, recording)[0]
    truth = np.tile(attitude_from_angles(angles), (len(recording), 1))
    assert attitude_error(found.world_q_body, truth).degrees[0] < 0.01
    assert found.rest[-1]
    assert not found.rest[0]
    np.testing.assert_allclose(np.linalg.norm(found.world_q_body, axis=1), 1.0, atol=3e-7)


def test_other_settings_reach_the_filter(library, rng):
    t, angles = swinging(20.0)
    recording = seen(t, attitude_from_angles(angles), rng=rng)
    other = ErrorStateAttitude(
        block=0.1, motion_bandwidth=3.0, field_noise=0.01, latency=0.0, bias_sigma=0.05, heading_floor=0.0
    )
    c, python = both(Port(library, other), recording)
    usual = Port(library).run(
        samples_of(recording.gyro, recording.accel, recording.mag), intervals(recording)
    )
    assert apart(c.world_q_body, python.world_q_body)[~c.closing].max() < 0.01
    assert apart(c.world_q_body, usual.world_q_body).max() > 0.1
    difference = np.abs(c.cov - python.cov).max((1, 2)) / np.abs(python.cov).max((1, 2))
    assert difference[~c.closing].max() < 1e-3


@pytest.mark.parametrize("unit", [1e-6, 1e-3, 1e5])
def test_the_unit_of_the_field_does_not_matter(port, unit, rng):
    t, angles = swinging(20.0)
    recording = seen(t, attitude_from_angles(angles), rng=rng)
    one, other = (
        port.run(samples_of(recording.gyro, recording.accel, recording.mag * scale), intervals(recording))
        for scale in (1.0, unit)
    )
    assert apart(one.world_q_body, other.world_q_body).max() < 0.01


@pytest.mark.parametrize("rate", [5.0, 10.0, 20.0])
def test_at_a_rate_at_which_every_sample_ends_a_block_it_is_as_good(port, rate, rng):
    t, angles = swinging(60.0, rate)
    truth = attitude_from_angles(angles)
    c, python = both(port, seen(t, truth, rng=rng))
    reached, due = (attitude_error(one.world_q_body, truth).degrees[0] for one in (c, python))
    assert reached < 1.1 * due + 0.05


@pytest.mark.parametrize("block", [0.005, 0.02, 0.25])
def test_a_block_may_be_short_or_long(library, block, rng):
    t, angles = swinging(20.0)
    port = Port(library, ErrorStateAttitude(block=block))
    c, python = both(port, seen(t, attitude_from_angles(angles), rng=rng))
    assert np.sqrt(np.mean(apart(c.world_q_body, python.world_q_body) ** 2)) < 0.02
