"""The exponential low-pass against continuous time, the textbook and SciPy."""

import numpy as np
import pytest
from scipy import integrate, signal

from sequential.signal import LowPass


def irregular(rng, n=200):
    return np.cumsum(rng.exponential(0.05, n))


def test_the_textbook_recursion():
    """a = 0.05 at 50 Hz: smooths over 0.4 s, and is as late."""
    low = LowPass(coefficient=0.05, interval=0.02)
    x = np.sin(np.arange(500) * 0.1)
    y, path = x[0], []
    for value in x:
        y += 0.05 * (value - y)
        path.append(y)
    np.testing.assert_allclose(low(x), path, rtol=0, atol=1e-14)
    assert low.tau == pytest.approx(0.4, rel=0.03)
    assert low.group_delay(0.0) == pytest.approx(0.38, rel=1e-12)  # interval (1 - a) / a
    assert low.response().delay_90 == pytest.approx(0.88)  # τ ln 10, in whole samples
    assert low.response().noise_gain == pytest.approx(np.sqrt(0.05 / 1.95), rel=1e-12)


def test_three_ways_to_say_the_same():
    a = 1 - np.exp(-0.02 / 0.4)
    filters = [
        LowPass(time_constant=0.4, interval=0.02),
        LowPass(cutoff_hz=1 / (2 * np.pi * 0.4), interval=0.02),
        LowPass(coefficient=a, interval=0.02),
        LowPass(coefficient=a),
    ]
    x = np.cumsum(np.ones(50)) ** 0.5
    for other in filters[1:]:
        np.testing.assert_allclose(other(x), filters[0](x), rtol=1e-13)
    assert [f.tau for f in filters[:3]] == pytest.approx([0.4] * 3)
    assert filters[3].tau is None


def test_the_cut_off_is_where_the_gain_is_071():
    low = LowPass(cutoff_hz=3.0, interval=1e-5)
    assert low.gain(3.0) == pytest.approx(np.sqrt(0.5), rel=1e-3)
    assert low.phase_delay(3.0) == pytest.approx(np.pi / 4 / (2 * np.pi * 3.0), rel=1e-3)  # 45°
    assert low.group_delay(3.0) == pytest.approx(0.5 * low.tau, rel=1e-3)


@pytest.mark.parametrize("between", ["hold", "line"])
def test_irregular_stamps_are_exact(between, rng):
    """The differential equation τ y' = x(t) - y, integrated between irregular stamps."""
    t, tau = irregular(rng, 40), 0.1
    x = rng.standard_normal(40)
    y, path = x[0], [x[0]]
    for k in range(1, 40):

        def slope(s, value, k=k):
            share = (s - t[k - 1]) / (t[k] - t[k - 1])
            aim = x[k] if between == "hold" else x[k - 1] + share * (x[k] - x[k - 1])
            return (aim - value) / tau

        y = integrate.solve_ivp(slope, (t[k - 1], t[k]), [y], rtol=1e-10, atol=1e-12).y[0, -1]
        path.append(y)
    np.testing.assert_allclose(LowPass(tau, between=between)(t, x), path, rtol=0, atol=1e-8)


def test_a_held_sample_may_be_cut_in_two(rng):
    """What irregular stamps must not change: the same signal, told more often."""
    t, x = irregular(rng), rng.standard_normal(200)
    middle = 0.5 * (t[1:] + t[:-1])
    fine = np.sort(np.concatenate([t, middle]))
    told = x[np.searchsorted(t, fine)]
    np.testing.assert_allclose(LowPass(0.1)(fine, told)[::2], LowPass(0.1)(t, x), rtol=0, atol=1e-14)


def test_a_ramp_at_irregular_stamps_is_late_by_the_time_constant(rng):
    t = irregular(rng, 600)
    np.testing.assert_allclose(LowPass(0.3, between="line")(t, t)[300:], t[300:] - 0.3, rtol=0, atol=1e-9)


def test_a_coefficient_alone_does_not_look_at_stamps(rng):
    t, x = irregular(rng), rng.standard_normal(200)
    assert np.array_equal(LowPass(coefficient=0.2)(t, x), LowPass(coefficient=0.2)(x))
    assert not np.allclose(LowPass(coefficient=0.2, interval=0.05)(t, x), LowPass(coefficient=0.2)(x))


def test_a_pause_counts_in_full(rng):
    t, x = irregular(rng), rng.standard_normal(200)
    gone = rng.random(200) < 0.3
    gone[0] = False
    holes = np.where(gone, np.nan, x)
    low = LowPass(0.2)
    y = low(t, holes)
    assert np.array_equal(y[~gone], low(t[~gone], x[~gone]))
    assert np.array_equal(y[gone], y[np.flatnonzero(gone) - 1])  # held
    np.testing.assert_allclose(list(low.online(zip(t.tolist(), holes.tolist(), strict=True))), y, atol=1e-14)


@pytest.mark.parametrize("between", ["hold", "line"])
def test_scipy_agrees_on_the_frequency_response(between):
    low = LowPass(time_constant=0.1, interval=0.02, between=between)
    impulse = np.zeros(2000)
    impulse[1] = 1.0  # the first sample is where it starts
    taps = low(impulse)[1:]
    hz = np.array([0.0, 0.3, 2.0, 11.0, 24.0])
    _, h = signal.freqz(taps, worN=hz, fs=50.0)
    np.testing.assert_allclose(low.gain(hz), np.abs(h), rtol=1e-10)
    np.testing.assert_allclose(low.phase_delay(hz[1:]), -np.angle(h[1:]) / (2 * np.pi * hz[1:]), rtol=1e-9)
    _, late = signal.group_delay((taps, [1.0]), w=hz, fs=50.0)
    np.testing.assert_allclose(low.group_delay(hz), late * 0.02, rtol=0, atol=1e-10)
    assert low.response().noise_gain == pytest.approx(np.linalg.norm(taps), rel=1e-10)
