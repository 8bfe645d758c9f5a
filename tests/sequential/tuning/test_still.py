"""Noise from a recording at rest: honest intervals, and what is said when it was not at rest."""

import numpy as np
import pytest

import sequential as sq
from sequential.errors import DataError
from sequential.tuning.correlation import autocovariance, effective_counts
from sequential.tuning.resting import resolution

DT = 0.01


def still(values, **options):
    values = np.asarray(values)
    return sq.noise_from_still(sq.Stream(np.arange(len(values)) * DT, values), "z", **options)


def autoregressive(rng, a, count=600):
    """Unit variance, correlation `a` from one to the next."""
    x = np.empty(count)
    x[0] = rng.standard_normal()
    for k in range(1, count):
        x[k] = a * x[k - 1] + (1.0 - a * a) ** 0.5 * rng.standard_normal()
    return x


@pytest.mark.slow
@pytest.mark.parametrize("correlation", [0.0, 0.6, 0.9])
def test_intervals_hold_the_truth_as_often_as_they_say(correlation, seeds):
    """Also with correlation in time, which makes fewer samples of many, and with a drift taken out."""
    inside, runs = 0, 5 * len(seeds)
    for seed in range(runs):
        rng = np.random.default_rng([31, seed])
        found = still(2.0 * autoregressive(rng, correlation) + 0.004 * np.arange(600))
        low, high = found.interval("z σ")
        inside += low <= 2.0 <= high
    assert 0.86 < inside / runs <= 1.0


def test_the_whole_covariance_is_found(rng):
    true = np.array([[0.09, 0.05], [0.05, 0.25]])
    values = rng.multivariate_normal([3.0, -1.0], true, 4000)
    found = still(values, unit="m", declared=[0.09, 0.01])
    np.testing.assert_allclose(found.matrices["noise_cov"], true, atol=0.02)
    assert list(found.values) == ["z v0 σ", "z v1 σ"]
    assert found.units == {"z v0 σ": "m", "z v1 σ": "m"}
    assert found.initial["z v1 σ"] == pytest.approx(0.1)
    assert found.converged
    assert found.message == ""
    assert not found.before.consistent
    assert found.after.consistent
    assert found.after.whitened
    assert found.log_likelihood_after > found.log_likelihood_before
    assert "overconfident" in found.verdict
    assert "consistent" in found.verdict


def test_a_trend_and_a_few_outliers_are_taken_out_and_told(rng):
    values = 0.5 * rng.standard_normal(1000)
    clean = still(values).values["z σ"]
    spoiled = values + 0.003 * np.arange(1000)
    spoiled[[100, 500, 501]] += [8.0, -40.0, 8.0]
    found = still(spoiled)
    assert found.values["z σ"] == pytest.approx(clean, rel=0.01)
    assert found.converged
    told = " ".join(found.notes)
    assert "3 readings of z beyond" in told
    assert "t = 1, 5, 5.01 s" in told
    assert "a drift of +" in told


def test_nan_is_left_out(rng):
    values = rng.standard_normal((500, 2))
    values[10:20, 1] = np.nan
    found = still(values)
    np.testing.assert_allclose(np.sqrt(np.diag(found.matrices["noise_cov"])), 1.0, rtol=0.15)
    assert "10 readings of z hold NaN" in found.notes[0]


@pytest.mark.parametrize(("change", "pattern"), [("louder", "not still"), ("moved", "not still")])
def test_a_recording_that_was_not_still_is_told(rng, change, pattern):
    values = rng.standard_normal(3000)
    if change == "louder":
        values[1000:1400] *= 3.0
    else:
        values[2000:2300] += 20.0 * np.sin(0.05 * np.arange(300))
    found = still(values)
    assert not found.converged
    assert pattern in found.message
    assert ("8.997-12 s" if change == "louder" else "t = 20.") in found.message


def test_correlation_is_told(rng):
    found = still(autoregressive(rng, 0.95, 4000))
    assert "correlated (+0.9" in found.message
    assert not found.after.whitened
    low, high = found.interval("z σ")
    assert high / low > 1.15, "a fifth of what 4000 independent readings would leave"


def test_white_noise_raises_no_alarm(seeds):
    alarms = [still(np.random.default_rng([5, seed]).standard_normal(800)).message for seed in seeds]
    assert sum(map(bool, alarms)) <= 1


@pytest.mark.parametrize("sigma", [0.05, 0.2, 1.0, 5.0])
def test_rounding_has_a_floor(rng, sigma):
    """No variance below LSB²/12, however little the rounded values scatter."""
    values = np.round(rng.normal(0.3, sigma, 2000)) * 0.25
    found = still(values, lsb=0.25)
    assert found.values["z σ"] >= 0.25 / 12**0.5 * (1 - 1e-12)
    expected = 0.25 * max((sigma**2 + 1 / 12) ** 0.5, 1 / 12**0.5)
    if sigma >= 1.0:
        assert found.values["z σ"] == pytest.approx(expected, rel=0.06)
        assert found.notes == ()
    else:
        assert "one step" in found.notes[-1] or "rounding" in found.notes[-1]
    assert found.converged


def test_the_resolution_is_read_off_the_values(rng):
    whole = np.round(3.0 * rng.standard_normal(500))
    assert resolution(whole * 0.0625 + 17.3) == pytest.approx(0.0625)
    assert resolution(rng.standard_normal(500)) == 0.0
    assert resolution(np.ones(50)) == 0.0


def test_a_heading_at_the_seam(rng):
    values = np.angle(np.exp(1j * (np.pi + 0.02 * rng.standard_normal(800))))
    assert np.ptp(values) > 6.0
    found = still(values, manifold=sq.SO2())
    assert found.values["z σ"] == pytest.approx(0.02, rel=0.1)


def test_effective_counts_of_a_known_correlation():
    """Σ a^k = a/(1-a): 1 + 2·9 = 19 times fewer for the mean at a = 0.9, 1 + 2·0.81/0.19 for the variance."""
    means, variances = [], []
    for seed in range(20):
        mean, variance, lag = effective_counts(autoregressive(np.random.default_rng([1, seed]), 0.9, 20_000))
        assert lag == pytest.approx(0.9, abs=0.02)
        means.append(20_000 / mean)
        variances.append(20_000 / variance)
    assert np.mean(means) == pytest.approx(19.0, rel=0.1)
    assert np.mean(variances) == pytest.approx(1 + 2 * 0.81 / 0.19, rel=0.1)


def test_autocovariance_leaves_gaps_out(rng):
    x = autoregressive(rng, 0.8, 5000)
    x[rng.random(5000) < 0.3] = np.nan
    np.testing.assert_allclose(autocovariance(x)[:4], 0.8 ** np.arange(4), atol=0.08)


@pytest.mark.parametrize(
    ("stream", "options", "pattern"),
    [
        (sq.Stream(np.arange(5.0), np.arange(5.0)), {}, "5 readings"),
        (sq.Stream(np.arange(50.0), np.ones(50)), {}, "every reading is the same.*lsb"),
        (sq.Stream(np.arange(50.0), np.ones((50, 2))), {"manifold": sq.SO2()}, "2 columns"),
    ],
)
def test_what_cannot_be_taken(stream, options, pattern):
    with pytest.raises(DataError, match=pattern):
        sq.noise_from_still(stream, "z", **options)


def test_a_log_with_several_streams_needs_a_name(rng):
    stream = sq.Stream(np.arange(50.0), rng.standard_normal(50))
    log = sq.SensorLog({"a": stream, "b": stream})
    with pytest.raises(DataError, match="streams a, b"):
        sq.noise_from_still(log)
    assert list(sq.noise_from_still(log, "b").values) == ["b σ"]
    assert list(sq.noise_from_still(sq.SensorLog({"a": stream})).values) == ["a σ"]
