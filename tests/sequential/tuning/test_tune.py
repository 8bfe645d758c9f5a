"""Tuning finds the noise that made the data, says how well it knows it, and does not mind where it starts."""

import math

import numpy as np
import pytest
from worlds import EVERY_WORLD

import sequential as sq
from sequential.errors import ModelError, NotFiniteError
from sequential.tuning import innovation_log_likelihood
from sequential.tuning.likelihood import Posterior

WALK, SENSOR = 0.3, 0.5  # what made the data: unit/√s and unit


def walk(values):
    return sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([0.0], 1.0),
        sq.RandomWalk(values["walk"] ** 2),
        {"z": sq.LinearSensor([[1.0]], values["sensor"] ** 2)},
        start=0.0,
    )


def knobs(factor=1.0, decades=1.0):
    return [sq.Knob("walk", WALK * factor, "m/√s", decades), sq.Knob("sensor", SENSOR * factor, "m", decades)]


def walked(rng, count=400):
    return sq.simulate(walk({"walk": WALK, "sensor": SENSOR}), np.arange(count) * 1.0, rng).log


@pytest.mark.parametrize("factor", [1.0, 30.0, 1 / 30.0])
def test_the_noise_that_made_the_data_is_found(factor, rng):
    result = sq.tune(walk, knobs(factor, decades=2.0), walked(rng))
    assert result.converged
    assert result.message == ""
    for name, true in (("walk", WALK), ("sensor", SENSOR)):
        off = math.log10(result.values[name] / true)
        assert abs(off) < 4.0 * result.decades[name]
        assert 0.005 < result.decades[name] < 0.1
        low, high = result.interval(name, 4.0)
        assert low < true < high
        assert result.factor(name) == pytest.approx(result.values[name] / result.initial[name])
    assert result.log_likelihood_after > result.log_likelihood_before or factor == 1.0
    assert result.evaluations < 250


@pytest.mark.slow
def test_the_intervals_are_honest(seeds):
    """Over many draws, the errors in decades are as large as the curvature says."""
    scores = []
    for seed in seeds:
        result = sq.tune(walk, knobs(3.0, decades=3.0), walked(np.random.default_rng([3, seed])))
        scores += [
            math.log10(result.values[n] / t) / result.decades[n]
            for n, t in (("walk", WALK), ("sensor", SENSOR))
        ]
    assert 0.5 < np.mean(np.square(scores)) < 1.6


def test_the_likelihood_before_and_after_are_those_of_the_filter(rng):
    log = walked(rng)
    result = sq.tune(walk, knobs(3.0), log)
    for values, expected in (
        (result.initial, result.log_likelihood_before),
        (result.values, result.log_likelihood_after),
    ):
        assert sq.run(sq.KalmanFilter(), walk(values), log).log_likelihood == pytest.approx(expected)


def test_a_tight_prior_holds_a_knob(rng):
    log = walked(rng)
    held = sq.tune(walk, knobs(3.0, decades=0.001), log)
    for name, initial in held.initial.items():
        assert held.values[name] == pytest.approx(initial, rel=0.02)


def test_a_knob_without_effect_stays_with_its_prior(rng):
    """Its interval is the prior's, one decade: honest about knowing nothing."""
    idle = [*knobs(2.0), sq.Knob("idle", 7.0)]
    result = sq.tune(walk, idle, walked(rng))
    assert result.values["idle"] == pytest.approx(7.0, rel=0.01)
    assert result.decades["idle"] == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(
    "estimator",
    [sq.KalmanFilter(), sq.UnscentedKalmanFilter(), sq.IteratedExtendedKalmanFilter()],
    ids=lambda e: e.name,
)
def test_any_filter_can_be_tuned_with(estimator, rng):
    log = walked(rng, 100)
    ekf, other = (sq.tune(walk, knobs(3.0), log, estimator=e) for e in (None, estimator))
    for name in ekf.values:
        assert other.values[name] == pytest.approx(ekf.values[name], rel=1e-3)


def test_a_nonlinear_world_is_tuned(rng):
    world = next(world for world in EVERY_WORLD if "range and bearing" in world.name)

    def build(values):
        sensor = sq.RangeBearing(
            world.model.sensors["landmark"].landmarks, sq.diagonal([values["range"], values["bearing"]])
        )
        return sq.StateSpace(
            sq.SE2(),
            world.model.prior,
            world.model.process,
            {"landmark": sensor},
            input="odometry",
            start=0.0,
        )

    drawn = world.draw(rng)
    result = sq.tune(build, [sq.Knob("range", 0.5), sq.Knob("bearing", 0.2)], drawn.log)
    for name, true in (("range", 0.1), ("bearing", 0.03)):
        assert abs(math.log10(result.values[name] / true)) < 4.0 * result.decades[name]


def test_a_gate_does_not_reward_rejecting():
    """With everything rejected the likelihood must not be better than with everything used."""

    def gated(values):
        model = walk({"walk": WALK, "sensor": values["sensor"]})
        sensor = sq.LinearSensor([[1.0]], values["sensor"] ** 2, gate=0.99)
        return sq.StateSpace(model.manifold, model.prior, model.process, {"z": sensor}, start=0.0)

    log = walked(np.random.default_rng(2))
    result = sq.tune(gated, [sq.Knob("sensor", 0.05, decades=2.0)], log)
    assert result.values["sensor"] == pytest.approx(SENSOR, rel=0.25)
    run = sq.run(sq.KalmanFilter(), gated({"sensor": 0.01}), log)
    assert run.report.rejected > 50
    assert innovation_log_likelihood(run, gated({"sensor": 0.01})) < run.log_likelihood


def test_failing_evaluations_are_steps_to_avoid(rng):
    """A builder may refuse values, as long as it takes the initial ones."""

    def picky(values):
        if values["sensor"] > 3.0:
            raise ModelError("no sensor is that bad")
        return walk(values)

    result = sq.tune(picky, knobs(2.0), walked(rng))
    assert result.values["sensor"] == pytest.approx(SENSOR, rel=0.3)


def test_the_initial_values_must_work():
    def broken(values):
        def see(x):
            return np.array([math.nan * x[0]])

        return sq.StateSpace(
            sq.Vector(1), sq.Gaussian([0.0], 1.0), sq.RandomWalk(1.0),
            {"z": sq.Sensor(see, values["sensor"])}, start=0.0, check=False,
        )  # fmt: skip

    log = sq.SensorLog({"z": sq.Stream([0.0, 1.0], [0.0, 1.0])})
    with pytest.raises(NotFiniteError):
        sq.tune(broken, [sq.Knob("sensor", 1.0)], log)


def test_a_builder_must_keep_the_layout(rng):
    def fickle(values):
        model = walk(values)
        name = "z" if values["walk"] == WALK else "y"
        return sq.StateSpace(
            model.manifold, model.prior, model.process, {name: model.sensors["z"]}, start=0.0
        )

    log = walked(rng, 10)
    posterior = Posterior(
        fickle, tuple(knobs()), sq.prepare(walk({"walk": WALK, "sensor": SENSOR}), log), sq.KalmanFilter()
    )
    with pytest.raises(ModelError, match="model of another layout"):
        posterior.log_likelihood(np.ones(2))


def test_knobs_are_positive_and_have_names(rng):
    for bad in ({"initial": 0.0}, {"initial": -1.0}, {"initial": math.nan}, {"initial": 1.0, "decades": 0.0}):
        with pytest.raises(ModelError, match="searched on a logarithmic scale"):
            sq.Knob("walk", **bad)
    for names in ([], ["walk", "walk"]):
        with pytest.raises(ModelError, match="knobs with different names"):
            sq.tune(walk, [sq.Knob(name, 1.0) for name in names], walked(rng, 5))
