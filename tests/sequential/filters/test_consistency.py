"""Monte Carlo: what filters and smoothers say about their own errors is so, in every world."""

import numpy as np
import pytest
from worlds import EVERY_WORLD, nees

import sequential as sq

FILTERS = [sq.ExtendedKalmanFilter(), sq.IteratedExtendedKalmanFilter(), sq.UnscentedKalmanFilter()]
SMOOTHERS = [sq.RauchTungStriebel(), sq.RauchTungStriebel(sq.UnscentedKalmanFilter()), sq.IteratedSmoother()]

every_world = pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)
every_estimator = pytest.mark.parametrize("estimator", FILTERS + SMOOTHERS, ids=lambda e: e.name)


@every_world
@every_estimator
@pytest.mark.slow
def test_errors_and_innovations_are_as_large_as_they_say(world, estimator, seeds):
    """ANEES/d and NIS/m are one; errors of one draw are correlated, so the band is that of the draws."""
    errors, surprises = [], []
    for seed in seeds:
        drawn = world.draw(np.random.default_rng([7, seed]))
        run = sq.run(estimator, world.model, drawn.log)
        truth = drawn.truth[np.searchsorted(drawn.t, run.t)]
        # the first node's covariance stays in the tangent of the prediction, far from the estimate
        errors.append(nees(run, truth, np.arange(1, len(run))).mean() / run.cov.shape[1])
        surprises.append(
            np.mean([seen.nis().mean() / seen.cov.shape[-1] for seen in run.innovations.values()])
        )
    for values in (errors, surprises):
        assert abs(np.mean(values) - 1.0) < 0.1 + 4.0 * np.std(values) / np.sqrt(len(values))


@every_world
def test_the_final_error_is_distributed_as_claimed(world, seeds):
    """NEES at the last node is χ² with d degrees of freedom, one independent draw for each seed."""
    from scipy.stats import chi2

    d, total = world.model.manifold.dim, 0.0
    for seed in seeds:
        drawn = world.draw(np.random.default_rng([11, seed]))
        run = sq.run(sq.ExtendedKalmanFilter(), world.model, drawn.log)
        total += nees(run, drawn.truth[np.searchsorted(drawn.t, run.t)], np.array([-1]))[0]
    low, high = chi2.ppf([1e-4, 1 - 1e-4], d * len(seeds))
    assert 0.85 * low < total < 1.15 * high


@every_world
def test_smoothers_know_more_than_filters(world, rng):
    log = world.draw(rng).log
    for filter_ in FILTERS:
        ahead = sq.run(filter_, world.model, log)
        run = sq.run(sq.RauchTungStriebel(filter_), world.model, log)
        assert np.median(run.sigmas() / ahead.sigmas()) < 1.0
        np.testing.assert_array_equal(run.mean[-1], ahead.mean[-1])
        np.testing.assert_array_equal(run.cov[-1], ahead.cov[-1])


@every_world
@pytest.mark.parametrize("estimator", FILTERS, ids=lambda e: e.name)
def test_covariances_are_symmetric_and_definite(world, estimator, rng):
    run = sq.run(estimator, world.model, world.draw(rng).log)
    np.testing.assert_array_equal(run.cov, np.swapaxes(run.cov, 1, 2))
    sigmas = run.sigmas()
    scaled = run.cov / (sigmas[:, :, None] * sigmas[:, None, :])
    assert np.linalg.eigvalsh(scaled).min() > 0.0
