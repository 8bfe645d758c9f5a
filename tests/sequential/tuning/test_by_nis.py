"""Q by the NIS: it reaches its band, says how well it knows, and says when it cannot."""

import re

import numpy as np
import pytest

import sequential as sq
from sequential.errors import ModelError

WALK, SENSOR = 0.3, 0.5


def walk(values, **options):
    sensor = sq.LinearSensor([[1.0]], values["sensor"] ** 2, **options)
    return sq.StateSpace(
        sq.Vector(1), sq.Gaussian([0.0], 1.0), sq.RandomWalk(values["walk"] ** 2), {"z": sensor}, start=0.0
    )


def knobs(walk=WALK, sensor=SENSOR):
    return [sq.Knob("walk", walk, "m/√s"), sq.Knob("sensor", sensor, "m")]


def walked(rng, count=400):
    return sq.simulate(walk({"walk": WALK, "sensor": SENSOR}), np.arange(count) * 1.0, rng).log


@pytest.mark.parametrize("start", [0.003, 0.3, 30.0])
def test_the_mean_nis_becomes_one(start, rng):
    log = walked(rng)
    found = sq.tune_by_nis(walk, knobs(walk=start), log, turn=["walk"])
    assert found.converged
    assert found.method == "nis"
    assert found.values["sensor"] == SENSOR
    run = sq.run(sq.KalmanFilter(), walk(found.values), log)
    assert run.innovations["z"].nis().mean() == pytest.approx(1.0, abs=2e-3)
    low, high = found.interval("walk")
    assert low < WALK < high
    assert found.after.consistent
    assert found.model.process.density == pytest.approx(found.values["walk"] ** 2)
    assert found.notes == ("held as they were: sensor",)
    assert found.evaluations < 50


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say(seeds):
    runs, inside = 2 * len(seeds), 0
    for seed in range(runs):
        log = walked(np.random.default_rng([17, seed]))
        low, high = sq.tune_by_nis(walk, knobs(walk=1.0), log, turn=["walk"]).interval("walk")
        inside += low <= WALK <= high
    assert 0.84 < inside / runs <= 1.0


def test_all_knobs_by_one_factor_has_a_closed_form(rng):
    """Every σ times f divides the NIS by f²."""
    log = walked(rng)
    declared = knobs(walk=WALK * 3.0, sensor=SENSOR * 3.0)
    values = {knob.name: knob.initial for knob in declared}
    model = walk(values)
    model = sq.StateSpace(
        model.manifold, sq.Gaussian([0.0], 1e9), model.process, model.sensors, start=0.0
    )  # a prior that weighs nothing
    nis = sq.run(sq.KalmanFilter(), model, log).innovations["z"].nis()[1:].mean()
    found = sq.tune_by_nis(walk, declared, log)
    assert found.factor("walk") == pytest.approx(found.factor("sensor"))
    assert found.factor("walk") == pytest.approx(nis**0.5, rel=0.02)


def wandering_beside(values):
    """The part that wanders is not the part that is seen."""
    process = sq.RandomWalk([values["walk"] ** 2, 0.0])
    sensors = {"z": sq.LinearSensor([[0.0, 1.0]], 0.01**2)}
    return sq.StateSpace(sq.Vector(2), sq.Gaussian([0.0, 0.0], [1.0, 1e-8]), process, sensors, start=0.0)


def assert_not_there(found, pattern):
    __tracebackhide__ = True
    assert not found.converged
    assert found.values == found.initial
    assert found.interval("walk") == (0.0, np.inf)
    assert re.search(pattern, found.message)
    assert found.message in found.verdict


def test_a_value_that_is_not_there_is_told(rng):
    """R declared too large: innovations never reach it.  A part that nobody sees: Q explains nothing."""
    found = sq.tune_by_nis(walk, knobs(sensor=SENSOR * 6.0), walked(rng), turn=["walk"])
    assert_not_there(found, "stays below .*R is too large")
    log = sq.SensorLog({"z": sq.Stream(np.arange(100.0), rng.standard_normal(100))})
    found = sq.tune_by_nis(wandering_beside, [sq.Knob("walk", 0.1)], log)
    assert_not_there(found, "stays above .*R is too small")


@pytest.mark.parametrize("guard", [{"gate": 0.999}, {"loss": sq.Loss("huber", 1.345)}], ids=["gate", "loss"])
def test_outliers_behind_a_guard_do_not_set_q(guard, rng):
    log = walked(rng)
    values = np.array(log["z"].values)
    values[::40] += 30.0
    spoiled = log.replaced(z=sq.Stream(log["z"].t, values))
    plain = sq.tune_by_nis(walk, knobs(), spoiled, turn=["walk"])
    found = sq.tune_by_nis(lambda v: walk(v, **guard), knobs(), spoiled, turn=["walk"]).values["walk"]
    assert not plain.converged
    assert "outliers" in plain.message
    assert 0.8 * WALK < found < 2 * WALK


def test_one_sensor_of_two_may_be_looked_at(rng):
    def build(values):
        sensors = {"a": sq.LinearSensor([[1.0]], 0.25), "b": sq.LinearSensor([[1.0]], 100.0)}
        process = sq.RandomWalk(values["walk"] ** 2)
        return sq.StateSpace(sq.Vector(1), sq.Gaussian([0.0], 1.0), process, sensors, start=0.0)

    log = sq.simulate(walk({"walk": WALK, "sensor": SENSOR}), np.arange(300.0), rng).log
    both = sq.SensorLog({"a": log["z"], "b": log["z"]})
    found = sq.tune_by_nis(build, [sq.Knob("walk", 1.0)], both, sensors=["a"])
    assert found.after.nis["a"].mean == pytest.approx(1.0, abs=2e-3)
    assert found.after.nis["b"].mean < 0.1
    with pytest.raises(ModelError, match="no sensor 'c'"):
        sq.tune_by_nis(build, [sq.Knob("walk", 1.0)], both, sensors=["c"])


def test_names_are_checked(rng):
    log = walked(rng, 20)
    with pytest.raises(ModelError, match="no knob is called 'wlak'; there are walk, sensor"):
        sq.tune_by_nis(walk, knobs(), log, turn=["wlak"])
    with pytest.raises(ModelError, match="needs a knob to turn"):
        sq.tune_by_nis(walk, knobs(), log, turn=[])
