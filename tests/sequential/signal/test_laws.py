"""What holds for every filter of one signal, and for every linear one."""

from itertools import pairwise

import numpy as np
import pytest

from sequential.log import Stream
from sequential.signal import (
    Hampel,
    LowPass,
    MovingMean,
    SlidingMedian,
    measure_noise_gain,
    measure_step_delay,
)

LINEAR = [
    LowPass(time_constant=0.4, interval=0.02),
    LowPass(cutoff_hz=2.0, interval=0.02, between="line"),
    LowPass(coefficient=0.05),
    LowPass(coefficient=0.3, interval=0.02, between="line"),
    LowPass(coefficient=1.0),
    *(MovingMean(k, centred) for k in (1, 2, 10, 11, 40) for centred in (False, True)),
]
CURVED = [
    *(SlidingMedian(k, centred) for k in (1, 2, 9, 10, 41) for centred in (False, True)),
    *(Hampel(k, centred) for k in (7, 12) for centred in (False, True)),
]
EVERY_FILTER = [pytest.param(f, id=repr(f)) for f in (*LINEAR, *CURVED)]
LINEAR_FILTERS = [pytest.param(f, id=repr(f)) for f in LINEAR]
CAUSAL_FILTERS = [pytest.param(f, id=repr(f)) for f in (*LINEAR, *CURVED) if f.response().lookahead == 0]


@pytest.mark.parametrize("filter_", EVERY_FILTER)
def test_a_constant_stays_as_it_is(filter_):
    x = np.full(200, 17.3)
    np.testing.assert_allclose(filter_(x), x, rtol=1e-15)


@pytest.mark.parametrize("filter_", EVERY_FILTER)
def test_units_do_not_matter(filter_, rng):
    x = rng.standard_normal(300)
    np.testing.assert_allclose(filter_(3.0 - 8.0 * x), 3.0 - 8.0 * filter_(x), rtol=0, atol=1e-12)


@pytest.mark.parametrize("filter_", LINEAR_FILTERS)
def test_what_is_linear_superposes(filter_, rng):
    x, y = rng.standard_normal((2, 300))
    np.testing.assert_allclose(filter_(2 * x - 5 * y), 2 * filter_(x) - 5 * filter_(y), rtol=0, atol=1e-13)


@pytest.mark.parametrize("filter_", EVERY_FILTER)
def test_the_delay_of_a_step_is_as_stated(filter_):
    stated = filter_.response(0.02)
    assert measure_step_delay(filter_, 0.02, settle=200) == pytest.approx(stated.delay_90, abs=1e-12)


@pytest.mark.parametrize("filter_", EVERY_FILTER)
def test_the_noise_let_through_is_as_stated(filter_, rng):
    measured = measure_noise_gain(filter_, rng, 0.02, samples=100_000)
    # about 100 correlated samples at most: 1000 independent ones, 2.2 %
    assert measured == pytest.approx(filter_.response(0.02).noise_gain, rel=0.07)


@pytest.mark.parametrize("filter_", EVERY_FILTER)
def test_an_output_sees_no_further_ahead_than_stated(filter_, rng):
    ahead = round(filter_.response(1.0).lookahead)
    x = rng.standard_normal(200)
    changed = x.copy()
    changed[100:] += 100.0
    same = filter_(x) == filter_(changed)
    assert same[: 100 - ahead].all()
    if not isinstance(filter_, Hampel | SlidingMedian):
        assert not same[100 - ahead]


@pytest.mark.parametrize("filter_", CAUSAL_FILTERS)
def test_sample_by_sample_gives_what_the_whole_signal_gives(filter_, rng):
    x = rng.standard_normal(300)
    x[rng.random(300) < 0.2] = np.nan
    np.testing.assert_allclose(list(filter_.online(x.tolist())), filter_(x), rtol=0, atol=1e-13)


@pytest.mark.parametrize("filter_", CAUSAL_FILTERS)
def test_a_state_is_never_changed(filter_, rng):
    state = filter_.start()
    for x in rng.standard_normal(30):
        _, state = filter_.step(state, float(x))
    ahead = [filter_.step(state, x)[0] for x in (5.0, -5.0, 5.0)]
    assert ahead[0] == ahead[2]


@pytest.mark.parametrize("filter_", EVERY_FILTER)
def test_arrays_stamps_columns_and_streams(filter_, rng):
    x = rng.standard_normal((50, 2))
    t = np.arange(50) * 0.02
    stream = filter_(Stream(t, x, np.arange(50.0), "before"))
    assert np.array_equal(stream.t, Stream(t, x).t)
    assert stream.covers == "before"
    assert np.array_equal(stream.context[:, 0], np.arange(50.0))
    for c in range(2):
        assert np.array_equal(filter_(t, x)[:, c], filter_(t, x[:, c]))
        np.testing.assert_allclose(stream.values[:, c], filter_(x[:, c]), rtol=0, atol=1e-14)
    assert filter_(np.zeros(0)).shape == (0,)
    assert filter_(t[:0], x[:0]).shape == (0, 2)


@pytest.mark.parametrize("filter_", EVERY_FILTER)
def test_a_missing_sample_is_skipped(filter_, rng):
    x = rng.standard_normal(120)
    holes = x.copy()
    holes[[0, 1, 40, 77, 78]] = np.nan
    y = filter_(holes)
    assert np.isfinite(filter_(x)).all()
    assert not np.isinf(y).any()
    assert np.isnan(filter_(np.full(20, np.nan))).all()
    if isinstance(filter_, Hampel):
        assert np.array_equal(np.isnan(y), np.isnan(holes))  # it judges samples, and fills nothing
    elif getattr(filter_, "window", 40) > 3:
        assert np.isfinite(y[2:]).all()


@pytest.mark.parametrize("filter_", LINEAR_FILTERS)
def test_a_ramp_and_a_sine_are_late_by_the_stated_delays(filter_):
    interval, hz = 0.02, 1.5
    t = np.arange(3000) * interval
    late = filter_.group_delay(0.0, interval)
    settled = slice(2000, -100)
    np.testing.assert_allclose(filter_(t, t)[settled], (t - late)[settled], rtol=0, atol=1e-9)
    assert filter_.phase_delay(0.0, interval) == pytest.approx(late, abs=1e-12)
    expected = filter_.gain(hz, interval) * np.sin(2 * np.pi * hz * (t - filter_.phase_delay(hz, interval)))
    np.testing.assert_allclose(filter_(t, np.sin(2 * np.pi * hz * t))[settled], expected[settled], atol=1e-9)


@pytest.mark.parametrize("filter_", LINEAR_FILTERS)
def test_group_delay_is_the_slope_of_the_phase(filter_):
    hz, step = 1.5, 1e-4
    phases = [f * filter_.phase_delay(f, 0.02) for f in (hz - step, hz + step)]
    slope = (phases[1] - phases[0]) / (2 * step)
    assert filter_.group_delay(hz, 0.02) == pytest.approx(slope, abs=1e-8)


@pytest.mark.parametrize(
    "family",
    [
        [LowPass(coefficient=a) for a in (0.5, 0.2, 0.05)],
        [MovingMean(k) for k in (3, 11, 41)],
        [SlidingMedian(k) for k in (3, 11, 41)],
    ],
    ids=lambda family: type(family[0]).__name__,
)
def test_less_noise_is_paid_for_in_delay(family):
    for quick, slow in pairwise(f.response() for f in family):
        assert slow.noise_gain < quick.noise_gain
        assert slow.delay_90 > quick.delay_90
