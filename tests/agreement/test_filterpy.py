"""FilterPy's Kalman filter and RTS smoother as an oracle from outside."""

import warnings

import numpy as np
import pytest
from worlds import LINEAR_WORLDS

import sequential as sq
from sequential.model import evaluate

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from filterpy import kalman as filterpy

WORLD = LINEAR_WORLDS[0]  # one sensor, and no reading skipped: FilterPy walks one step a reading


@pytest.fixture
def pair(rng):
    """Our forward and smoothed runs, and FilterPy's arrays for the same log."""
    model, drawn = WORLD.model, WORLD.draw(rng)
    d, f = model.manifold.dim, model.process_functions
    dt = float(drawn.t[1] - drawn.t[0]) * 1e-9
    zero, u = np.zeros(d), np.zeros(1)
    theirs = filterpy.KalmanFilter(dim_x=d, dim_z=2)
    theirs.x, theirs.P = model.prior.mean.copy(), model.prior.cov.copy()
    theirs.F = evaluate(f.jacobian, zero, u, dt, f.params, d * d).reshape(d, d)
    theirs.Q = evaluate(f.noise, zero, u, dt, f.params, d * d).reshape(d, d)
    theirs.H, theirs.R = np.asarray(model.sensors["position"].matrix), model.sensors["position"].noise_cov
    z = drawn.log["position"].values
    means, covs, log_likelihood = [], [], 0.0
    for k, reading in enumerate(z):
        if k:
            theirs.predict()
        theirs.update(reading)
        log_likelihood += theirs.log_likelihood
        means.append(theirs.x.copy())
        covs.append(theirs.P.copy())
    means, covs = np.array(means), np.array(covs)
    count = len(means)
    smooth = theirs.rts_smoother(means, covs, Fs=[theirs.F] * count, Qs=[theirs.Q] * count)
    return drawn, (means, covs, log_likelihood), smooth[:2]


def test_filter(pair):
    drawn, (means, covs, log_likelihood), _ = pair
    run = sq.run(sq.KalmanFilter(), WORLD.model, drawn.log)
    np.testing.assert_allclose(run.mean, means, rtol=0, atol=1e-10)
    np.testing.assert_allclose(run.cov, covs, rtol=0, atol=1e-10)
    assert run.log_likelihood == pytest.approx(log_likelihood, rel=1e-10)


def test_smoother(pair):
    drawn, _, (means, covs) = pair
    run = sq.run(sq.RauchTungStriebel(), WORLD.model, drawn.log)
    np.testing.assert_allclose(run.mean, means, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.cov, covs, rtol=0, atol=1e-9)


@pytest.mark.parametrize("n", [1, 2, 3, 6])
@pytest.mark.parametrize("points", ["merwe", "julier", "simplex"])
def test_sigma_points(points, n, rng):
    """The same weights, and the same points; those of the simplex are turned, and have the same moments."""
    mean, root = rng.standard_normal(n), rng.standard_normal((n, n + 1))
    cov = root @ root.T
    theirs = {
        "merwe": filterpy.MerweScaledSigmaPoints(n, 0.4, 2.0, 0.7),
        "julier": filterpy.JulierSigmaPoints(n, 0.7),
        "simplex": filterpy.SimplexSigmaPoints(n),
    }[points]
    ours = sq.sigma_points(mean, cov, 0.7, points=points, alpha=0.4)
    mean_weights, cov_weights = theirs.Wm, theirs.Wc
    expected = theirs.sigma_points(mean, cov)
    if points == "simplex":
        assert sorted(ours.mean_weights[ours.mean_weights > 0]) == pytest.approx(sorted(mean_weights))
    else:
        np.testing.assert_allclose(ours.mean_weights, mean_weights, rtol=1e-12)
        np.testing.assert_allclose(ours.cov_weights, cov_weights, rtol=1e-12)
        away = np.abs(ours.points[:, None] - expected[None]).max(axis=2)
        assert away.min(axis=0).max() < 1e-12
        assert away.min(axis=1).max() < 1e-12
    for found, weights, spread in (
        (ours.points, ours.mean_weights, ours.cov_weights),
        (expected, mean_weights, cov_weights),
    ):
        np.testing.assert_allclose(weights @ found, mean, atol=1e-12)
        apart = found - mean
        np.testing.assert_allclose(apart.T @ (spread[:, None] * apart), cov, atol=1e-11)
