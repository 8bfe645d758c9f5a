"""One update seen three ways: filter, Gauss-Newton step, maximum a posteriori."""

import numpy as np
import pytest
from dense import look
from scipy.optimize import least_squares
from worlds import EVERY_WORLD

import sequential as sq

every_world = pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)


def single_updates(problem, count=4):
    """Nodes that take exactly one reading, early ones first (there the update is largest)."""
    counts = np.diff(problem.schedule.reading_ptr)
    return [(k, problem.schedule.reading_ptr[k]) for k in np.flatnonzero(counts == 1)[:count]]


@every_world
def test_an_ekf_update_is_one_gauss_newton_step(world, rng):
    problem = world.problem(rng)
    manifold, d = problem.model.manifold, problem.model.manifold.dim
    run = sq.ExtendedKalmanFilter(keep=True).solve(problem)
    for node, reading in single_updates(problem):
        before, cov = run.predicted.mean[node], run.predicted.cov[node]
        residual, jacobian, noise = look(problem, reading, before)
        root, white = np.linalg.cholesky(cov), np.linalg.inv(np.linalg.cholesky(noise))
        # unknowns ξ = L⁻¹ δ: the prior is the identity, whatever the units
        rows = np.concatenate([np.eye(d), white @ jacobian @ root])
        solved, *_ = np.linalg.lstsq(rows, np.concatenate([np.zeros(d), white @ residual]), rcond=None)
        expected = manifold.retract(before, root @ solved)
        scale = np.sqrt(np.diag(cov))
        declared = all(f.jacobian for f in problem.model.sensor_functions.values())
        tolerance = 1e-12 if declared else 1e-9  # central differences leave rounding behind
        assert np.abs(manifold.local(expected, run.mean[node]) / scale).max() < tolerance
        after = root @ np.linalg.inv(rows.T @ rows) @ root.T
        assert np.abs((run.cov[node] - after) / np.outer(scale, scale)).max() < tolerance


@every_world
def test_an_iterated_update_is_the_maximum_a_posteriori(world, rng):
    problem = world.problem(rng)
    manifold, d = problem.model.manifold, problem.model.manifold.dim
    run = sq.IteratedExtendedKalmanFilter(max_iterations=50, keep=True).solve(problem)
    for node, reading in single_updates(problem):
        before, cov = run.predicted.mean[node], run.predicted.cov[node]
        root = np.linalg.cholesky(cov)

        def cost(xi, before=before, root=root, reading=reading):
            residual, _, noise = look(problem, reading, manifold.retract(before, root @ xi))
            return np.concatenate([xi, np.linalg.solve(np.linalg.cholesky(noise), residual)])

        best = least_squares(cost, np.zeros(d), xtol=1e-15, ftol=1e-15, gtol=1e-12, jac="3-point").x
        expected = manifold.retract(before, root @ best)
        step = manifold.local(expected, run.mean[node]) / np.sqrt(np.diag(run.cov[node]))
        assert np.abs(step).max() < 1e-6


@every_world
def test_iterating_once_is_not_iterating(world, rng):
    problem = world.problem(rng)
    ekf = sq.ExtendedKalmanFilter().solve(problem)
    iterated = sq.IteratedExtendedKalmanFilter(max_iterations=50).solve(problem)
    if world.linear:
        np.testing.assert_allclose(iterated.mean, ekf.mean, atol=1e-9)
    else:
        assert np.abs(iterated.mean - ekf.mean).max() > 1e-9
