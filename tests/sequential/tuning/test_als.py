"""Autocovariance least squares: the theory of a mistuned filter, and the noise it reveals."""

import dataclasses

import numpy as np
import pytest
from worlds import unicycle_range_bearing

import sequential as sq
from sequential.errors import DataError, ModelError, NonlinearModelError
from sequential.tuning import autocovariance_least_squares as als
from sequential.tuning.als import _expected, _noises, _settled_innovations

TRUE = {"process σ": (0.1 / 0.5) ** 0.5, "position x0 σ": 0.5, "position x1 σ": 0.5**0.5, "speed σ": 2.0}


def build(density=0.1, position=(0.25, 0.5), speed=4.0, **options):
    sensors = {
        "position": sq.LinearSensor([[1.0, 0, 0, 0], [0, 1.0, 0, 0]], list(position)),
        "speed": sq.LinearSensor([[0, 0, 1.0, 0]], speed, **options),
    }
    prior = sq.Gaussian([0.0, 1.0, 1.0, -0.5], [1.0, 1.0, 0.25, 0.25])
    return sq.StateSpace(sq.Vector(4), prior, sq.ConstantVelocity(density, axes=2), sensors, start=0.0)


def mistuned(**options):
    return build(0.5, (1.0, 1.0), 1.0, **options)


def drawn(rng, count=2000, dt=0.25):
    return sq.simulate(build(), np.arange(count) * dt, rng).log


def test_the_noise_that_made_the_data_is_found(rng):
    found = als(mistuned(), drawn(rng, 4000))
    assert set(found.values) == set(TRUE)
    for name, true in TRUE.items():
        low, high = found.interval(name, 4.0)
        assert low < true < high
        assert 0.002 < found.decades[name] < 0.05
    assert found.evaluations == 5
    assert not found.before.consistent
    assert found.after.consistent
    assert found.after.whitened
    assert found.log_likelihood_after > found.log_likelihood_before + 500
    assert found.model.process.acceleration_density == pytest.approx(0.5 * found.values["process σ"] ** 2)


def test_it_agrees_with_maximum_likelihood(rng):
    log = drawn(rng)
    found = als(mistuned(), log)
    knobs = [sq.Knob("density", 0.5), sq.Knob("x", 1.0), sq.Knob("y", 1.0), sq.Knob("speed", 1.0)]
    best = sq.tune(lambda v: build(v["density"], (v["x"], v["y"]), v["speed"]), knobs, log)
    levels = [(best.values["density"] / 0.5) ** 0.5, *(best.values[n] ** 0.5 for n in ("x", "y", "speed"))]
    for name, level in zip(TRUE, levels, strict=True):
        low, high = found.interval(name)
        assert low < level < high
    assert best.log_likelihood_after - found.log_likelihood_after < 3.0, "nearly as good, in five passes"


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say(seeds):
    inside, total = 0, 0
    for seed in range(len(seeds)):
        found = als(mistuned(), drawn(np.random.default_rng([53, seed]), 1000))
        for name, true in TRUE.items():
            low, high = found.interval(name)
            inside, total = inside + (low <= true <= high), total + 1
    assert 0.85 < inside / total <= 1.0


def test_a_mistuned_filter_correlates_as_predicted(rng):
    """E[e_{k+j} e_kᵀ] of a filter with wrong noises, against its innovations over a long log."""
    wrong, log = mistuned(), drawn(rng, 20_000)
    problem = sq.prepare(wrong, log)
    run = sq.KalmanFilter(keep=True).solve(problem)
    settled = sq.steady_state(wrong, 0.25)
    seen = _settled_innovations(problem, run, settled)
    true = sq.steady_state(build(), 0.25)
    expected = [np.zeros((3, 3)) for _ in range(6)]
    for noise in _noises(build(), build(), true):
        made = _expected(noise, settled, 6)
        expected = [total + one for total, one in zip(expected, made, strict=True)]
    for j, wanted in enumerate(expected):
        got = seen[j:].T @ seen[: len(seen) - j] / (len(seen) - j)
        scale = np.sqrt(np.outer(np.diag(expected[0]), np.diag(expected[0])))
        np.testing.assert_allclose(got / scale, wanted / scale, atol=0.05)


def test_a_noise_that_is_not_there_is_open_below(rng):
    log = sq.simulate(build(density=1e-9), np.arange(600) * 0.25, rng).log
    found = als(build(density=0.05), log)
    low, high = found.interval("process σ")
    assert low == 0.0
    assert high < 0.5
    assert found.unidentified == ("process σ",)
    assert "process σ is not identified: anything below" in found.verdict


def test_coupled_axes_take_one_factor(rng):
    model = build()
    sensors = {
        **model.sensors,
        "position": sq.LinearSensor([[1.0, 0, 0, 0], [0, 1.0, 0, 0]], [[2.0, 0.5], [0.5, 2.0]]),
    }
    found = als(dataclasses.replace(model, sensors=sensors), drawn(rng, 500))
    assert found.units["position σ"] == "×"
    cov = found.model.sensors["position"].noise_cov
    assert cov[0, 1] / cov[0, 0] == pytest.approx(0.25)


def test_what_it_does_not_take(rng):
    log = drawn(rng, 300)
    world = unicycle_range_bearing()
    with pytest.raises(NonlinearModelError):
        als(world.model, world.draw(rng).log)
    with pytest.raises(ModelError, match="has a gate"):
        als(build(gate=0.99), log)
    with pytest.raises(DataError, match="lags need four times"):
        als(build(), log, lags=200)
    with pytest.raises(DataError, match="50 steps at least"):
        als(build(), drawn(rng, 20))
    fewer = log.replaced(speed=log["speed"].select(np.arange(0, 300, 2)))
    with pytest.raises(DataError, match="every sensor, whole, at every step"):
        als(build(), fewer)
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 0.6, 200))])
    with pytest.raises(DataError, match="one interval throughout"):
        als(build(), sq.simulate(build(), t, rng).log)
