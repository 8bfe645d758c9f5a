"""Between our flat states and GTSAM's variables: values, keys, charts of covariances."""

import gtsam
import numpy as np
import pytest
from graph_worlds import PLANAR, inertial

from factorlab.graph import BatchGraph, keys
from factorlab.graph.batch import build
from factorlab.graph.native import native_graph


@pytest.mark.parametrize("make", [*PLANAR, inertial], ids=lambda make: make.__name__)
def test_reading_what_was_inserted(make, rng):
    problem = make().problem(rng)
    native = native_graph(problem)
    manifold, mean = problem.model.manifold, problem.model.prior.mean
    for k in range(20):
        values = gtsam.Values()
        x = manifold.retract(mean, rng.standard_normal(manifold.dim))
        native.insert_shared(values, x)
        native.insert(values, k, x)
        np.testing.assert_allclose(manifold.local(x, native.read(values, k)), 0.0, atol=1e-12)
        np.testing.assert_allclose(native.read(values, k), x, atol=1e-12)


@pytest.mark.parametrize("make", [*PLANAR, inertial], ids=lambda make: make.__name__)
def test_covariances_are_in_our_chart(make, rng):
    """Velocities step along the body's axes here, along the world's there; biases stand beside poses."""
    problem = make().problem(rng)
    native = native_graph(problem)
    batched = BatchGraph(route="batched").solve(problem)
    graph, values = build(native, batched.mean)
    marginals = gtsam.Marginals(graph, values)
    for k in range(0, len(batched), 4):
        scale = np.sqrt(np.outer(np.diag(batched.cov[k]), np.diag(batched.cov[k])))
        off = native.covariance(marginals, k, batched.mean[k]) - batched.cov[k]
        assert np.abs(off / scale).max() < 1e-3


def test_the_velocity_really_turns(rng):
    """The test above would not see a chart that forgot to turn an isotropic velocity: this one is not."""
    problem = inertial().problem(rng)
    cov = BatchGraph(route="native").solve(problem).cov[-1, 6:9, 6:9]
    assert np.ptp(np.linalg.eigvalsh(cov)) > 0.05 * np.trace(cov)


def test_names_of_variables():
    assert [keys.name_of(key) for key in (keys.X(3), keys.V(0), keys.B(12), keys.L(2), keys.STATIC)] == [
        "x3", "v0", "b12", "l2", "s0"
    ]  # fmt: skip
