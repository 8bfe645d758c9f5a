"""What expectation-maximisation cannot be asked, and readings that leave it nothing to estimate."""

import dataclasses

import numpy as np
import pytest
from worlds import random_walk

import sequential as sq
from sequential.errors import DataError, ModelError


@pytest.mark.parametrize(
    ("options", "pattern"),
    [
        ({"process": "ful"}, "structure of the process noise is one of full"),
        ({"process": [[1, 1, 0], [1, 1, 1], [0, 1, 1]]}, "made of blocks"),
        ({"process": [[1, 0], [0, 1]]}, r"shape \(3, 3\)"),
        ({"sensors": {"pear": "full"}}, "no sensor 'pear'"),
        ({"process": "held", "sensors": "held"}, "nothing to estimate"),
        ({"prior": "free"}, "'held', 'mean' or 'both'"),
    ],
)
def test_what_cannot_be_asked(options, pattern, rng):
    world = random_walk()
    with pytest.raises(ModelError, match=pattern):
        sq.expectation_maximization(world.model, world.draw(rng).log, **options)


def test_readings_without_noise_end_in_a_sentence():
    log = sq.SensorLog({"z": sq.Stream(np.arange(60.0), np.zeros(60))})

    def build(values):
        sensors = {"z": sq.LinearSensor([[1.0]], values["r"])}
        process = sq.RandomWalk(values["q"])
        return sq.StateSpace(sq.Vector(1), sq.Gaussian([0.0], 1.0), process, sensors, start=0.0)

    knobs = [sq.Knob("q", 1.0), sq.Knob("r", 1.0)]
    model = build({"q": 1.0, "r": 1.0})
    found = sq.expectation_maximization(model, log, iterations=2000, tolerance=-1.0, prior="both")
    assert found.message  # where it ends, rounding decides: nothing is left, or nothing is gained
    assert not found.converged
    assert max(found.values.values()) < 1e-9
    assert "R is too large" in sq.tune_by_nis(build, knobs, log, turn=["q"]).message
    with pytest.raises(DataError, match="no noise to be estimated"):
        sq.autocovariance_least_squares(model, log)


@pytest.mark.parametrize("guard", [{"gate": 0.99}, {"loss": sq.Loss("huber", 1.345)}])
def test_guarded_sensors_are_refused(guard, rng):
    world = random_walk()
    sensors = {**world.model.sensors, "sum": sq.LinearSensor([[1.0, 1.0, 1.0]], 0.4, **guard)}
    model = dataclasses.replace(world.model, sensors=sensors)
    with pytest.raises(ModelError, match=r"sensor 'sum' has a .*tune"):
        sq.expectation_maximization(model, world.draw(rng).log)
