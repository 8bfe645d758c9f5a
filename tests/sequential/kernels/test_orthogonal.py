"""Orthogonal transformations change nothing but the shape of a factor, however unlike its columns are."""

import numpy as np
import pytest

from sequential.kernels.bierman import reconstruct
from sequential.kernels.orthogonal import orthogonalise, push_root, push_ud, triangularise, update_root


def uneven(rng, rows, columns, decades=6.0):
    """Columns and rows of very different sizes."""
    sizes = 10.0 ** rng.uniform(-decades, decades, columns)
    return rng.standard_normal((rows, columns)) * sizes * 10.0 ** rng.uniform(-3.0, 3.0, (rows, 1))


def assert_same_square(p, truth):
    """Equal in units of the standard deviations."""
    sigma = np.sqrt(np.diag(truth))
    scale = np.outer(np.where(sigma > 0.0, sigma, 1.0), np.where(sigma > 0.0, sigma, 1.0))
    np.testing.assert_allclose(p / scale, truth / scale, atol=1e-13)


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 4), (3, 3), (4, 9), (7, 8)])
def test_gram_schmidt_keeps_the_weighted_square(rows, columns, rng):
    w, weight = uneven(rng, rows, columns), rng.uniform(0.0, 2.0, columns)
    truth = w * weight @ w.T
    u, diagonal, p = np.empty((rows, rows)), np.empty(rows), np.empty((rows, rows))
    orthogonalise(w.copy(), weight, rows, columns, u, diagonal)
    assert (diagonal >= 0.0).all()
    np.testing.assert_array_equal(np.tril(u), np.eye(rows))
    reconstruct(u, diagonal, rows, p)
    assert_same_square(p, truth)


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 4), (3, 3), (4, 9), (7, 8)])
def test_reflections_keep_the_square(rows, columns, rng):
    a = uneven(rng, rows, columns)
    truth = a @ a.T
    triangularise(a, rows, columns)
    np.testing.assert_array_equal(np.triu(a, 1), 0.0)
    assert (np.diag(a[:, :rows]) >= 0.0).all()
    assert_same_square(a @ a.T, truth)


def test_rows_that_depend_on_others_become_zeros(rng):
    base = rng.standard_normal((2, 5))
    w = np.stack([base[0] + base[1], base[0], base[1], np.zeros(5)])
    u, diagonal = np.empty((4, 4)), np.empty(4)
    orthogonalise(w.copy(), np.ones(5), 4, 5, u, diagonal)
    assert diagonal[3] == 0.0
    assert diagonal[0] < 1e-28
    a = w.copy()
    triangularise(a, 4, 5)
    np.testing.assert_allclose(a @ a.T, w @ w.T, atol=1e-14)


def test_small_columns_beside_large_ones_keep_their_digits():
    """Where next to nothing was known, what is left is the noise of the reading, to the last digit."""
    small, large = 0.2, 1e12
    root, delta = np.array([[large]]), np.zeros(1)
    nis, _ = update_root(
        root, np.eye(1), np.array([[small**2]]), 1.0, np.ones(1), 1, 1, delta,
        np.empty((2, 2)), np.empty((1, 1)), np.empty(1),
    )  # fmt: skip
    assert root[0, 0] == pytest.approx(small, rel=1e-14)
    assert delta[0] == pytest.approx(1.0, rel=1e-14)
    assert nis == pytest.approx(1e-24, rel=1e-12)


@pytest.mark.parametrize("rank", [0, 1, 3])
def test_both_pushes_are_the_covariance_of_a_step(rank, rng):
    d = 5
    f, root, source = rng.standard_normal((d, d)), rng.standard_normal((d, d)), rng.standard_normal((d, d))
    variance = np.where(np.arange(d) < rank, rng.uniform(0.5, 2.0, d), 0.0)
    truth = f @ root @ root.T @ f.T + source * variance @ source.T
    scratch = np.empty((d, 2 * d)), np.empty(2 * d)
    for push in (push_ud, push_root):
        u, diagonal, p = root.copy(), np.ones(d), np.empty((d, d))
        push(f, u, diagonal, source, variance, d, *scratch)
        reconstruct(u, diagonal, d, p)
        np.testing.assert_allclose(p, truth, rtol=1e-11, atol=1e-12)
