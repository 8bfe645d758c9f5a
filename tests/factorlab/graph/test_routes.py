"""Native factors, batched linearisation and the iterated smoother solve one problem."""

import gtsam
import numpy as np
import pytest
from graph_worlds import LOSSES, PLANAR, inertial
from worlds import EVERY_WORLD, LINEAR_WORLDS

import sequential as sq
from factorlab.datasets import load
from factorlab.graph import BatchGraph
from factorlab.graph.batch import build
from factorlab.graph.batched import ChainGraph
from factorlab.graph.keys import STATIC
from factorlab.graph.marginals import chain_marginals
from factorlab.graph.native import native_graph
from sequential.errors import ModelError

SMOOTHER = sq.IteratedSmoother(tolerance=1e-8, max_iterations=300)
NATIVE = BatchGraph(route="native", max_iterations=200)
BATCHED = BatchGraph(route="batched", max_iterations=200, tolerance=1e-11)
every_loss = pytest.mark.parametrize("loss", LOSSES, ids=lambda loss: loss.kind if loss else "squares")


def assert_same(run, other, mean, cov):
    """Means to `mean` in every tangent direction, covariances to a share `cov` of the variances."""
    assert np.abs(run.manifold.local(other.mean, run.mean)).max() < mean
    scale = other.sigmas()
    assert np.abs((run.cov - other.cov) / (scale[:, :, None] * scale[:, None, :])).max() < cov


def cost(problem, run):
    return ChainGraph(problem).linearise(np.array(run.mean))


@every_loss
@pytest.mark.parametrize("make", PLANAR, ids=lambda make: make.__name__)
def test_planar_routes_agree(make, loss, rng):
    problem = make(loss).problem(rng)
    assert native_graph(problem) is not None
    native, batched, smoothed = (e.solve(problem) for e in (NATIVE, BATCHED, SMOOTHER))
    assert native.report.cost == pytest.approx(batched.report.cost, rel=1e-6)
    assert cost(problem, smoothed) == pytest.approx(batched.report.cost, rel=1e-6)
    # With a loss Gauss-Newton nears its end by a factor a step only, so that the cost ends it early.
    assert_same(native, batched, *((1e-6, 1e-5) if loss is None else (1e-4, 1e-3)))
    assert_same(batched, smoothed, 1e-6, 1e-5)


@every_loss
@pytest.mark.parametrize("arm", [(0.0, 0.0, 0.0), (0.5, -0.3, 0.8)], ids=["no arm", "arm"])
def test_inertial_routes_agree(arm, loss, rng):
    problem = inertial(arm, loss).problem(rng)
    native, batched, smoothed = (e.solve(problem) for e in (NATIVE, BATCHED, SMOOTHER))
    assert native.report.cost == pytest.approx(batched.report.cost, rel=1e-6)
    # What remains is the first-order bias correction of a preintegration.
    assert_same(native, batched, 1e-3, 1e-3)
    assert_same(batched, smoothed, 1e-6, 1e-5)


@every_loss
def test_a_correlated_prior_is_one_container(loss, rng):
    mixed = rng.standard_normal((15, 15))
    correlation = mixed @ mixed.T + 5.0 * np.eye(15)
    correlation /= np.sqrt(np.outer(np.diag(correlation), np.diag(correlation)))
    sigmas = 0.1 * np.sqrt(np.diag(inertial().model.prior.cov))
    problem = inertial(loss=loss, prior_cov=np.outer(sigmas, sigmas) * correlation).problem(rng)
    factors = native_graph(problem).prior_factors()
    assert [type(factor) for factor in factors] == [gtsam.LinearContainerFactor]
    # Rows about the prior's mean, met along SE(3)'s exponential: exact to first order in the correction.
    assert_same(NATIVE.solve(problem), BATCHED.solve(problem), 5e-3, 3e-2)


@pytest.mark.parametrize("make", [*PLANAR, inertial], ids=lambda make: make.__name__)
def test_auto_is_native_where_it_can_be(make, rng):
    problem = make().problem(rng)
    auto, native = BatchGraph().solve(problem), BatchGraph(route="native").solve(problem)
    np.testing.assert_array_equal(auto.mean, native.mean)


def test_kitti_routes_agree():
    kitti = load("kitti")[0]
    problem = sq.prepare(kitti.model, kitti.log)
    native, batched, smoothed = (e.solve(problem) for e in (NATIVE, BATCHED, SMOOTHER))
    assert np.abs(kitti.positions(native) - kitti.positions(batched)).max() < 5e-3
    assert_same(batched, smoothed, 1e-3, 1e-3)
    np.testing.assert_allclose(native.sigmas(), batched.sigmas(), rtol=1e-2)
    np.testing.assert_allclose(native.sigmas()[3:], batched.sigmas()[3:], rtol=1e-3)


@pytest.mark.parametrize("world", LINEAR_WORLDS, ids=repr)
def test_linear_graph_is_rauch_tung_striebel(world, rng):
    problem = world.problem(rng)
    graph, smoothed = BatchGraph(route="batched").solve(problem), sq.RauchTungStriebel().solve(problem)
    np.testing.assert_allclose(graph.mean, smoothed.mean, rtol=0, atol=1e-9)
    np.testing.assert_allclose(graph.cov, smoothed.cov, rtol=0, atol=1e-9)
    for name, seen in smoothed.innovations.items():
        np.testing.assert_allclose(graph.innovations[name].residual, seen.residual, atol=1e-8)
        assert graph.innovations[name].kind == "leave-one-out"


@pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)
def test_every_world_in_one_graph(world, rng):
    problem = world.problem(rng)
    assert_same(BATCHED.solve(problem), SMOOTHER.solve(problem), 1e-6, 1e-5)


@pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)
def test_marginals_in_one_pass_are_those_of_gtsam(world, rng):
    problem = world.problem(rng)
    run = BatchGraph(route="batched").solve(problem)
    chain = ChainGraph(problem)
    chain.linearise(np.array(run.mean))
    graph = chain.linear_graph()
    marginals = gtsam.Marginals(graph, gtsam.VectorValues.Zero(graph.optimize()))
    scale = run.sigmas()
    for k in range(0, len(run), 7):
        keys = [chain.keys[k], STATIC] if len(chain.static) else [chain.keys[k]]
        joint = marginals.jointMarginalCovariance(keys)
        order = np.argsort(np.concatenate([chain.moving, chain.static]))
        expected = np.block([[joint.at(a, b) for b in keys] for a in keys])[np.ix_(order, order)]
        assert np.abs((run.cov[k] - expected) / np.outer(scale[k], scale[k])).max() < 1e-6


@every_loss
def test_marginals_of_native_factors_with_a_bias(loss, rng):
    problem = PLANAR[1](loss).problem(rng)
    native = native_graph(problem)
    run = BatchGraph(route="native").solve(problem)
    graph, values = build(native, run.mean)
    marginals = gtsam.Marginals(graph, values)
    one_pass = chain_marginals(problem, run.mean)
    for k in range(0, len(run), 5):
        np.testing.assert_allclose(
            one_pass[k], native.covariance(marginals, k, run.mean[k]), rtol=0, atol=1e-8
        )


def test_covariances_are_left_out_where_nobody_asks(rng):
    problem = PLANAR[0]().problem(rng)
    for route in ("native", "batched"):
        run = BatchGraph(route=route, covariance=False).solve(problem)
        assert np.isnan(run.cov).all()
        assert not run.innovations


def test_a_gate_has_no_native_factor_and_still_a_graph(rng):
    world = PLANAR[2]()
    model, seen = world.model, world.model.sensors["seen"]
    gated = sq.RangeBearing(seen.landmarks, seen.noise_cov, gate=0.999)
    other = sq.StateSpace(model.manifold, model.prior, model.process, {"seen": gated}, "odometry", 0.0)
    problem = sq.prepare(other, world.draw(rng).log)
    assert native_graph(problem) is None
    assert BatchGraph().solve(problem).report.converged


def inertial_with_static_biases(rng, accel_walk, gyro_walk):
    world = inertial()
    model = world.model
    process = sq.Strapdown(sq.ImuNoise(2e-3, 2e-2, gyro_walk, accel_walk), model.process.gravity)
    static = sq.StateSpace(
        model.manifold, model.prior, process, model.sensors, "imu", 0.0, ("accel_bias", "gyro_bias")
    )
    return sq.prepare(static, world.draw(rng).log)


def test_static_biases_of_an_inertial_unit_are_one_variable(rng):
    problem = inertial_with_static_biases(rng, 0.0, 0.0)
    assert native_graph(problem) is None
    run = BATCHED.solve(problem)
    assert_same(run, SMOOTHER.solve(problem), 1e-6, 1e-5)
    assert np.ptp(run.part("gyro_bias"), axis=0).max() == 0.0


def test_a_static_part_may_not_walk(rng):
    with pytest.raises(ModelError, match="'accel_bias' is declared static, but the process gives it noise"):
        BatchGraph().solve(inertial_with_static_biases(rng, 1e-4, 0.0))
