"""The ways of pushing a covariance agree through a whole filter: fused, dense, differenced."""

import numpy as np
import pytest
from worlds import EVERY_WORLD, without_fusion, without_jacobians

import sequential as sq

FUSED = [world for world in EVERY_WORLD if world.model.process_functions.advance]
DECLARED = [
    world
    for world in EVERY_WORLD
    if world.model.process_functions.jacobian
    or any(f.jacobian for f in world.model.sensor_functions.values())
]
every_estimator = pytest.mark.parametrize(
    "estimator",
    [
        sq.ExtendedKalmanFilter(keep=True),
        sq.ExtendedKalmanFilter(),
        sq.IteratedExtendedKalmanFilter(),
        sq.RauchTungStriebel(),
        sq.IteratedSmoother(tolerance=1e-8),
    ],
    ids=lambda e: e.name,
)


def assert_same(run, other, tolerance):
    scale = np.sqrt(np.diagonal(run.cov, axis1=1, axis2=2))
    assert np.abs(run.manifold.local(run.mean, other.mean) / scale).max() < tolerance
    assert np.abs((run.cov - other.cov) / (scale[:, :, None] * scale[:, None, :])).max() < tolerance


@pytest.mark.parametrize("world", FUSED, ids=repr)
@every_estimator
def test_fused_push_equals_the_dense_jacobian(world, estimator, rng):
    log = world.draw(rng).log
    run, dense = sq.run(estimator, world.model, log), sq.run(estimator, without_fusion(world.model), log)
    assert_same(run, dense, 1e-8)
    if run.predicted is not None:
        np.testing.assert_allclose(run.predicted.transition, dense.predicted.transition, rtol=0, atol=1e-10)


@pytest.mark.parametrize("world", DECLARED, ids=repr)
@every_estimator
def test_differenced_jacobians_agree_with_declared_ones(world, estimator, rng):
    log = world.draw(rng).log
    run = sq.run(estimator, world.model, log)
    assert_same(run, sq.run(estimator, without_jacobians(world.model), log), 1e-5)


@pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)
def test_keeping_predictions_changes_nothing(world, rng):
    log = world.draw(rng).log
    for estimator in (sq.ExtendedKalmanFilter, sq.UnscentedKalmanFilter):
        kept, run = (sq.run(estimator(keep=keep), world.model, log) for keep in (True, False))
        assert_same(run, kept, 1e-9)
        assert kept.log_likelihood == pytest.approx(run.log_likelihood, abs=1e-6)
