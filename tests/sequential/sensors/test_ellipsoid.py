import numpy as np
import pytest
from field_worlds import CENTRE, ROOT, points, smooth_turns, sphere

from sequential.sensors.ellipsoid_fit import (
    _derivative,
    _moved,
    excess,
    fit_ellipsoid,
    parameters_of,
)
from sequential.sensors.ellipsoid_moments import ellipsoid_from_moments, sphere_from_moments, symmetric_root


def test_excess_is_what_noise_adds_to_a_norm(rng):
    noise = np.diag([0.1, 0.05, 0.08]) ** 2
    vector = np.array([[0.6, 0.0, 0.8]])
    noisy = vector + rng.standard_normal((400_000, 3)) @ symmetric_root(noise)
    norms = np.linalg.norm(noisy, axis=1)
    mean, variance = excess(vector, noise)
    np.testing.assert_allclose(norms.mean() - 1, mean[0], rtol=0.1)
    np.testing.assert_allclose(norms.var(), variance[0], rtol=0.03)


def test_derivative_meets_central_differences(rng):
    arm = points(20, rng) - CENTRE
    given = _derivative(arm, ROOT)
    for k in range(9):
        step = np.zeros(9)
        step[k] = 1e-7 if k < 6 else 1e-4
        ends = []
        for sign in (1, -1):
            root, centre = _moved(ROOT, np.zeros(3), sign * step)
            ends.append(np.linalg.norm((arm - centre) @ root, axis=1))
        np.testing.assert_allclose((ends[0] - ends[1]) / (2 * step[k]), given[:, k], rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("dim", [2, 3])
def test_exact_points_give_the_exact_ellipsoid(rng, dim):
    root, centre = ROOT[:dim, :dim], CENTRE[:dim]
    unit = rng.standard_normal((60, dim))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    exact = unit @ np.linalg.inv(root) + centre
    found = ellipsoid_from_moments(exact, np.zeros((dim, dim)))
    np.testing.assert_allclose(found[0], root, atol=1e-10)
    np.testing.assert_allclose(found[1], centre, atol=1e-7)
    fit = fit_ellipsoid(exact + 1e-6 * rng.standard_normal(exact.shape), 1e-12 * np.eye(dim), rng)
    np.testing.assert_allclose(fit.root, root, atol=1e-7)


def test_moments_and_the_constraint_of_li_and_griffiths_give_an_ellipsoid_of_a_thin_cap(rng):
    """Where noise makes the free quadric a hyperboloid, an ellipsoid comes back or nothing does."""
    directions = sphere(4000, rng)
    cap = directions[directions[:, 2] > 0.8]
    kinds = set()
    for _ in range(20):
        found = ellipsoid_from_moments(points(0, rng, directions=cap, sigma=6.0), 36.0 * np.eye(3))
        kinds.add(found is None)
        if found is not None:
            assert (np.linalg.eigvalsh(found[0]) > 0).all()
    assert False in kinds


def test_a_sphere_through_exact_points(rng):
    exact = 46.0 * sphere(50, rng) + CENTRE
    root, centre = sphere_from_moments(exact, np.zeros((3, 3)))
    np.testing.assert_allclose(root, np.eye(3) / 46.0, atol=1e-12)
    np.testing.assert_allclose(centre, CENTRE, atol=1e-10)


@pytest.mark.parametrize("even", [True, False])
def test_noise_leaves_a_sphere_where_it_is(rng, even):
    directions = sphere(60_000, rng)
    directions = directions if even else directions[directions[:, 1] > 0]
    noise = np.diag([1.0, 3.0, 2.0]) ** 2
    noisy = 46.0 * directions + CENTRE + rng.standard_normal(directions.shape) * np.sqrt(np.diag(noise))
    for found in (sphere_from_moments(noisy, noise), fit_ellipsoid(noisy, noise, rng, sphere=True)):
        root, centre = found if isinstance(found, tuple) else (found.root, found.centre)
        np.testing.assert_allclose(1 / root[0, 0], 46.0, atol=0.12)
        np.testing.assert_allclose(centre, CENTRE, atol=0.15)


# --- consistency: noise must not shrink or swell the ellipsoid ---


@pytest.mark.parametrize("even", [True, False])
def test_noise_leaves_no_bias_where_plain_least_squares_has_one(rng, even):
    sigma = 0.07 * 46  # 7 % of the field a reading
    directions = sphere(120_000, rng)
    if not even:
        directions = directions[directions[:, 0] > -0.3]
    noisy = points(0, rng, sigma=sigma, directions=directions)
    gain = np.linalg.eigvalsh(ROOT)
    plain = np.linalg.eigvalsh(ellipsoid_from_moments(noisy, np.zeros((3, 3)))[0])
    consistent = np.linalg.eigvalsh(ellipsoid_from_moments(noisy, sigma**2 * np.eye(3))[0])
    refined = np.linalg.eigvalsh(fit_ellipsoid(noisy, sigma**2 * np.eye(3), rng).root)
    assert np.abs(plain / gain - 1).max() > 0.008
    assert np.abs(consistent / gain - 1).max() < 0.006
    assert np.abs(refined / gain - 1).max() < 0.004


def test_covariance_is_that_of_many_recordings(rng):
    truth = parameters_of(ROOT, CENTRE)
    nees, inside = [], []
    for _ in range(80):
        fit = fit_ellipsoid(points(800, rng, sigma=1.0), np.eye(3), rng)
        error = parameters_of(fit.root, fit.centre) - truth
        nees.append(error @ np.linalg.solve(fit.cov, error))
        inside.append(np.abs(error) < 1.96 * np.sqrt(np.diag(fit.cov)))
    assert 7.5 < np.mean(nees) < 11.5  # nine parameters
    assert 0.91 < np.mean(inside) < 0.98


def test_covariance_counts_neighbours_that_err_together(rng):
    """The same points, each five times in a row, know no more than once."""
    once = points(2000, rng, sigma=1.0)
    many = np.repeat(once, 5, axis=0)
    a, b = (fit_ellipsoid(p, np.eye(3), rng) for p in (once, many))
    np.testing.assert_allclose(np.diag(b.cov), np.diag(a.cov), rtol=0.5)


def test_covariance_counts_a_field_that_wanders(rng):
    """Hard iron that drifts by 1 % of the field over minutes: intervals grow, and still cover the mean."""
    t = np.linspace(0, 1, 8000)
    still = points(0, rng, directions=smooth_turns(len(t), rng), sigma=0.5)
    wander = 0.6 * np.stack([np.sin(9 * t), np.cos(7 * t + 1), np.sin(8 * t + 2)], axis=1)
    a, b = (fit_ellipsoid(p, 0.25 * np.eye(3), rng) for p in (still, still + wander))
    assert (np.diag(b.cov)[6:] > 2 * np.diag(a.cov)[6:]).all()
    off = b.centre - (CENTRE + wander.mean(axis=0))
    assert (np.abs(off) < 4 * np.sqrt(np.diag(b.cov)[6:])).all()


@pytest.mark.parametrize("share", [0.05, 0.2, 0.3])
def test_outliers_have_no_say(rng, share):
    clean = points(3000, rng, sigma=0.5)
    spoilt = clean.copy()
    hit = rng.random(len(clean)) < share
    spoilt[hit] += np.array([25.0, 10.0, -15.0]) + 5 * rng.standard_normal((hit.sum(), 3))
    a, b = (fit_ellipsoid(p, 0.25 * np.eye(3), rng) for p in (clean, spoilt))
    np.testing.assert_allclose(b.root, a.root, atol=4e-4)
    np.testing.assert_allclose(b.centre, a.centre, atol=0.4)
    assert (b.weights[hit] == 0).mean() > 0.6
