"""Models that no filter can take, and models that fail on the way: one sentence each."""

import math

import numpy as np
import pytest
from worlds import CURVED_WORLDS, LINEAR_WORLDS

import sequential as sq
from sequential.errors import (
    MissingStreamError,
    NonlinearModelError,
    NotFiniteError,
)

EVERY_ESTIMATOR = [
    sq.ExtendedKalmanFilter(),
    sq.IteratedExtendedKalmanFilter(),
    sq.UnscentedKalmanFilter(),
    sq.RauchTungStriebel(),
    sq.RauchTungStriebel(sq.UnscentedKalmanFilter()),
    sq.IteratedSmoother(),
    *(sq.ExtendedKalmanFilter(form=form) for form in ("ud", "sqrt", "information")),
    *(sq.IteratedExtendedKalmanFilter(form=form) for form in ("ud", "sqrt")),
]
every_estimator = pytest.mark.parametrize("estimator", EVERY_ESTIMATOR, ids=lambda e: e.name)


@pytest.mark.parametrize("world", CURVED_WORLDS, ids=repr)
def test_the_kalman_filter_refuses_what_is_not_linear(world, rng):
    log = world.draw(rng).log
    with pytest.raises(NonlinearModelError, match=r"takes linear models only: .*use ExtendedKalmanFilter"):
        sq.run(sq.KalmanFilter(), world.model, log)


@pytest.mark.parametrize("world", LINEAR_WORLDS, ids=repr)
def test_the_kalman_filter_takes_what_is(world, rng):
    assert sq.run(sq.KalmanFilter(), world.model, world.draw(rng).log).report.estimator == "kf"


def one_number(step, observe, noise=0.1):
    return sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([1.0], 1.0),
        sq.Process(step, noise_density=0.1),
        {"z": sq.Sensor(observe, noise)},
        start=0.0,
        check=False,
    )


LOG = sq.SensorLog({"z": sq.Stream(np.arange(20.0), np.linspace(1.0, 0.5, 20))})


def still(x, dt):
    return np.array([x[0] + 0.0 * dt])


def late_nan(x, dt):
    return np.array([math.nan if dt > 0.5 else x[0]])


def see(x):
    return np.array([x[0]])


def see_nan(x):
    return np.array([math.nan * x[0]])


@every_estimator
@pytest.mark.parametrize(("step", "observe"), [(late_nan, see), (still, see_nan)], ids=["step", "observe"])
def test_nan_from_a_model_is_called_by_its_name(estimator, step, observe):
    with pytest.raises(
        NotFiniteError, match=r"model function returned NaN .* (at|from) \d|at \d.*returned NaN"
    ):
        sq.run(estimator, one_number(step, observe), LOG)


@pytest.mark.parametrize("estimator", EVERY_ESTIMATOR[:2], ids=lambda e: e.name)
def test_an_innovation_covariance_lost_to_rounding_is_no_obstacle(estimator):
    """Two readings of the same thing, far more exact than double precision can tell apart."""
    model = sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 0.0], 1.0),
        sq.RandomWalk(0.0),
        {"twice": sq.LinearSensor([[1.0, 1.0], [1.0, 1.0]], 1e-20)},
        start=0.0,
    )
    log = sq.SensorLog({"twice": sq.Stream([0.0, 1.0], [[1.0, 1.0], [1.0, 1.0]])})
    run = sq.run(estimator, model, log)
    np.testing.assert_allclose(run.mean, 0.5, atol=1e-9)
    np.testing.assert_allclose(run.cov, np.broadcast_to([[0.5, -0.5], [-0.5, 0.5]], (2, 2, 2)), atol=1e-9)


@every_estimator
def test_a_missing_stream_is_named(estimator):
    with pytest.raises(MissingStreamError, match="has no stream 'z'; it has other"):
        sq.run(estimator, one_number(still, see), sq.SensorLog({"other": LOG["z"]}))


def test_a_run_without_any_sensor_is_dead_reckoning():
    """A model may have no sensor at all: the nodes are then the asked-for times."""
    model = sq.StateSpace(sq.Vector(1), sq.Gaussian([1.0], 1.0), sq.RandomWalk(0.5), {}, start=0.0)
    run = sq.run(sq.ExtendedKalmanFilter(), model, LOG, at=np.array([0.0, 2.0, 4.0]))
    np.testing.assert_allclose(run.cov[:, 0, 0], [1.0, 2.0, 3.0])
    assert run.log_likelihood == 0.0


@every_estimator
def test_a_single_node_is_a_run(estimator):
    log = sq.SensorLog({"z": sq.Stream([0.0], [2.0])})
    run = sq.run(estimator, one_number(still, see), log)
    np.testing.assert_allclose(run.mean, [[1.0 + 1.0 / 1.1]])
    np.testing.assert_allclose(run.cov, [[[0.1 / 1.1]]])
