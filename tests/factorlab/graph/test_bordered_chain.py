"""A chain with a border: the step and every covariance are those of the dense matrix."""

import numpy as np
import pytest

from factorlab.graph.bordered_chain import BorderedChain
from sequential.errors import UnderConstrainedError

COUNT, N, Q = 7, 4, 5


def random_chain(rng, *, linked):
    """A problem with more rows than unknowns, and its dense normal equations."""
    whole = COUNT * N + Q
    H, g = np.zeros((whole, whole)), rng.standard_normal(whole)
    border = np.arange(COUNT * N, whole)
    for k in range(COUNT):
        own = np.arange(k * N, (k + 1) * N)
        near = np.concatenate([own, own + N]) if linked and k + 1 < COUNT else own
        for columns in (np.concatenate([own, border]), near):
            rows = rng.standard_normal((2 * len(columns), len(columns))) * 10.0 ** rng.uniform(-2, 2)
            H[np.ix_(columns, columns)] += rows.T @ rows
    pieces = H[: COUNT * N, : COUNT * N].reshape(COUNT, N, COUNT, N)
    k = np.arange(COUNT)
    chain = BorderedChain(
        pieces[k, :, k], pieces[k[:-1], :, k[1:]] if linked else None,
        H[: COUNT * N, COUNT * N :].reshape(COUNT, N, Q), H[COUNT * N :, COUNT * N :],
        g[: COUNT * N].reshape(COUNT, N), g[COUNT * N :],
    )  # fmt: skip
    return chain, H, g


@pytest.mark.parametrize("linked", [True, False])
def test_the_step_is_that_of_the_dense_equations(linked, rng):
    chain, H, g = random_chain(rng, linked=linked)
    solution = chain.solve()
    dense = -np.linalg.solve(H, g)
    np.testing.assert_allclose(np.append(solution.chain.ravel(), solution.border), dense, rtol=1e-8)


@pytest.mark.parametrize("linked", [True, False])
def test_covariances_are_blocks_of_the_dense_inverse(linked, rng):
    chain, H, _ = random_chain(rng, linked=linked)
    frames, border = chain.solve().covariances()
    inverse = np.linalg.inv(H)
    k = np.arange(COUNT)
    expected = inverse[: COUNT * N, : COUNT * N].reshape(COUNT, N, COUNT, N)[k, :, k]
    np.testing.assert_allclose(frames, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(border, inverse[COUNT * N :, COUNT * N :], rtol=1e-7, atol=1e-12)


def test_damping_raises_the_diagonal(rng):
    chain, H, g = random_chain(rng, linked=True)
    solution = chain.damped(0.5).solve()
    dense = -np.linalg.solve(H + 0.5 * np.diag(np.diag(H)), g)
    np.testing.assert_allclose(np.append(solution.chain.ravel(), solution.border), dense, rtol=1e-8)


@pytest.mark.parametrize("linked", [True, False])
def test_a_free_frame_is_named(linked, rng):
    chain, _, _ = random_chain(rng, linked=linked)
    chain.diagonal[3] = 0.0
    chain.edge[3] = 0.0
    if linked:
        chain.beside[2:4] = 0.0
    with pytest.raises(UnderConstrainedError, match="frame 3 is free"):
        chain.solve()


def test_a_free_border_is_said(rng):
    chain, _, _ = random_chain(rng, linked=True)
    chain.edge[:, :, 2] = chain.corner[2] = chain.corner[:, 2] = 0.0
    with pytest.raises(UnderConstrainedError, match="the markers together free"):
        chain.solve()
