"""Worlds with every sensor: each estimator takes them, and says the truth about itself."""

import numpy as np
import pytest
from sensor_worlds import SENSOR_WORLDS

import sequential as sq
from sequential.compile import compiled
from sequential.jacobians import check_jacobians
from sequential.model import evaluate

every_world = pytest.mark.parametrize("world", SENSOR_WORLDS, ids=repr)
ESTIMATORS = [
    sq.ExtendedKalmanFilter(),
    sq.ExtendedKalmanFilter(form="ud"),
    sq.IteratedExtendedKalmanFilter(),
    sq.UnscentedKalmanFilter(),
    sq.CubatureKalmanFilter(),
]


@every_world
def test_the_models_check_from_other_seeds(world):
    for seed in range(1, 4):
        check_jacobians(world.model, dt=0.05, seed=seed)


@every_world
def test_filters_agree(world, rng):
    """They differ by what linearisation costs, a fraction of what they say that they do not know."""
    problem = world.problem(rng)
    first, *others = (one.solve(problem) for one in ESTIMATORS)
    for run in others:
        apart = np.abs(world.model.manifold.local(first.mean, run.mean)) / first.sigmas()
        assert np.median(apart) < 0.1, run.report.estimator
        assert apart[-1].max() < 0.8, run.report.estimator


def weighted_least_squares(model, plan, r, mean, cov):
    """One Gauss-Newton step of prior and reading r, about the prior's mean."""
    name, d = list(model.sensors)[plan.sensor[r]], model.manifold.dim
    f, sensor = model.sensor_functions[name], model.sensors[name]
    m, u = sensor.manifold.dim, plan.context[r]
    expected = evaluate(f.value, mean, u, 0.0, f.params, sensor.manifold.size)
    h = evaluate(f.jacobian, mean, u, 0.0, f.params, m * d).reshape(m, d)
    residual = sensor.manifold.local(expected, plan.z[r, : sensor.manifold.size])
    weight = np.linalg.inv(sensor.noise_cov)
    after = np.linalg.inv(np.linalg.inv(cov) + h.T @ weight @ h)
    return model.manifold.retract(mean, after @ h.T @ weight @ residual), after


@every_world
def test_one_step_of_gauss_newton_is_the_update(world, rng):
    """The filter's last update, made again as weighted least squares about its prediction."""
    problem = world.problem(rng)
    run = sq.ExtendedKalmanFilter(keep=True).solve(problem)
    k = len(run) - 1
    plan, model = problem.schedule, problem.model
    mean, cov = run.predicted.mean[k], run.predicted.cov[k]
    readings = range(plan.reading_ptr[k], plan.reading_ptr[k + 1])
    assert len(readings) >= 1
    for r in readings:
        mean, cov = weighted_least_squares(model, plan, r, mean, cov)
    scale = run.sigmas()[k]
    assert (np.abs(model.manifold.local(run.mean[k], mean)) / scale).max() < 1e-5


@every_world
def test_fixed_lag_of_everything_is_the_smoother(world, rng):
    problem = world.problem(rng)
    whole = sq.IteratedSmoother(tolerance=1e-10, max_iterations=100).solve(problem)
    lagged = sq.FixedLagSmoother(1e3).solve(problem)
    apart = np.abs(world.model.manifold.local(whole.mean[-1], lagged.mean[-1])) / whole.sigmas()[-1]
    assert apart.max() < 1e-2


@every_world
def test_they_know_how_wrong_they_are(world, seeds):
    """ANEES of the last node, in a wide band: 20 runs of 6 to 23 directions."""
    for estimator in (sq.ExtendedKalmanFilter(), sq.IteratedSmoother()):
        found = []
        for seed in seeds:
            drawn = world.draw(np.random.default_rng(seed))
            run = sq.run(estimator, world.model, drawn.log)
            truth = drawn.truth[np.searchsorted(drawn.t, run.t[-1])]
            error = world.model.manifold.local(run.mean[-1], truth)
            found.append(error @ np.linalg.solve(run.cov[-1], error))
        dim = world.model.manifold.dim
        spread = np.sqrt(2.0 / (dim * len(found)))
        assert abs(np.mean(found) / dim - 1.0) < 4.5 * spread, estimator.name


def test_lowered_worlds_use_no_python():
    for world in SENSOR_WORLDS:
        assert not compiled(world.model).interpreted
