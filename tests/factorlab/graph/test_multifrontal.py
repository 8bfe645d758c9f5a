"""Blocks of an inverse by dense fronts: those of the dense inverse, and GTSAM's."""

import numpy as np
import pytest
from graph_files import BOTH, looped
from scipy.sparse import csr_array, vstack

from factorlab.graph.slam import BatchSlam
from factorlab.graph.slam import marginals as room
from factorlab.graph.slam.multifrontal import diagonal_blocks
from factorlab.graph.slam.rows import Rows


def problem_rows(rng, dims, count):
    """Random rows that join a few variables each, and one on each alone."""
    begin = np.concatenate([[0], np.cumsum(dims)])
    dense = []
    for k in range(count + len(dims)):
        who = [k] if k < len(dims) else rng.choice(len(dims), 2, replace=False)
        row = np.zeros((3, begin[-1]))
        for variable in who:
            row[:, begin[variable] : begin[variable + 1]] = rng.standard_normal((3, dims[variable]))
        dense.append(row)
    return np.vstack(dense)


def test_blocks_are_those_of_the_dense_inverse(rng):
    for count in (1, 2, 5, 40):
        dims = rng.integers(1, 4, count)
        dense = problem_rows(rng, dims, 0 if count == 1 else 2 * count)
        dense *= 10.0 ** rng.uniform(-4, 4, dense.shape[1])
        scale = 1 / np.linalg.norm(dense, axis=0)
        scaled = dense * scale
        inverse = scale[:, None] * np.linalg.inv(scaled.T @ scaled) * scale
        ends = np.concatenate([[0], np.cumsum(dims)])
        for k, block in enumerate(diagonal_blocks(csr_array(dense), dims)):
            part = slice(ends[k], ends[k + 1])
            np.testing.assert_allclose(
                block, inverse[part, part], rtol=1e-6, atol=1e-12 * inverse[part, part].max()
            )


def test_a_long_chain_keeps_its_fill(rng):
    """A chain of scalars that ends see the same few others: its fill is far smaller than any number."""
    chain, others = 1500, 12
    dims = np.ones(chain + others, dtype=np.int64)
    pairs = [(k, k + 1) for k in range(chain - 1)]
    pairs += [
        (k, chain + int(j)) for k in (*range(30), *range(chain - 30, chain)) for j in rng.choice(others, 4)
    ]
    rows = np.repeat(np.arange(len(pairs)), 2)
    values = rng.uniform(0.5, 2.0, len(pairs))[:, None] * [1.0, -1.0]
    shape = (len(pairs), chain + others)
    joined = csr_array((values.ravel(), (rows, np.array(pairs).ravel())), shape)
    matrix = csr_array(vstack([joined, csr_array(([1.0], ([0], [0])), (1, shape[1]))]))
    exact = np.diag(np.linalg.inv((matrix.T @ matrix).toarray()))
    np.testing.assert_allclose(np.ravel(diagonal_blocks(matrix, dims)), exact, rtol=1e-7)


@pytest.mark.parametrize("manifold", BOTH, ids=["plane", "space"])
def test_both_routes_of_marginals_agree(manifold, rng, monkeypatch):
    problem, _ = looped(manifold, rng, count=60, loops=60)
    run = BatchSlam(covariance=False).solve(problem)
    rows = Rows(problem, {"x": problem.indices("x")})
    by_query = room.marginals_of(rows, run.values, ("x",))["x"]
    monkeypatch.setattr(room, "MANY", 0)
    at_once = room.marginals_of(rows, run.values, ("x",))["x"]
    np.testing.assert_allclose(at_once, by_query, rtol=1e-6, atol=1e-12)


def test_a_free_direction_is_no_covariance(rng):
    dense = problem_rows(rng, np.array([2, 2, 2]), 3)
    dense[:, 3] = 0.0
    with pytest.raises(np.linalg.LinAlgError):
        diagonal_blocks(csr_array(dense), np.array([2, 2, 2]))
    dense[:, 3] = dense[:, 2]
    with pytest.raises(np.linalg.LinAlgError):
        diagonal_blocks(csr_array(dense), np.array([2, 2, 2]))
