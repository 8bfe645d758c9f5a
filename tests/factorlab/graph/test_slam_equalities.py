"""Independent ways to the same optimum: native and batched, incremental and batch, a long lag and batch."""

import numpy as np
import pytest
from graph_slam_worlds import displaced, loop, pose_graph, spread

from factorlab.graph.slam import BatchSlam, FixedLagSlam, IncrementalSlam
from sequential.manifold import SE2, SE3

WORLDS = {
    "loop": lambda rng: loop(rng)[0],
    "loop of displacements": lambda rng: displaced(rng)[0],
    "poses of the plane": lambda rng: pose_graph(rng, SE2())[0],
    "poses of space": lambda rng: pose_graph(rng, SE3())[0],
}
NATIVE = ["loop", "poses of the plane", "poses of space"]
every_world = pytest.mark.parametrize("world", WORLDS.values(), ids=WORLDS)


def assert_same(problem, one, other, atol):
    for kind, manifold in problem.kinds.items():
        apart = manifold.local(one.values.rows[kind], other.values.rows[kind])
        np.testing.assert_allclose(apart, 0.0, atol=atol)


@pytest.mark.parametrize("world", [WORLDS[name] for name in NATIVE], ids=NATIVE)
@pytest.mark.parametrize("method", ["gauss_newton", "levenberg_marquardt", "dogleg"])
def test_native_and_batched_meet(world, method, rng):
    problem = world(rng)
    native = BatchSlam(route="native", method=method).solve(problem)
    batched = BatchSlam(route="batched", method=method).solve(problem)
    assert native.report.details["native"] == 1.0
    assert batched.report.details["native"] == 0.0
    assert native.report.cost == pytest.approx(batched.report.cost, rel=1e-7)
    assert_same(problem, native, batched, 1e-4)
    for kind in problem.kinds:
        np.testing.assert_allclose(native.covs[kind], batched.covs[kind], rtol=1e-2, atol=1e-6)


@every_world
def test_incremental_ends_where_the_batch_does(world, rng):
    problem = world(rng)
    batch, online = BatchSlam().solve(problem), IncrementalSlam().solve(problem)
    assert online.report.details["chi2"] == pytest.approx(batch.report.details["chi2"], rel=1e-8)
    assert_same(problem, batch, online, 1e-5)


@every_world
def test_a_long_lag_is_the_batch(world, rng):
    problem = world(rng)
    batch = BatchSlam().solve(problem)
    window = FixedLagSlam(1000, threshold=1e-6).solve(problem)
    assert window.report.rejected == 0
    assert_same(problem, batch, window, 1e-4)


def test_where_it_begins_does_not_matter(rng):
    problem = loop(rng)[0]
    usual = BatchSlam().solve(problem)
    moved = BatchSlam(initial=spread(problem, usual.values, rng, 0.05)).solve(problem)
    assert_same(problem, usual, moved, 1e-5)


def test_displacements_go_the_batched_way(rng):
    problem, pose, _ = displaced(rng)
    run = BatchSlam().solve(problem)
    assert run.report.details["native"] == 0.0
    assert np.linalg.norm(run.values.rows["x"][:, :2] - pose[:, :2], axis=1).max() < 0.5
