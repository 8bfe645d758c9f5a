"""Simulated logs: repeatable, drawn from the model's own statistics, refused where they would not fit."""

import numpy as np
import pytest
from worlds import EVERY_WORLD

import sequential as sq
from sequential.errors import MissingStreamError, ModelError, ShapeError, TimeOrderError
from sequential.simulate import root

every_world = pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)


@every_world
def test_the_same_seed_gives_the_same_log(world):
    one, other = (world.draw(np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(one.truth, other.truth)
    for name, stream in one.log.items():
        np.testing.assert_array_equal(stream.values, other.log[name].values)
    assert np.abs(one.truth - world.draw(np.random.default_rng(4)).truth).max() > 1e-6


@every_world
def test_the_log_fits_the_model(world, rng):
    drawn = world.draw(rng)
    world.model.manifold.check(drawn.truth)
    assert set(drawn.log) == {*world.model.sensors, *([world.model.input] if world.model.input else [])}
    for name, rows in world.readings.items():
        wanted = drawn.t[::rows] if isinstance(rows, int) else drawn.t[rows]
        np.testing.assert_array_equal(drawn.log[name].t, wanted)
    problem = sq.prepare(world.model, drawn.log, at=drawn.t)
    np.testing.assert_array_equal(problem.t, drawn.t)


def test_prior_process_and_sensor_have_their_spread(rng):
    model = sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([1.0, -1.0], [[0.5, 0.2], [0.2, 0.3]]),
        sq.RandomWalk([[0.3, -0.1], [-0.1, 0.2]]),
        {"z": sq.LinearSensor(np.eye(2), [[0.1, 0.05], [0.05, 0.2]])},
    )
    draws = [sq.simulate(model, [0.0, 2.0], rng) for _ in range(4000)]
    first = np.array([drawn.truth[0] for drawn in draws])
    moved = np.array([drawn.truth[1] - drawn.truth[0] for drawn in draws])
    noise = np.array([drawn.log["z"].values[0] - drawn.truth[0] for drawn in draws])
    np.testing.assert_allclose(first.mean(axis=0), [1.0, -1.0], atol=0.05)
    step = 2.0 * np.array([[0.3, -0.1], [-0.1, 0.2]])
    for values, cov in ((first, model.prior.cov), (moved, step), (noise, model.sensors["z"].noise_cov)):
        np.testing.assert_allclose(np.cov(values.T), cov, atol=0.08 * cov.max())


def test_a_root_squares_to_its_covariance_even_if_singular(rng):
    a = rng.standard_normal((4, 2))
    np.testing.assert_allclose(root(a @ a.T) @ root(a @ a.T).T, a @ a.T, atol=1e-12)
    np.testing.assert_array_equal(root(np.zeros((3, 3))), np.zeros((3, 3)))


def driven(start=0.0):
    return sq.StateSpace(
        sq.SE2(), sq.Gaussian([0, 0, 0], 0.1), sq.Unicycle(0.1, 0.1, 0.1),
        {"landmark": sq.RangeBearing([[5.0, 5.0]], 0.01)}, "odometry", start,
    )  # fmt: skip


def test_what_does_not_fit_is_refused(rng):
    good = {"inputs": np.ones((3, 2)), "contexts": {"landmark": [0.0]}}
    t = [0.0, 1.0, 2.0]
    sq.simulate(driven(), t, rng, **good)
    with pytest.raises(TimeOrderError, match="each after the one before"):
        sq.simulate(driven(), [0.0, 1.0, 1.0], rng, **good)
    with pytest.raises(MissingStreamError, match=r"driven by 'odometry'.*shape \(N, 2\)"):
        sq.simulate(driven(), t, rng, contexts=good["contexts"])
    with pytest.raises(ShapeError, match=r"\(3, 2\) or \(2, 2\), got \(3, 1\)"):
        sq.simulate(driven(), t, rng, inputs=np.ones((3, 1)), contexts=good["contexts"])
    with pytest.raises(MissingStreamError, match="sensor 'landmark' needs a context"):
        sq.simulate(driven(), t, rng, inputs=good["inputs"])
    with pytest.raises(ModelError, match="prior holds at 5"):
        sq.simulate(driven(5.0), t, rng, **good)


def test_a_prior_that_would_slip_to_a_later_reading_is_refused(rng):
    model = sq.StateSpace(
        sq.Vector(1), sq.Gaussian([0.0], 1.0), sq.RandomWalk(1.0), {"z": sq.LinearSensor([[1.0]], 1.0)}
    )
    with pytest.raises(ModelError, match="give the StateSpace start=0"):
        sq.simulate(model, [0.0, 1.0, 2.0], rng, readings={"z": [1, 2]})
