"""The iterated smoother is the nonlinear batch, static parts included."""

import dense
import numpy as np
import pytest
from worlds import EVERY_WORLD

import sequential as sq

every_world = pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)


def assert_close(run, mean, cov, tolerance):
    """Means to a share of a standard deviation, covariances to a share of the variances."""
    scale = np.sqrt(np.diagonal(cov, axis1=1, axis2=2))
    assert np.abs(run.manifold.local(mean, run.mean) / scale).max() < tolerance
    assert np.abs((run.cov - cov) / (scale[:, :, None] * scale[:, None, :])).max() < tolerance


@every_world
def test_the_iterated_smoother_is_dense_gauss_newton(world, rng):
    problem = world.problem(rng)
    run = sq.IteratedSmoother(tolerance=1e-9, max_iterations=100).solve(problem)
    start = sq.RauchTungStriebel().solve(problem).mean
    mean, cov = dense.gauss_newton(problem, np.array(start))
    assert_close(run, mean, cov, 1e-6)


@every_world
def test_the_start_does_not_matter(world, rng):
    problem = world.problem(rng)
    smoother = sq.IteratedSmoother(tolerance=1e-9, max_iterations=100)
    run = smoother.solve(problem)
    nudged = problem.model.manifold.retract(run.mean, 0.03 * rng.standard_normal(run.cov.shape[:2]))
    assert_close(smoother.refine(problem, nudged), run.mean, run.cov, 1e-6)


@every_world
def test_rts_is_close_to_the_batch(world, rng):
    problem = world.problem(rng)
    batch = sq.IteratedSmoother().solve(problem)
    for filter_ in (sq.ExtendedKalmanFilter(), sq.UnscentedKalmanFilter(), sq.IteratedExtendedKalmanFilter()):
        run = sq.RauchTungStriebel(filter_).solve(problem)
        scale = np.sqrt(np.diagonal(batch.cov, axis1=1, axis2=2))
        off = np.abs(run.manifold.local(batch.mean, run.mean) / scale)
        assert np.median(off) < 0.25
        assert run.report.estimator == f"{filter_.name}_rts"


def test_a_static_part_is_one_number(rng):
    world = next(w for w in EVERY_WORLD if w.model.static)
    run = sq.IteratedSmoother(tolerance=1e-9).solve(world.problem(rng))
    bias = run.part("bias")
    np.testing.assert_allclose(bias, np.broadcast_to(bias[-1], bias.shape), atol=1e-9)
    variance = run.cov[:, -1, -1]
    np.testing.assert_allclose(variance, variance[-1], rtol=1e-7)
