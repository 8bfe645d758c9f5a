"""The C filters as estimators: laws of the family, and equality with their Python models."""

from dataclasses import replace

import numpy as np
import pytest
from attitude_worlds import seen, swinging

from sequential import firmware
from sequential.attitude import ErrorStateAttitude, attitude_from_angles
from sequential.evaluate import attitude_error

FLOAT = [firmware.CMahony, firmware.CTiltKalman, firmware.CComplementary, firmware.CErrorState]
FIXED = [firmware.CMahonyFixed, firmware.CTiltKalmanFixed, firmware.CComplementaryFixed]
EVERY = [*FLOAT, *FIXED]
each = pytest.mark.parametrize("kind", EVERY, ids=lambda kind: kind.__name__)
each_float = pytest.mark.parametrize("kind", FLOAT, ids=lambda kind: kind.__name__)


@pytest.fixture(autouse=True)
def _compiled(c_compiler):
    """Everything here runs the shared object."""


@pytest.fixture
def moved(rng):
    t, angles = swinging(20.0)
    return seen(t, attitude_from_angles(angles), rng=rng)


@each_float
@pytest.mark.parametrize("magnetometer", [True, False])
def test_a_recording_gives_what_python_gives(kind, magnetometer, moved):
    ported = kind(magnetometer=magnetometer)
    own, theirs = ported.estimate(moved), type(ported.design)(magnetometer=magnetometer).estimate(moved)
    apart = np.degrees(attitude_error(own.world_q_body, theirs.world_q_body).errors[:, 0])
    if kind is firmware.CErrorState:  # it spreads its corrections over the samples after a block
        assert np.sqrt(np.mean(apart**2)) < 0.02
        return
    assert apart.max() < 0.01
    if theirs.rest is not None:
        assert np.count_nonzero(own.rest != theirs.rest) <= 2, "times add up to a rounding"
    if theirs.gyro_bias is not None:
        np.testing.assert_allclose(own.gyro_bias, theirs.gyro_bias, atol=1e-5)


@pytest.mark.parametrize("magnetometer", [True, False])
def test_the_error_state_filter_knows_how_well_it_knows(magnetometer, moved):
    own = firmware.CErrorState(magnetometer=magnetometer).estimate(moved)
    theirs = ErrorStateAttitude(magnetometer=magnetometer).estimate(moved)
    apart = attitude_error(own.heading_free, theirs.heading_free).errors[:, 0]
    assert np.degrees(np.sqrt(np.mean(apart**2))) < 0.02
    for name in ("cov", "cov_6d", "gyro_bias_cov"):
        shares = [np.sqrt(np.trace(getattr(one, name), axis1=1, axis2=2)) for one in (own, theirs)]
        # a correction comes some samples later than in Python
        np.testing.assert_allclose(np.median(shares[0] / shares[1]), 1.0, atol=0.01)
    assert abs(own.gyro_bias[-1] - theirs.gyro_bias[-1]).max() < 1e-5


@pytest.mark.parametrize("kind", FIXED, ids=lambda kind: kind.__name__)
def test_fixed_point_is_near_double(kind, moved):
    ported = kind()
    own, theirs = (
        ported.estimate(moved),
        replace(ported.design, magnetometer=ported.magnetometer).estimate(moved),
    )
    apart = np.degrees(attitude_error(own.world_q_body, theirs.world_q_body).errors[:, 0])
    assert np.sqrt(np.mean(apart**2)) < 0.1
    assert apart.max() < 0.3


@pytest.mark.parametrize("kind", FIXED, ids=lambda kind: kind.__name__)
def test_the_clock_of_a_recording_is_kept(kind, moved):
    """A recording whose rate is no whole number, and one that is slower than the filter counts."""
    t = np.rint(moved.t * (100 / 99.6)).astype(np.int64)
    for one in (replace(moved, t=t), moved.select(slice(None, None, 2))):
        own = kind(magnetometer=False).estimate(one).world_q_body
        theirs = replace(kind().design, magnetometer=False).estimate(one).world_q_body
        assert np.degrees(attitude_error(own, theirs).errors[:, 0].max()) < 0.5


@each
def test_steps_are_the_batch(kind, moved):
    """One sample at a time or all at once: the same numbers."""
    ported, some = kind(magnetometer=True), moved.select(slice(0, 400))
    path = ported.estimate(some).world_q_body
    state = ported.start(some.gyro[0], some.accel[0])
    for k in range(len(some)):
        dt = float(some.t[k] - some.t[k - 1]) * 1e-9 if k else 0.0
        state = ported.step(state, some.gyro[k], some.accel[k], some.mag[k], dt)
        found = attitude_from_angles(state[:3]) if kind is firmware.CTiltKalman else state[:4]
        near = 1e-6 if kind is firmware.CTiltKalman else 0.0
        np.testing.assert_allclose(found * np.sign(found @ path[k]), path[k], rtol=0.0, atol=near)


@each
def test_many_recordings_in_threads(kind, moved):
    every = [moved, moved.select(slice(0, 500)), moved]
    for one, path in zip(every, kind().estimate_many(every, threads=2), strict=True):
        np.testing.assert_array_equal(path.world_q_body, kind().estimate(one).world_q_body)


@each
def test_the_design_hands_its_settings_over(kind, moved):
    plain = kind(magnetometer=False).design
    assert kind(design=plain.__class__(magnetometer=False)).magnetometer is False
    name = kind.FIELDS[0]
    other = kind(design=type(plain)(**{name: 2.0 * getattr(plain, name)}))
    assert other.settings[0] == 2.0 * kind().settings[0]
    assert not np.array_equal(other.estimate(moved).world_q_body, kind().estimate(moved).world_q_body)


@each
def test_bad_samples_leave_a_finite_attitude(kind, moved):
    """What a board meets in its worst minute: the answer stays a rotation."""
    ported = kind(magnetometer=True)
    state = ported.start(moved.gyro[0], moved.accel[0])
    bad = [np.full(3, value) for value in (np.nan, np.inf, -np.inf, 0.0, 1e30, 34.9)]
    for k in range(600):
        gyro, accel, mag = moved.gyro[k], moved.accel[k], moved.mag[k]
        worst = bad[k // 3 % len(bad)] if k % 3 else None
        if worst is not None:
            gyro, accel, mag = (worst if k % 5 == i else v for i, v in enumerate((gyro, accel, mag)))
        dt = (0.01, -1.0, np.nan, 5.0)[k % 4]
        state = ported.step(state, gyro, accel, mag, dt)
        if kind is firmware.CTiltKalman:
            assert np.isfinite(state).all()
        else:
            assert np.linalg.norm(state[:4]) == pytest.approx(1.0, abs=1e-5)
