"""The tilt Kalman filter in fixed point against the one in double precision, on equal rounded samples."""

import numpy as np
import pytest
from core_library import samples_q
from fixed_filters import FixedFilter, degrees_between, in_si, resampled

from sequential.attitude import TiltKalman
from sequential.attitude.angles import attitude_from_angles
from sequential.evaluate.consistency import chi2_quantile

CHANNEL = [("angle", "<u4"), ("bias", "<i4"), ("p", "<u4"), ("c", "<i4"), ("b", "<u4"), ("below", "<u2"),
           ("known", "u1")]  # fmt: skip
STATE = [("channel", np.dtype(CHANNEL, align=True), 3), ("heading_known", "u1"), ("status", "u1")]
SETTINGS = (
    "gyro_density", "bias_walk", "tilt_sigma", "heading_sigma", "nis_gate", "bias_sigma", "bias_limit",
)  # fmt: skip
DERIVED = 72
FINER = np.array([3, 3, 5])  # of the defaults at 100 Hz
ACCEL_REJECTED, MAG_DISTURBED = 2, 4
TURN = 2 * np.pi
G = 9.81
RECORDINGS = ("broad:01", "broad:11", "broad:16", "broad:21", "broad:29", "broad:34", "xio")
FORCES = [(-128.0, 127.0, 127.9), (127.9, -128.0, 0.0), (0.0, 0.0, -G), (1 / 256, 0.0, 0.0)]


@pytest.fixture(scope="session")
def filter_q(c_compiler, tmp_path_factory):
    folder = tmp_path_factory.mktemp("tilt_q")
    return FixedFilter(c_compiler, folder, "tilt", STATE, SETTINGS, ("tilt_q_derive.c", "tilt_q_state.c"))


def biases(states, rate=100):
    """(N, 3) of the rates, rad/s."""
    return states["channel"]["bias"] / 2.0**40 * TURN * rate


def limited_path(tilt, recording, limit):
    """(N, 19) of the double filter, its biases kept within ± limit, rad/s: the reference of `bias_limit`."""
    state, states = tilt.start(recording.gyro[0], recording.accel[0]), []
    mag = np.full((len(recording), 3), np.nan) if recording.mag is None else recording.mag
    for k, dt in enumerate(np.concatenate([[0.0], recording.dt])):
        state = tilt.step(state, recording.gyro[k], recording.accel[k], mag[k], dt)
        state[3:6] = np.clip(state[3:6], -limit, limit)
        states.append(state)
    return np.array(states)


def both(filter_q, samples, recording, *, rate=100, periods=None, gate=None, **settings):
    """Degrees (N,) to the double filter, difference of the biases (N, 3), states, and the double path."""
    given = settings if gate is None else settings | {"nis_gate": chi2_quantile(gate, 1)}
    states, q = filter_q.run(samples, periods, rate, **given)
    limit = settings.pop("bias_limit", 1.0)
    path = limited_path(TiltKalman(gate=gate, **settings), recording, limit)
    off = degrees_between(q, attitude_from_angles(path[:, :3]))
    return off, np.abs(biases(states, rate) - path[:, 3:6]), states, path


def still(count, gyro=(0.0, 0.0, 0.0), accel=(0.0, 0.0, G), mag=None):
    """Samples (N,) that say the same."""
    field = None if mag is None else np.tile(mag, (count, 1))
    return samples_q(np.tile(gyro, (count, 1)), np.tile(accel, (count, 1)), field)


@pytest.mark.parametrize("field", [False, True])
@pytest.mark.parametrize("name", RECORDINGS)
def test_three_minutes_of_a_recording(filter_q, data_dir, name, field):
    off, bias, _, _ = both(filter_q, *resampled(name, field=field))
    assert np.sqrt(np.mean(off**2)) <= 0.03
    assert off.max() <= 0.1
    assert np.degrees(bias).max() <= 0.01


def test_a_recording_that_goes_over_the_top(filter_q, data_dir):
    """At a pitch of 90° the rates of roll and yaw have a pole, which magnifies any rounding."""
    off, _, _, path = both(filter_q, *resampled("broad:07", field=False))
    steep = np.flatnonzero(np.abs(path[:, 1]) > np.radians(88.0))[0]
    assert steep > 3000
    assert off[:steep].max() <= 0.05


def test_the_reference_without_a_limit_is_the_estimator(data_dir):
    _, recording = resampled("broad:16", part=(60.0, 70.0))
    path = limited_path(TiltKalman(), recording, np.inf)
    np.testing.assert_array_equal(path, TiltKalman().path(recording))
    assert np.abs(path[:, 3:6]).max() > 1.5, "without one, a start in motion takes accelerations for a bias"


@pytest.mark.parametrize("limit", [0.05, 0.3, 1.0])
def test_a_start_in_motion_that_meets_the_limit(filter_q, data_dir, limit):
    off, bias, _, path = both(filter_q, *resampled("broad:16", part=(60.0, 120.0)), bias_limit=limit)
    assert np.abs(path[:, 3:6]).max() == pytest.approx(limit)
    assert off.max() <= 0.1
    assert np.degrees(bias).max() <= 0.02


def test_covariances_are_those_of_double_precision(filter_q, data_dir):
    """From the first sample to the end: p, c and b to a few parts in a thousand."""
    _, _, states, path = both(filter_q, *resampled("broad:16", part=(0.0, 60.0)))
    period, noise = 0.01, np.array([0.1, 0.1, 0.3]) ** 2
    channel = states["channel"][1:]
    unit = 2.0 ** -(38.0 + FINER)
    for name, one, columns in (("p", 2.0**-30, slice(6, 9)), ("c", unit / period, slice(9, 12)),
                                ("b", unit / period**2, slice(12, 15))):  # fmt: skip
        np.testing.assert_allclose(channel[name] * one * noise, path[1:, columns], rtol=5e-3)


@pytest.mark.parametrize(("rate", "settings"), [
    (50, {"bias_limit": 0.5}), (200, {}), (100, {"gyro_density": 2e-4}), (100, {"bias_walk": 1e-5}),
    (100, {"tilt_sigma": 0.02}), (100, {"gyro_density": 0.02, "bias_walk": 1e-3, "bias_sigma": 0.1}),
])  # fmt: skip
def test_other_rates_and_settings(filter_q, data_dir, rate, settings):
    samples, recording = resampled("broad:16", rate, part=(60.0, 120.0))
    off, bias, _, _ = both(filter_q, samples, recording, rate=rate, **settings)
    assert off.max() <= 0.1
    assert np.degrees(bias).max() <= 0.02


def test_samples_that_drop_out(filter_q, data_dir, rng):
    """A sample stands for the periods before it; over more than a second the angles begin anew."""
    samples, recording = resampled("broad:16", part=(40.0, 100.0))
    kept = np.flatnonzero(rng.random(len(samples)) < 0.5)
    kept = kept[(kept < 1000) | (kept > 1150)]
    periods = np.minimum(np.diff(kept, prepend=kept[0]), 255)
    assert periods.max() > 100
    off, _, _, _ = both(
        filter_q, np.ascontiguousarray(samples[kept]), recording.select(kept), periods=periods
    )
    assert off.max() <= 0.2


@pytest.mark.parametrize(("name", "gate"), [("broad:01", 0.9), ("broad:05", 0.99), ("xio", 0.99)])
def test_the_gate_refuses_what_double_precision_refuses(filter_q, data_dir, name, gate):
    off, _, states, _ = both(filter_q, *resampled(name, field=False, part=(0.0, 120.0)), gate=gate)
    refused = (states["status"] & ACCEL_REJECTED) != 0
    assert 0.005 < refused.mean() < 0.5
    assert off.max() <= 0.1


def test_a_field_that_jumps_is_refused_until_the_variance_has_grown(filter_q):
    samples = still(4000, mag=(0.0, 20.0, -40.0))
    samples["mag"][2000:] = still(1, mag=(20.0, 0.0, -40.0))["mag"]
    off, _, states, path = both(filter_q, samples, in_si(samples), gate=0.999)
    refused = (states["status"] & MAG_DISTURBED) != 0
    assert not refused[:2000].any()
    assert refused[2000:2200].all()
    assert off.max() <= 0.02
    assert path[-1, 2] == pytest.approx(path[1999, 2], abs=0.05)


def test_a_field_that_comes_late_teaches_the_bias(filter_q, rng):
    """A minute without a field: the first one sets yaw, and the bias is found from those that follow."""
    samples = still(12_000, gyro=(0.0, 0.0, 0.01), mag=(0.0, 20.0, -40.0))
    samples["gyro"] += rng.integers(-20_000, 20_000, samples["gyro"].shape)
    samples["mag"] += rng.integers(-100, 100, samples["mag"].shape).astype(np.int16)
    samples["mag"][:6000] = 0
    states, _ = filter_q.run(samples)
    yaw = (states["channel"]["angle"][6000:, 2] / 2.0**32 + 0.5) % 1.0 - 0.5
    assert np.abs(360.0 * yaw).max() < 2.0
    assert np.abs(biases(states)[:, 2]).max() < 0.02
    assert biases(states)[-1, 2] == pytest.approx(0.01, abs=1e-3)


def test_no_accelerometer_lets_the_variances_grow(filter_q):
    samples = still(3000, gyro=(0.3, 0.0, 0.0))
    samples["accel"][1:] = 0
    states, _ = filter_q.run(samples)
    assert ((states["status"][1:] & ACCEL_REJECTED) != 0).all()
    roll = states["channel"]["angle"][-1, 0] / 2.0**32 * TURN
    assert roll == pytest.approx((0.3 * 29.99) % TURN, abs=1e-4)
    p = states["channel"]["p"][:, 0].astype(float)
    assert (np.diff(p[1:]) >= 0).all()
    assert p[-1] / 2.0**30 == pytest.approx(3.0, rel=1e-3), "saturated"


@pytest.mark.parametrize("accel", FORCES)
def test_extreme_forces_are_directions(filter_q, accel):
    samples = still(500, accel=accel)
    off, _, _, _ = both(filter_q, samples, in_si(samples))
    assert off.max() <= 0.02


def test_two_thousand_degrees_a_second(filter_q):
    samples = still(1000, gyro=(0.0, 0.0, np.radians(2000.0)), mag=(0.0, 20.0, -40.0))
    off, bias, _, _ = both(filter_q, samples, in_si(samples))
    assert off.max() <= 0.05
    assert np.degrees(bias).max() <= 0.05


def test_a_stuck_gyro_becomes_bias_up_to_its_limit(filter_q):
    free, _ = filter_q.run(still(20_000, gyro=(0.05, 0.0, 0.0)))
    assert biases(free)[-1] == pytest.approx([0.05, 0.0, 0.0], abs=2e-3)
    held, _ = filter_q.run(still(20_000, gyro=(0.05, 0.0, 0.0)), bias_limit=0.01)
    assert biases(held)[-1] == pytest.approx([0.01, 0.0, 0.0], abs=1e-5)
    assert np.abs(biases(held)).max() <= 0.01 + 1e-9


@pytest.mark.slow
def test_a_day_without_drift(filter_q, data_dir, pytestconfig):
    """A day at 100 Hz with --full, three hours otherwise; overflow would end the process."""
    samples, _ = resampled("broad:16")
    rounds = (8_640_000 if pytestconfig.getoption("--full") else 1_000_000) // len(samples) + 1
    last, length = filter_q.soak(samples, rounds)
    np.testing.assert_allclose(length, 1.0, atol=5e-5)
    for part in ("p", "c", "b"):
        later, first = (last["channel"][part][k].astype(float) for k in (-1, 1))
        np.testing.assert_allclose(later, first, rtol=0.01, err_msg="the covariance has settled")
    np.testing.assert_allclose(biases(last)[-1], biases(last)[1], atol=1e-5)


def test_any_state_sample_and_number_of_periods(filter_q, rng):
    """Bits of any kind: nothing overflows (the library traps it)."""
    count = 20_000
    states = np.frombuffer(rng.bytes(count * filter_q.state.itemsize), filter_q.state).copy()
    samples = np.frombuffer(rng.bytes(count * 24), samples_q(np.zeros((1, 3)), np.zeros((1, 3))).dtype).copy()
    for name in ("bias", "c"):
        states["channel"][name][::2] = rng.choice([-(2**31), 2**31 - 1, 0, 1], (count // 2, 3))
    for name in ("angle", "p", "b"):
        states["channel"][name][::3] = rng.choice([0, 1, 2**31, 2**32 - 1], (len(states[::3]), 3))
    samples["gyro"][::5] = rng.choice([-(2**31), 2**31 - 1], samples["gyro"][::5].shape)
    after = filter_q.steps(states, samples, rng.integers(0, 256, count))
    assert np.abs(biases(after)).max() <= 1.23


def test_constants_of_the_header_are_the_derived_ones(filter_q):
    derived, written = filter_q.constants(DERIVED)
    assert derived[:69] == written[:69]
