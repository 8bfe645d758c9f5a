"""Trajectories drawn backwards: the RTS smoother on linear models, whole hypotheses on others."""

import numpy as np
import pytest
from switching import draw, wandering
from worlds import pendulum, unicycle_range_bearing

import sequential as sq
from sequential.errors import ModelError


def backwards(count, seed=0, trajectories=100):
    return sq.BackwardSimulation(sq.ParticleFilter(count, np.random.default_rng(seed)), trajectories)


def test_linear_models_as_the_kalman_smoother(rng):
    """Means and covariances converge to those of Rauch, Tung and Striebel."""
    model = wandering(0.5)
    log, _, _ = draw((model,), np.eye(1), 30, 1.0, rng)
    exact = sq.run(sq.RauchTungStriebel(sq.KalmanFilter(), leave_one_out=False), model, log)
    ahead = sq.run(sq.KalmanFilter(), model, log)
    runs = [sq.run(backwards(1000, seed, 200), model, log) for seed in range(8)]
    mean = np.mean([run.mean for run in runs], axis=0)
    assert np.abs((mean - exact.mean) / exact.sigmas()).max() < 0.2
    assert np.mean([run.cov for run in runs] / exact.cov) == pytest.approx(1.0, abs=0.05)
    assert np.mean(exact.cov / ahead.cov) < 0.9  # there was something to smooth


def test_what_happened_before_belongs_to_what_happened_after(rng):
    """Neighbouring states of a trajectory are correlated as the smoother's joint law says."""
    model = wandering(0.05)
    log, _, _ = draw((model,), np.eye(1), 12, 1.0, rng)
    problem = sq.prepare(model, log)
    paths = np.concatenate(
        [backwards(800, seed, 200).solve(problem).particles.states[:, :, 0].T for seed in range(8)]
    )
    smooth = sq.RauchTungStriebel(sq.KalmanFilter(keep=True)).solve(problem)
    forward = sq.KalmanFilter(keep=True).solve(problem)
    gain = forward.cov[:-1, 0, 0] / forward.predicted.cov[1:, 0, 0]
    lagged = gain * smooth.cov[1:, 0, 0]
    found = np.array([np.cov(paths[:, k], paths[:, k + 1])[0, 1] for k in range(11)])
    np.testing.assert_allclose(found, lagged, rtol=0.25)


@pytest.mark.parametrize("world", [pendulum(), unicycle_range_bearing()], ids=repr)
def test_better_than_the_filter(world, seeds):
    """Closer to the truth than what came in, with errors as large as they are said to be."""
    errors, nees = {"filter": [], "smoother": []}, []
    for seed in list(seeds)[:4]:
        drawn = world.draw(np.random.default_rng([17, seed]))
        smoother = backwards(600, seed, 60)
        runs = {"filter": sq.run(smoother.filter, world.model, drawn.log)}
        runs["smoother"] = sq.run(smoother, world.model, drawn.log)
        truth = drawn.truth[np.searchsorted(drawn.t, runs["filter"].t)]
        for name, run in runs.items():
            error = run.manifold.local(run.mean, truth)
            errors[name].append((error**2).mean())
        nees.append((error**2 / runs["smoother"].sigmas() ** 2).mean())
    assert np.mean(errors["smoother"]) < np.mean(errors["filter"])
    assert 0.3 < np.mean(nees) < 2.5


def test_singular_noise_and_other_filters_are_refused(rng):
    model = sq.StateSpace(
        sq.Vector(2), sq.Gaussian([0.0, 0.0], 1.0), sq.RandomWalk([1.0, 0.0]),
        {"z": sq.LinearSensor([[1.0, 1.0]], 1.0)},
    )  # fmt: skip
    log = sq.SensorLog({"z": sq.Stream([0.0, 1.0], [0.0, 1.0])})
    with pytest.raises(ModelError, match=r"singular on the way to 1\.000000 s"):
        sq.run(backwards(20), model, log)
    with pytest.raises(ModelError, match="smooths a ParticleFilter, got KalmanFilter"):
        sq.BackwardSimulation(sq.KalmanFilter())
    with pytest.raises(ModelError, match="two trajectories or more"):
        backwards(20, trajectories=1)
    run = sq.run(
        backwards(50, trajectories=7), wandering(0.5), draw((wandering(0.5),), np.eye(1), 5, 1.0, rng)[0]
    )
    assert run.report.estimator == "pf_backward"
    assert run.particles.states.shape == (5, 7, 1)
