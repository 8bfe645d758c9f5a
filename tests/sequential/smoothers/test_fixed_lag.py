"""The online smoother between its two ends: a filter at lag zero, the batch at lag infinity."""

from __future__ import annotations

import numpy as np
import pytest
from worlds import EVERY_WORLD

import sequential as sq
from factorlab.datasets import load

LINEAR = [world for world in EVERY_WORLD if world.linear]


def distance(run, other, node):
    """Largest difference of a node's means, in standard deviations."""
    gap = run.manifold.local(other.mean[node], run.mean[node])
    return np.abs(gap / np.sqrt(np.diag(other.cov[node]))).max()


@pytest.mark.parametrize("world", EVERY_WORLD, ids=lambda w: w.name)
def test_an_endless_lag_ends_at_the_batch(world, rng):
    problem = world.problem(rng)
    online = sq.FixedLagSmoother(lag=float("inf"), tolerance=1e-6, max_iterations=50).solve(problem)
    batch = sq.IteratedSmoother(tolerance=1e-6).solve(problem)
    assert distance(online, batch, -1) < 1e-4
    np.testing.assert_allclose(online.cov[-1], batch.cov[-1], rtol=1e-3, atol=1e-9 * batch.cov[-1].max())


@pytest.mark.parametrize("lag", [0.0, 1.0, 5.0])
@pytest.mark.parametrize("world", LINEAR, ids=lambda w: w.name)
def test_any_lag_is_the_filter_on_a_linear_model(world, lag, rng):
    problem = world.problem(rng)
    online = sq.FixedLagSmoother(lag=lag).solve(problem)
    filtered = sq.KalmanFilter().solve(problem)
    np.testing.assert_allclose(online.mean, filtered.mean, atol=1e-9 * np.abs(filtered.mean).max())
    np.testing.assert_allclose(online.cov, filtered.cov, atol=1e-9 * np.abs(filtered.cov).max())
    for name, innovations in online.innovations.items():
        first = np.searchsorted(problem.t, innovations.t) == 0
        assert np.isfinite(innovations.nis()).all()
        assert len(innovations.t) == len(filtered.innovations[name].t)
        assert not first.all()


@pytest.mark.parametrize("world", LINEAR, ids=lambda w: w.name)
def test_what_leaves_an_endless_window_is_the_batch(world, rng):
    problem = world.problem(rng)
    late = sq.FixedLagSmoother(lag=float("inf"), delayed=True).solve(problem)
    batch = sq.RauchTungStriebel(sq.KalmanFilter(), leave_one_out=False).solve(problem)
    np.testing.assert_allclose(late.mean, batch.mean, atol=1e-8 * np.abs(batch.mean).max())
    np.testing.assert_allclose(late.cov, batch.cov, atol=1e-8 * np.abs(batch.cov).max())


@pytest.mark.parametrize("world", LINEAR, ids=lambda w: w.name)
def test_what_leaves_a_window_is_the_smoother_of_so_much_more_log(world, rng):
    """Node by node: the estimate that leaves is that of all readings until the moment it left."""
    problem, lag = world.problem(rng), 1.0
    online, late = sq.FixedLagSmoother(lag).solve_both(problem)
    filtered = sq.KalmanFilter().solve(problem)
    np.testing.assert_allclose(online.mean, filtered.mean, atol=1e-9 * np.abs(filtered.mean).max())
    for node in (0, len(problem.t) // 3, len(problem.t) // 2):
        until = problem.t[np.flatnonzero(problem.t - problem.t[node] <= lag * 1e9)[-1]]
        known = problem.only(problem.reading_t <= until)
        smoothed = sq.RauchTungStriebel(sq.KalmanFilter(), leave_one_out=False).solve(known)
        assert distance(late, smoothed, node) < 1e-6
        np.testing.assert_allclose(late.cov[node], smoothed.cov[node], atol=1e-8 * smoothed.cov[node].max())


@pytest.mark.parametrize("world", EVERY_WORLD, ids=lambda w: w.name)
def test_without_lag_both_estimates_are_one(world, rng):
    online, late = sq.FixedLagSmoother(lag=0.0).solve_both(world.problem(rng))
    np.testing.assert_array_equal(online.mean, late.mean)
    np.testing.assert_array_equal(online.cov, late.cov)
    assert late.report.details["widest_window"] <= 2
    assert late.report.details["slowest_update_s"] > 0


def test_five_seconds_later_a_real_drive_is_known_four_times_better():
    (kitti,) = load("kitti")
    assert kitti.held_out is not None
    problem = sq.prepare(kitti.model, kitti.log, at=kitti.held_out.t)
    rmse = []
    for run in sq.FixedLagSmoother(lag=5.0).solve_both(problem):
        error = kitti.positions(run)[run.index(kitti.held_out.t)] - kitti.held_out.values
        rmse.append(np.sqrt((error**2).sum(axis=1).mean()))
    assert rmse == pytest.approx([3.85, 0.854], abs=0.03)


def test_a_real_drive_with_five_seconds_of_lag():
    (kitti,) = load("kitti")
    assert kitti.held_out is not None
    run = sq.run(sq.FixedLagSmoother(lag=5.5), kitti.model, kitti.log, at=kitti.held_out.t)
    error = kitti.positions(run)[run.index(kitti.held_out.t)] - kitti.held_out.values
    assert np.sqrt((error**2).sum(axis=1).mean()) == pytest.approx(3.85, abs=0.05)
    assert run.innovations["gps"].nis().mean() == pytest.approx(87.5, abs=2.0)
