"""The normal equations of native factors beside those of our compiled rows, anywhere."""

import gtsam
import numpy as np

import sequential as sq


def native_system(factors, values, keys):
    """Sums AᵀA and Aᵀb of native factors, in the order of `keys`; other variables stand still."""
    graph, ordering = gtsam.GaussianFactorGraph(), gtsam.Ordering()
    for factor in factors:
        graph.push_back(factor.linearize(values))
    names = [*keys, *(key for key in graph.keyVector() if key not in keys)]
    for key in names:
        ordering.push_back(key)
    return graph.hessian(ordering)


def our_system(chain, rows, *parts):
    """The same from compiled rows."""
    a = np.hstack([part[rows] for part in parts])
    return a.T @ a, a.T @ chain.rows.right[rows]


def assert_same_system(theirs, ours, tolerance=1e-7):
    information, right = ours
    size = len(right)
    scale = np.sqrt(np.diag(information)) + 1e-9
    off = (theirs[0][:size, :size] - information) / np.outer(scale, scale)
    assert np.abs(off).max() < tolerance
    np.testing.assert_allclose(
        np.ravel(theirs[1])[:size] / scale, right / scale, rtol=0, atol=tolerance * 1e3
    )


def anywhere(problem, rng, spread):
    """A trajectory (K, n) that is nobody's solution."""
    start = sq.RauchTungStriebel().solve(problem).mean
    dim = problem.model.manifold.dim
    trajectory = problem.model.manifold.retract(start, spread * rng.standard_normal((len(start), dim)))
    for name in problem.model.static:
        part = problem.model.manifold.storage(name)
        trajectory[:, part] = trajectory[0, part]
    return trajectory
