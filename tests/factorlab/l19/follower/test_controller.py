"""The PID: each of its terms, its limit, and the integral that does not wind up."""

import numpy as np
import pytest

from factorlab.l19.follower.controller import Pid, PidMemory


def outputs(pid, errors, dt=0.05):
    memory, out = PidMemory(), []
    for error in errors:
        memory, value = pid.step(memory, error, dt)
        out.append(value)
    return np.array(out)


def test_each_term_alone():
    np.testing.assert_allclose(outputs(Pid(2.0, 0.0, 0.0, 9.0), [0.1, -0.2]), [0.2, -0.4])
    np.testing.assert_allclose(outputs(Pid(0.0, 2.0, 0.0, 9.0), [0.1] * 3), [0.01, 0.02, 0.03])
    ramp = outputs(Pid(0.0, 0.0, 2.0, 9.0), 0.3 * 0.05 * np.arange(60))
    assert ramp[0] == 0.0, "there is no slope before the second error"
    assert ramp[-1] == pytest.approx(0.6, rel=1e-3)


def test_the_slope_is_filtered(rng):
    errors = rng.normal(0.0, 0.01, 400)
    filtered, raw = (outputs(Pid(0.0, 0.0, 1.0, 99.0, tau), errors) for tau in (0.1, 0.0))
    assert filtered.std() < 0.4 * raw.std()
    np.testing.assert_allclose(raw[1:], np.diff(errors) / 0.05)


def test_the_output_is_held_and_the_integral_does_not_wind_up():
    pid = Pid(1.0, 5.0, 0.0, 1.0)
    out = outputs(pid, [2.0] * 100 + [-0.1] * 3)
    assert np.abs(out).max() == 1.0
    assert out[-1] < 0.9, "five seconds at the limit are forgotten at once"


def test_pure_pursuit_asks_for_just_the_turn_rate_of_a_circle():
    speed, ahead, radius = 0.3, 0.18, 0.7
    aside = radius - np.sqrt(radius**2 - ahead**2)
    _, rate = Pid(2 * speed / ahead**2, 0.0, 0.0, 9.0).step(PidMemory(), aside, 0.05)
    assert rate == pytest.approx(speed / radius, rel=0.02)
