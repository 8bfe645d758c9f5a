"""Noise coefficients: intervals that hold the truth, laws, and sentences about what cannot be seen."""

import numpy as np
import pytest
from noise_worlds import flicker, still_sensor
from scipy.fft import dct

from sequential.errors import DataError, NotFiniteError, ShapeError
from sequential.sensors import allan_deviation, fit_noise
from sequential.sensors.noise_spectrum import cosine_spectrum, flicker_matrix, weights

# samples, Hz, and what the sensor has; what is not named is not there
REGIMES = {
    "white": (20_000, 100.0, {"N": 1.0}),
    "short white": (1000, 100.0, {"N": 1.0}),
    "white and flicker": (20_000, 100.0, {"N": 0.1, "B": 0.1}),
    "white and walk": (20_000, 100.0, {"N": 0.1, "K": 0.1}),
    "weak walk": (20_000, 100.0, {"N": 0.1, "K": 0.01}),
    "all three": (40_000, 50.0, {"N": 0.1, "B": 0.1, "K": 0.02}),
    "quantised and drifting": (10_000, 20.0, {"N": 0.1, "Q": 0.02, "K": 0.05, "R": 0.01}),
    "walk alone": (5000, 10.0, {"K": 0.1}),
    "flicker alone": (10_000, 10.0, {"B": 0.1}),
}


@pytest.mark.slow
@pytest.mark.parametrize("regime", REGIMES)
def test_intervals_hold_the_truth(regime, seeds):
    count, rate, truth = REGIMES[regime]
    inside = dict.fromkeys("NBKQR", 0)
    for seed in seeds:
        fit = fit_noise(still_sensor(np.random.default_rng([seed, 2]), count, rate, **truth), rate)
        for term in inside:
            inside[term] += fit[term].low <= truth.get(term, 0.0) <= fit[term].high
    shares = {term: number / len(seeds) for term, number in inside.items()}
    # 95 %, and more at zero; three standard deviations of so few seeds below that
    least = 0.94 - 3.0 * np.sqrt(0.95 * 0.05 / len(seeds))
    assert min(shares.values()) >= least, shares


def test_white_noise_shows_no_flicker_and_no_walk(rng):
    fit = fit_noise(still_sensor(rng, 20_000, 100.0, N=0.02), 100.0, unit="rad/s")
    assert fit.N.value == pytest.approx(0.02, rel=0.03)
    assert fit.N.visible
    for term in "BK":
        assert not fit[term].visible
        assert np.isnan(fit[term].value)
        assert fit[term].low == 0.0 < fit[term].high
    walk, flick = (next(n for n in fit.notes if name in n) for name in ("Random walk", "Bias instability"))
    assert "not visible in 3.33 min: at most" in flick
    assert "rad/s (95 %). To see one of half that size, record for about" in flick
    assert "rad/s²/√Hz (95 %)" in walk


def test_white_noise_is_the_sample_deviation(rng):
    x = rng.standard_normal(50_000)
    fit = fit_noise(x, 100.0)
    assert fit.N.value == pytest.approx(x.std() / 10.0, rel=0.02)
    assert fit.N.high - fit.N.low == pytest.approx(4 * fit.N.value / np.sqrt(2 * 50_000), rel=0.8)


def test_a_strong_walk_is_that_of_its_steps(rng):
    x = still_sensor(rng, 20_000, 10.0, K=0.3)
    fit = fit_noise(x, 10.0)
    assert fit.K.value == pytest.approx(np.diff(x).std() * np.sqrt(10.0), rel=0.02)
    assert not fit.B.visible


def test_flicker_is_read_at_the_flat_part(rng):
    x = still_sensor(rng, 100_000, 10.0, B=0.5)
    flat = allan_deviation(x, 10.0, taus=np.geomspace(1.0, 100.0, 9)).deviation
    fit = fit_noise(x, 10.0)
    assert fit.B.value == pytest.approx(0.5, rel=0.06)
    assert flat / fit.B.value == pytest.approx(np.full(9, 0.664), rel=0.1)


def test_the_curve_of_the_fit_is_the_deviation(rng):
    x = still_sensor(rng, 200_000, 50.0, N=0.1, B=0.1, K=0.02, Q=0.01)
    fit = fit_noise(x, 50.0)
    measured = allan_deviation(x, 50.0, taus=np.geomspace(0.02, 100.0, 20))
    assert fit.deviation(measured.tau) == pytest.approx(measured.deviation, rel=0.15)


@pytest.mark.parametrize("factor", [1e-6, 300.0])
def test_scale(factor, rng):
    x = still_sensor(rng, 5000, 20.0, N=0.1, B=0.2, K=0.05)
    one, other = fit_noise(x, 20.0), fit_noise(5.0 - factor * x, 20.0)
    for term in "NBKQ":
        assert (other[term].low, other[term].high) == pytest.approx(
            (factor * one[term].low, factor * one[term].high), rel=2e-2
        )
    assert other.R.low == pytest.approx(-factor * one.R.high, rel=2e-2)


def test_time(rng):
    x = still_sensor(rng, 5000, 20.0, N=0.1, B=0.2, K=0.05)
    one, other = fit_noise(x, 20.0), fit_noise(x, 2000.0)
    powers = {"N": -0.5, "B": 0.0, "K": 0.5, "Q": -1.0, "R": 1.0}
    for term, power in powers.items():
        assert other[term].high == pytest.approx(one[term].high * 100.0**power, rel=1e-3)


def test_backwards(rng):
    x = still_sensor(rng, 5000, 20.0, N=0.1, B=0.2, K=0.05)
    one, other = fit_noise(x, 20.0), fit_noise(x[::-1], 20.0)
    for term in "NBKQ":
        assert (other[term].low, other[term].high) == pytest.approx((one[term].low, one[term].high), rel=2e-2)


def test_drift_does_not_pass_for_a_walk(rng):
    x = still_sensor(rng, 20_000, 100.0, N=0.1)
    still, drifting = fit_noise(x, 100.0), fit_noise(x + 0.02 * np.arange(20_000) / 100.0, 100.0)
    assert drifting.K.high == pytest.approx(still.K.high, rel=0.02)
    assert drifting.R.low < 0.02 < drifting.R.high
    assert drifting.R.visible
    assert "A steady drift R of 0.0" in " ".join(drifting.notes)
    assert not still.R.visible


def test_quantisation_does_not_pass_for_white_noise(rng):
    fit = fit_noise(still_sensor(rng, 20_000, 100.0, N=0.01, Q=0.002), 100.0)
    assert fit.N.low < 0.01 < fit.N.high
    assert fit.Q.low < 0.002 < fit.Q.high
    assert "Quantisation noise Q" in " ".join(fit.notes)


@pytest.mark.parametrize("corner", [2.0, 10.0, 30.0])
def test_a_low_pass_filter_leaves_white_noise_as_it_is(corner, rng):
    from scipy.signal import butter, lfilter

    x = lfilter(*butter(2, corner, fs=200.0), rng.standard_normal(100_000))
    fit = fit_noise(x, 200.0)
    assert fit.N.value == pytest.approx(200.0**-0.5, rel=0.06)
    assert fit.top < corner
    assert "low-pass filter" in " ".join(fit.notes)


@pytest.mark.parametrize("amplitude", [0.2, 3.0])
def test_a_vibration_is_named_and_left_out(amplitude, rng):
    t = np.arange(40_000) / 100.0
    fit = fit_noise(rng.standard_normal(len(t)) + amplitude * np.sin(2 * np.pi * 23.2 * t), 100.0)
    assert fit.N.value == pytest.approx(0.1, rel=0.02)
    assert fit.lines[0] == pytest.approx((23.2, amplitude / np.sqrt(2)), rel=0.15)
    assert "Something vibrates at 23.2 Hz" in " ".join(fit.notes)


def test_a_moving_sensor_is_noticed(rng):
    t = np.arange(20_000) / 100.0
    sway = np.cumsum(rng.standard_normal(len(t)))
    sway = np.convolve(sway - sway.mean(), np.hanning(150), "same") * np.sin(2 * np.pi * 0.8 * t)
    fit = fit_noise(rng.standard_normal(len(t)) + sway / sway.std(), 100.0)
    assert fit.misfit is not None or fit.top < 2.0
    assert "touched or vibrated" in " ".join(fit.notes) or "left out" in " ".join(fit.notes)


@pytest.mark.parametrize("height", [50.0, -1000.0])
def test_lone_outliers_are_replaced_and_counted(height, rng):
    x = rng.standard_normal(20_000)
    at = rng.choice(19_000, 30, replace=False) // 2 * 2 + 500
    spiked = x.copy()
    spiked[at] += height
    fit = fit_noise(spiked, 100.0)
    assert fit.spikes == len(set(at))
    assert fit.N.value == pytest.approx(fit_noise(x, 100.0).N.value, rel=0.01)
    assert f"{fit.spikes} lone outliers were replaced by" in " ".join(fit.notes)


def test_a_warm_up_is_told_from_a_walk(rng):
    t = np.arange(20_000) / 100.0
    warm = fit_noise(0.1 * rng.standard_normal(len(t)) + 5.0 * np.exp(-t / 30.0), 100.0)
    assert warm.smooth
    assert "as in a warm-up" in " ".join(warm.notes)
    walk = fit_noise(still_sensor(rng, len(t), 100.0, N=0.1, K=0.1), 100.0)
    assert not walk.smooth


def test_a_coarse_resolution_is_said(rng):
    fit = fit_noise(np.round(0.3 * rng.standard_normal(5000)), 100.0)
    assert "repeat the one before" in " ".join(fit.notes)


@pytest.mark.parametrize(
    ("x", "error", "says"),
    [
        (np.arange(63.0), DataError, "64 samples at least, got 63: record for 3.2 s or more"),
        (np.full(100, 0.25), DataError, "all 100 samples are 0.25: the axis is stuck"),
        (np.arange(100.0) * 0.1, DataError, "the 100 samples lie on a straight line"),
        (np.ones((100, 3)), ShapeError, "call it for each column"),
        (np.append(np.arange(100.0), np.nan), NotFiniteError, "nan at sample 100"),
    ],
)
def test_bad_input_is_answered_by_a_sentence(x, error, says):
    with pytest.raises(error, match=says):
        fit_noise(x, 20.0)


@pytest.mark.parametrize("count", [64, 65, 100, 129, 500])
def test_short_records_give_intervals(count, rng):
    fit = fit_noise(rng.standard_normal(count), 1.0)
    assert fit.N.low < 1.1
    assert fit.N.high > 0.9
    assert fit.B.high > 0.1
    assert fit.K.high > 0.001


# --- the transform ---


def test_white_and_walk_are_what_the_weights_say():
    count = 64
    transform = dct(np.eye(count), type=2, norm="ortho", axis=0)
    walk = transform @ np.minimum.outer(np.arange(count), np.arange(count)) @ transform.T
    k = np.arange(1.0, count)
    assert np.allclose(walk[1:, 1:], np.diag(weights(k, count)[3]), atol=1e-9)
    assert np.allclose(weights(k, count)[1], 1.0)
    pairs = (
        (transform * np.array([1.0]))
        @ (2 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1))
        @ transform.T
    )
    # differences of white phase lack a neighbour at both ends
    assert np.allclose(np.diag(pairs)[1:], weights(k, count)[0], atol=4.0 / count)


def test_flicker_matrix_is_that_of_drawn_flicker(rng):
    size, count = 8, 512
    drawn = np.array([cosine_of(flicker(rng, count), size) for _ in range(4000)])
    measured = 2 * np.pi / count * (drawn.T @ drawn) / len(drawn)
    expected = flicker_matrix(size)
    sure = np.sqrt(np.outer(np.diag(expected), np.diag(expected)) / len(drawn))
    assert np.abs(measured - expected).max() < 5 * (np.sqrt(2) * sure).max()
    assert np.abs((measured - expected) / sure).max() < 6.0


def cosine_of(x, size):
    return dct(x, type=2, norm="ortho")[1 : size + 1]


def test_the_spectrum_keeps_all_the_power(rng):
    x = rng.standard_normal(1000)
    found = cosine_spectrum(x)
    total = found.power.sum() + sum(np.sum(low.value**2) for low in found.low)
    assert total == pytest.approx(1000.0, rel=1e-12)
    assert found.freedom.sum() + sum(len(low.value) for low in found.low) == 999
