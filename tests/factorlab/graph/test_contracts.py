"""A native factor and our compiled rows say the same: error, Jacobian, information, in one chart."""

from dataclasses import replace
from pathlib import Path

import dense
import gtsam
import numpy as np
import pytest
from graph_rows import anywhere, assert_same_system, native_system, our_system
from graph_worlds import LOSSES, PLANAR, inertial
from worlds import times

import factorlab.graph
from factorlab.graph.batch import build
from factorlab.graph.batched import ChainGraph
from factorlab.graph.factors.inertial import to_world
from factorlab.graph.keys import S
from factorlab.graph.native import native_graph

every_loss = pytest.mark.parametrize("loss", LOSSES, ids=lambda loss: loss.kind if loss else "squares")


@every_loss
@pytest.mark.parametrize("make", PLANAR, ids=lambda make: make.__name__)
def test_planar_factors_are_our_rows(make, loss, rng):
    problem = make(loss).problem(rng)
    native, chain, manifold = native_graph(problem), ChainGraph(problem), problem.model.manifold
    for _ in range(3):  # times 41 nodes: over a hundred random points
        trajectory = anywhere(problem, rng, 0.4)
        cost = chain.linearise(trajectory)
        graph, values = build(native, trajectory)
        assert graph.error(values) == pytest.approx(cost, rel=1e-9)
        for k in range(1, len(trajectory)):
            first, last = chain.rows.first[k : k + 2]
            middle = first + len(chain.moving)
            before, here, fixed = chain.rows.before, chain.rows.here, chain.rows.fixed
            move, arrived = native.move(k, trajectory[k - 1])
            ours = our_system(chain, slice(first, middle), before, here)
            turned = manifold.local(arrived, trajectory[k])[2]
            if abs(turned) > 0.02:  # below, GTSAM's derivative of Pose2's logarithm loses digits
                theirs = native_system(move, values, native.keys(k - 1) + native.keys(k))
                assert_same_system(theirs, ours)
            keys, parts = native.keys(k), [here]
            if problem.model.static:
                keys, parts = [*keys, S(0)], [here, fixed]
            ours = our_system(chain, slice(middle, last), *parts)
            assert_same_system(native_system(native.reading_factors(k), values, keys), ours)


@every_loss
@pytest.mark.parametrize("arm", [(0.0, 0.0, 0.0), (0.5, -0.3, 0.8)], ids=["GPSFactor", "GPSFactorArm"])
def test_gps_factors_are_our_rows(arm, loss, rng):
    problem = inertial(arm, loss).problem(rng)
    native, chain = native_graph(problem), ChainGraph(problem)
    for _ in range(6):  # times 20 nodes
        trajectory = anywhere(problem, rng, 0.3)
        chain.linearise(trajectory)
        _, values = build(native, trajectory)
        for k in range(1, len(trajectory)):
            rows = slice(chain.rows.first[k] + 15, chain.rows.first[k + 1])
            ours = our_system(chain, rows, chain.rows.here[:, :6])
            assert_same_system(native_system(native.reading_factors(k), values, native.keys(k)[:1]), ours)


def test_the_prior_is_ours(rng):
    problem = inertial().problem(rng)
    native, chain = native_graph(problem), ChainGraph(problem)
    x = anywhere(problem, rng, 0.05)
    chain.linearise(x)
    _, values = build(native, x)
    information, right = native_system(native.prior_factors(), values, native.keys(0))
    turn = to_world(x[0])
    theirs = turn.T @ information @ turn, turn.T @ np.ravel(right)
    assert_same_system(theirs, our_system(chain, slice(0, 15), chain.rows.here))


def second_of_samples(finer, rng):
    """A problem whose nodes are a second apart, of 50 samples times `finer`."""
    world = inertial()
    inputs = np.repeat(world.inputs[:101], finer, axis=0)
    t = times(101 * finer, 0.02 / finer)
    return replace(world, t=t, inputs=inputs, readings={"gps": 50 * finer}).problem(rng)


def test_preintegration_is_stepping(rng):
    """CombinedImuFactor adds up tangents where we multiply rotations: apart by the first order in dt."""
    apart = []
    for finer in (1, 2, 4):
        problem = second_of_samples(finer, rng)
        x, manifold = problem.model.prior.mean, problem.model.manifold
        _, arrived = native_graph(problem).move(2, x)
        apart.append(np.abs(manifold.local(dense.step(problem, 2, x)[0], arrived)).max())
    assert apart[0] < 2e-5
    np.testing.assert_allclose(apart[1:] / apart[0], [1 / 2, 1 / 4], rtol=0.1)


def test_preintegration_has_our_covariance(rng):
    problem = second_of_samples(1, rng)
    native, x = native_graph(problem), problem.model.prior.mean
    ahead, phi, noise = dense.step(problem, 2, x)
    values = gtsam.Values()
    native.insert(values, 1, x)
    native.insert(values, 2, ahead)
    a, _ = native.move(2, x)[0][0].linearize(values).jacobian()
    # Columns stand in the order of the factor: poses and velocities, then both biases.
    here, before = np.hstack([a[:, 9:18], a[:, 24:30]]), np.hstack([a[:, :9], a[:, 18:24]])
    here, before = here @ to_world(ahead), before @ to_world(x)
    cov = np.linalg.inv(here.T @ here)
    scale = np.sqrt(np.outer(np.diag(noise), np.diag(noise)))
    np.testing.assert_allclose(cov / scale, noise / scale, rtol=0, atol=0.01)
    np.testing.assert_allclose(-np.linalg.solve(here, before), phi, rtol=0, atol=1e-4)


def test_no_python_factor_enters_an_optimiser():
    room = Path(factorlab.graph.__file__).parent
    sources = sorted(room.rglob("*.py"))
    assert len(sources) > 5
    assert not [path.name for path in sources if "CustomFactor(" in path.read_text(encoding="utf-8")]
