"""A body with a stereo camera: native factors and compiled rows say the same, and so do their solutions."""

import gtsam
import numpy as np
import pytest
from graph_worlds import LOSSES
from stereo_night_worlds import BASELINE, DENSITY, INTRINSICS, MOUNT, POINTS, PRIOR, night

import sequential as sq
from factorlab.graph import BatchGraph, FixedLagGraph
from factorlab.graph.batch import build
from factorlab.graph.batched import ChainGraph
from factorlab.graph.native import native_graph
from sequential.driven_pose import DrivenPose
from sequential.errors import ModelError
from sequential.timeline import prepare

every_loss = pytest.mark.parametrize("loss", LOSSES, ids=lambda loss: loss.kind if loss else "squares")


def information(factors, values, keys):
    """AᵀA of native factors over some variables, the landmarks standing still."""
    graph, ordering = gtsam.GaussianFactorGraph(), gtsam.Ordering()
    for factor in factors:
        graph.push_back(factor.linearize(values))
    for key in (*keys, *(key for key in graph.keyVector() if key not in keys)):
        ordering.push_back(key)
    size = 6 * len(keys)
    square, right = graph.hessian(ordering)
    return square[:size, :size], np.ravel(right)[:size]


@every_loss
def test_native_factors_are_our_rows(loss, rng):
    one = night(rng, count=30, loss=loss)
    problem = prepare(one.model, one.log)
    native, chain = native_graph(problem), ChainGraph(problem)
    for _ in range(4):  # times 29 nodes: over a hundred random points
        places = one.model.manifold.retract(one.truth, 0.05 * rng.standard_normal((len(one.truth), 6)))
        cost = chain.linearise(places)
        graph, values = build(native, places)
        assert graph.error(values) == pytest.approx(cost, rel=1e-9)
        for k in range(1, len(places)):
            rows = slice(*chain.rows.first[k : k + 2])
            keys = native.keys(k - 1) + native.keys(k)
            theirs = information(native.move(k, places[k - 1])[0] + native.reading_factors(k), values, keys)
            a = np.hstack([chain.rows.before[rows], chain.rows.here[rows]])
            ours, right = a.T @ a, a.T @ chain.rows.right[rows]
            scale = np.sqrt(np.diag(ours))
            assert np.abs((theirs[0] - ours) / np.outer(scale, scale)).max() < 1e-8
            np.testing.assert_allclose(theirs[1] / scale, right / scale, rtol=0, atol=1e-6)


@every_loss
def test_routes_meet(loss, rng):
    one = night(rng, loss=loss)
    native, batched = (sq.run(BatchGraph(route), one.model, one.log) for route in ("native", "batched"))
    assert np.abs(one.model.manifold.local(native.mean, batched.mean)).max() < 1e-5
    np.testing.assert_allclose(native.cov, batched.cov, rtol=0, atol=1e-8)


def test_a_lag_longer_than_the_log_ends_where_the_batch_does(rng):
    one = night(rng, count=25)
    batch = sq.run(BatchGraph(), one.model, one.log)
    window = sq.run(FixedLagGraph(lag=100.0), one.model, one.log)
    assert "chain solver" in window.report.message
    assert np.abs(one.model.manifold.local(batch.mean[-1], window.mean[-1])).max() < 1e-4


def test_positions_beside_the_camera(rng):
    """A second sensor, with and without an arm, keeps the graph native."""
    one = night(rng, count=20)
    t = one.t[2::3]
    for arm in ((0.0, 0.0, 0.0), (0.3, 0.1, -0.2)):
        sensors = {
            "stereo": sq.StereoPixels(POINTS, 1.0, INTRINSICS, BASELINE, MOUNT, shared_row=True),
            "tag": sq.Position(0.01, lever_arm=arm),
        }
        model = sq.StateSpace(sq.SE3(), PRIOR, DrivenPose(DENSITY), sensors, "twist", 0.0)
        log = one.log.replaced(tag=sq.Stream(t, one.truth[2::3, 4:]))
        native, batched = (sq.run(BatchGraph(route), model, log) for route in ("native", "batched"))
        assert np.abs(sq.SE3().local(native.mean, batched.mean)).max() < 1e-6


def test_a_step_without_noise_is_named(rng):
    one = night(rng, density=np.zeros(6), count=5)
    with pytest.raises(ModelError, match="singular"):
        sq.run(BatchGraph("native"), one.model, one.log)
