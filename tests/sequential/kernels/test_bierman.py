"""The factored update against rational arithmetic, where covariances are as ill-conditioned as they come."""

import math

import exact
import numpy as np
import pytest

from sequential.kernels.bierman import (
    BIERMAN_VECTORS,
    factor_ud,
    reconstruct,
    update_covariance_ud,
    update_ud,
)


def scratch(m, d):
    return np.empty((m, d)), np.empty((m, m)), np.empty((BIERMAN_VECTORS, max(m, d)))


def factor(p):
    d = len(p)
    u, diagonal = np.empty((d, d)), np.empty(d)
    return factor_ud(p, d, u, diagonal), u, diagonal


def product(u, diagonal):
    p = np.empty_like(u)
    reconstruct(u, diagonal, len(u), p)
    return p


def factored_update(p, h, noise, residual, weight=1.0):
    """P+, correction, NIS and log det S, with U and D in between."""
    m, d = h.shape
    _, u, diagonal = factor(p)
    delta = np.zeros(d)
    nis, log_det = update_ud(u, diagonal, h, noise, weight, residual, m, d, delta, *scratch(m, d))
    return product(u, diagonal), delta, nis, log_det


def full_update(p, h, noise, residual, weight=1.0):
    m, d = h.shape
    p, delta = p.copy(), np.zeros(d)
    nis, log_det = update_covariance_ud(
        p, h, noise, weight, residual, m, d, delta, np.empty((d, d)), *scratch(m, d)
    )
    return p, delta, nis, log_det


UPDATES = pytest.mark.parametrize("update", [factored_update, full_update])


def random_covariance(rng, d, rank):
    root = rng.standard_normal((d, rank)) * 10.0 ** rng.uniform(-3, 3, (d, 1))
    return root @ root.T


@pytest.mark.parametrize("rank", range(1, 7))
def test_factors_multiply_out_to_what_they_came_from(rank, rng):
    p = random_covariance(rng, 6, rank)
    bad, u, diagonal = factor(p)
    sigma = np.sqrt(np.diag(p))
    assert bad == 0
    assert (diagonal >= 0.0).all()
    np.testing.assert_array_equal(np.tril(u, -1) + np.diag(np.diag(u)), np.eye(6))
    np.testing.assert_allclose(
        product(u, diagonal) / np.outer(sigma, sigma), p / np.outer(sigma, sigma), atol=1e-13
    )


def test_what_is_not_a_covariance_is_counted():
    assert factor(np.array([[1.0, 2.0], [2.0, 1.0]]))[0] == 1
    assert factor(-np.eye(3))[0] == 3
    bad, _, diagonal = factor(np.array([[1.0, 0.0], [0.0, np.nan]]))
    assert bad > 0
    assert np.isnan(diagonal).any()


def grewal_andrews(delta):
    """Two readings that differ by rounding only (Grewal and Andrews 2015, example 7.2)."""
    h = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0 + delta]])
    return np.eye(3), h, delta**2 * np.eye(2), np.array([0.3, -0.7])


@UPDATES
@pytest.mark.parametrize(
    ("delta", "bound"), [(1e-6, 1e-9), (1e-7, 1e-9), (1e-8, 1e-8), (1e-9, 1e-9), (1e-12, 1e-12)]
)
def test_two_readings_that_rounding_cannot_tell_apart(update, delta, bound):
    problem = grewal_andrews(delta)
    p, correction, nis, log_det = update(*problem)
    truth = exact.update(*problem)
    assert np.abs(p - truth[0]).max() <= bound
    np.testing.assert_allclose(correction, truth[1], rtol=1e-7)
    assert nis == pytest.approx(truth[2], rel=1e-7)
    assert log_det == pytest.approx(math.log(truth[3]), rel=1e-8)


@UPDATES
def test_any_update_against_rational_arithmetic(update, rng):
    for _ in range(30):
        d, m = rng.integers(1, 7), rng.integers(1, 5)
        p, h = random_covariance(rng, d, d), rng.standard_normal((m, d))
        noise, residual = random_covariance(rng, m, m) + 1e-3 * np.eye(m), rng.standard_normal(m)
        weight = rng.uniform(0.1, 1.0)
        after, correction, nis, log_det = update(p, h, noise, residual, weight)
        truth = exact.update(p, h, noise / weight, residual)
        np.testing.assert_allclose(after, truth[0], rtol=1e-7, atol=1e-9 * np.abs(truth[0]).max())
        np.testing.assert_allclose(correction, truth[1], rtol=1e-6, atol=1e-9 * np.abs(truth[1]).max())
        assert nis == pytest.approx(truth[2], rel=1e-6)
        assert log_det == pytest.approx(math.log(truth[3]), rel=1e-9, abs=1e-9)
        assert np.linalg.eigvalsh(after).min() > -1e-14 * np.abs(after).max()


@UPDATES
def test_a_perfect_reading_leaves_nothing_to_know(update, rng):
    """R = 0: afterwards H P Hᵀ is zero, and the estimate agrees with the reading."""
    p, h, residual = random_covariance(rng, 5, 5), rng.standard_normal((2, 5)), rng.standard_normal(2)
    after, correction, nis, _ = update(p, h, np.zeros((2, 2)), residual)
    assert nis > 0.0
    assert np.abs(h @ after @ h.T).max() <= 1e-14 * np.abs(h @ p @ h.T).max()
    np.testing.assert_allclose(h @ correction, residual, rtol=1e-9)


@UPDATES
def test_noise_of_one_source_in_two_readings(update):
    """Singular R: the difference of the two readings is exact."""
    h, noise = np.array([[1.0, 0.0], [0.0, 1.0]]), np.ones((2, 2))
    after, correction, nis, log_det = update(np.eye(2), h, noise, np.array([1.0, 0.5]))
    np.testing.assert_allclose(after, np.full((2, 2), 1.0 / 3.0), rtol=1e-14)
    assert correction[0] - correction[1] == pytest.approx(0.5)
    assert nis == pytest.approx(np.array([1.0, 0.5]) @ np.linalg.solve(np.eye(2) + noise, [1.0, 0.5]))
    assert log_det == pytest.approx(math.log(3.0))


@UPDATES
def test_a_reading_that_nothing_could_explain_is_reported(update):
    """Perfect twice, and the second time different: its innovation variance is zero."""
    h = np.array([[1.0, 0.0], [1.0, 0.0]])
    assert update(np.eye(2), h, np.zeros((2, 2)), np.array([1.0, 2.0]))[2] == -1.0


def test_a_failed_update_leaves_a_full_covariance_alone():
    p = np.array([[1.0, 2.0], [2.0, 1.0]])
    after, correction, nis, _ = full_update(p, np.eye(2), np.eye(2), np.ones(2))
    assert nis == -1.0
    np.testing.assert_array_equal(after, p)
    np.testing.assert_array_equal(correction, 0.0)
