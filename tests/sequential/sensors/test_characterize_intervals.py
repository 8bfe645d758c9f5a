"""95 % intervals hold the truth 95 times in a hundred: of white, coloured, heavy-tailed, wandering noise."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sequential.sensors import step_response
from sequential.sensors.characterize_level import bias_of, drift_of, slope_of
from sequential.sensors.characterize_noise import noise_of
from sequential.sensors.characterize_outliers import outliers_of
from sequential.sensors.characterize_step_models import first_order, rise_time, second_order

COUNT, RUNS = 2000, 120
T = np.arange(COUNT) * 0.01


def coloured(rng, phi):
    """A first-order process of unit innovations, and its standard deviation."""
    return lfilter([1.0], [1.0, -phi], rng.standard_normal(COUNT + 2000))[2000:], (1.0 - phi**2) ** -0.5


def white(rng):
    return rng.standard_normal(COUNT), 1.0


def heavy(rng):
    return rng.laplace(size=COUNT), 2.0**0.5


def flat(rng):
    return rng.uniform(size=COUNT), 12.0**-0.5


def share(runs, held):
    return sum(held() for _ in range(runs)) / runs


FAMILIES = {
    "white": white,
    "laplace": heavy,
    "uniform": flat,
    "ar 0.5": lambda rng: coloured(rng, 0.5),
    "ar 0.9": lambda rng: coloured(rng, 0.9),
    "ar -0.6": lambda rng: coloured(rng, -0.6),
}


@pytest.mark.parametrize("family", FAMILIES)
def test_sigma(family, rng):
    def held():
        x, sigma = FAMILIES[family](rng)
        line = np.polyval(np.polyfit(T, x, 1), T)
        found = noise_of(x - line).sigma
        return found.low < sigma < found.high

    assert 0.88 <= share(RUNS, held) <= 0.995


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9, 0.97, -0.6])
def test_bias(phi, rng):
    def held():
        x, _ = coloured(rng, phi)
        found = bias_of(T, 5.0 + 0.3 * (T - T.mean()) + x)
        return found.low < 5.0 < found.high

    assert 0.88 <= share(RUNS, held) <= 0.995


def test_white_intervals_would_be_wrong(rng):
    """What the effective number of readings is for: σ/√n holds the mean of coloured noise half the time."""

    def held():
        x, _ = coloured(rng, 0.9)
        return abs(x.mean()) < 1.96 * x.std() / COUNT**0.5

    assert share(RUNS, held) < 0.6


@pytest.mark.parametrize(("phi", "walk"), [(0.0, 0.0), (0.9, 0.0), (0.0, 0.003), (0.0, 0.02), (0.0, 0.2)])
def test_drift(phi, walk, rng):
    def held():
        x = coloured(rng, phi)[0] + np.cumsum(walk * rng.standard_normal(COUNT))
        found = drift_of(T, 0.3 * T + x)
        return found.low < 0.3 < found.high

    assert 0.86 <= share(RUNS, held) <= 1.0


def test_a_drift_that_is_there_is_seen(rng):
    found = drift_of(T, 0.05 * T + rng.standard_normal(COUNT))
    assert 0.0 < found.low < 0.05 < found.high


def test_slope_over_temperature(rng):
    def held():
        heat = 20.0 + 15.0 * (1.0 - np.exp(-T / 6.0))
        x = 0.02 * heat + 0.05 * rng.standard_normal(COUNT) + np.cumsum(2e-4 * rng.standard_normal(COUNT))
        found = slope_of(T, x, heat)
        return found.low < 0.02 < found.high

    assert 0.88 <= share(80, held) <= 1.0


def test_the_share_of_outliers(rng):
    def held():
        bad = rng.random(COUNT) < 0.01
        found = outliers_of(T, rng.standard_normal(COUNT) + 15.0 * bad).share
        return found.low < 0.01 < found.high

    assert 0.9 <= share(60, held) <= 1.0


@pytest.mark.parametrize(
    ("model", "parameters"), [(first_order, (1.234, 0.2)), (second_order, (1.234, 0.05, 0.4))]
)
def test_a_step(model, parameters, rng):
    t, p = np.arange(400) * 0.01, np.array(parameters)
    truth = {
        "latency": 0.034,
        "time_constant": rise_time(model, p, 0.0, 1.0 - np.exp(-1.0)),
        "rise": rise_time(model, p, 0.1, 0.9),
        "size": 5.0,
    }
    inside = dict.fromkeys(truth, 0)
    for _ in range(25):
        found = step_response(t, 2.0 + 5.0 * model(t, p) + 0.1 * rng.standard_normal(400), at=1.2)
        assert found.order == len(p) - 1
        for name, value in truth.items():
            low, high = getattr(found, name)[1:]
            inside[name] += low < value < high
    assert all(count >= 20 for count in inside.values()), inside
