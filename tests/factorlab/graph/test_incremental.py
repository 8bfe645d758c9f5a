"""Online graphs: iSAM2 ends at the batch, a long fixed lag is iSAM2, and a nearly linear case is the EKF."""

import numpy as np
import pytest
from graph_worlds import PLANAR, inertial
from worlds import pendulum

import sequential as sq
from factorlab.graph import BatchGraph, FixedLagGraph, IncrementalGraph
from sequential.errors import ModelError

WORLDS = [*PLANAR, inertial]
every_world = pytest.mark.parametrize("make", WORLDS, ids=lambda make: make.__name__)


def in_sigmas(run, other, rows=slice(None)):
    """Largest difference of two estimates as a share of a standard deviation."""
    return np.abs((run.manifold.local(other.mean, run.mean) / other.sigmas())[rows]).max()


@every_world
def test_isam2_ends_at_the_batch(make, rng):
    problem = make().problem(rng)
    batch, final = BatchGraph().solve(problem), IncrementalGraph(final=True, threshold=1e-4).solve(problem)
    assert final.report.estimator == "isam2_final"
    assert in_sigmas(final, batch) < 3e-3
    np.testing.assert_allclose(final.sigmas(), batch.sigmas(), rtol=1e-3)
    assert {seen.kind for seen in final.innovations.values()} == {"leave-one-out"}


@every_world
def test_the_usual_threshold_costs_little(make, rng):
    problem = make().problem(rng)
    assert in_sigmas(IncrementalGraph(final=True).solve(problem), BatchGraph().solve(problem)) < 0.05


@every_world
def test_a_lag_longer_than_the_log_is_isam2(make, rng):
    problem = make().problem(rng)
    lagged, online = FixedLagGraph(lag=1e4).solve(problem), IncrementalGraph().solve(problem)
    assert in_sigmas(lagged, online) < 1e-6
    np.testing.assert_allclose(lagged.cov[-1], online.cov[-1], rtol=0, atol=1e-6)
    batch = BatchGraph().solve(problem)
    assert in_sigmas(lagged, batch, slice(-1, None)) < 0.05
    np.testing.assert_allclose(lagged.sigmas()[-1], batch.sigmas()[-1], rtol=0.02)


@every_world
@pytest.mark.parametrize("graph", [IncrementalGraph(), FixedLagGraph(lag=2.0)], ids=lambda graph: graph.name)
def test_nearly_linear_innovations_are_those_of_the_ekf(make, graph, rng):
    problem = make().problem(rng)
    kalman, online = sq.ExtendedKalmanFilter().solve(problem), graph.solve(problem)
    assert np.median(np.abs(online.manifold.local(kalman.mean, online.mean) / kalman.sigmas())) < 0.1
    for name, seen in kalman.innovations.items():
        assert online.innovations[name].kind == "filter"
        assert online.innovations[name].nis().mean() == pytest.approx(seen.nis().mean(), rel=0.1)
    np.testing.assert_allclose(online.sigmas(), kalman.sigmas(), rtol=0.15)


def test_a_fixed_lag_knows_pose_and_bias_together(rng):
    problem = PLANAR[1]().problem(rng)
    kalman, lagged = sq.ExtendedKalmanFilter().solve(problem), FixedLagGraph(lag=2.0).solve(problem)
    scale = kalman.sigmas()
    off = (lagged.cov - kalman.cov) / (scale[:, :, None] * scale[:, None, :])
    assert np.abs(kalman.cov[-1, :3, 3]).max() > 0
    assert np.abs(off).max() < 0.2


def test_what_an_online_estimate_says_of_the_past_does_not_know_the_future(rng):
    world = inertial()
    log = world.draw(rng).log
    whole = sq.run(IncrementalGraph(), world.model, log)
    early = sq.run(IncrementalGraph(), world.model, log.between(stop=2_000_000_000))
    np.testing.assert_allclose(whole.mean[: len(early)], early.mean, atol=1e-9)


def test_a_model_without_native_factors_gets_a_sentence(rng):
    with pytest.raises(ModelError, match=r"iSAM2 needs native GTSAM factors.*BatchGraph\(\)"):
        IncrementalGraph().solve(pendulum().problem(rng))
