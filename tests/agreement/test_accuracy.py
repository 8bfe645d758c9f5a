"""Accuracy cases that any serious library must pass: angles, batch least squares, sigma points, consistency.

The others: the Nile in test_nile.py, ill-conditioned updates in sequential/filters/test_ill_conditioned.py,
discretisation and steady states in sequential/test_discretise.py and test_steady_state.py.
"""

import math

import dense
import numpy as np
import pytest
from scipy.stats import chi2
from worlds import LINEAR_WORLDS, nees

import sequential as sq
from sequential.evaluate.consistency import anees, chi2_band, chi2_quantile
from sequential.manifold import wrap_angle

linear = pytest.mark.parametrize("world", LINEAR_WORLDS, ids=repr)

SPREADS = [
    sq.UnscentedKalmanFilter(keep=True),
    sq.UnscentedKalmanFilter(alpha=0.5, kappa=1.0, keep=True),
    sq.UnscentedKalmanFilter(kappa=-1.0, keep=True),
    sq.UnscentedKalmanFilter(points="julier", kappa=1.0, keep=True),
    sq.UnscentedKalmanFilter(points="simplex", keep=True),
    sq.CubatureKalmanFilter(keep=True),
]
FORMS = [sq.KalmanFilter(keep=True, form=form) for form in ("joseph", "ud", "sqrt", "information")]


def scaled_difference(run, mean, cov):
    """Largest difference of means and covariances, in standard deviations."""
    sigma = np.sqrt(np.diagonal(cov, axis1=1, axis2=2))
    apart = np.abs((run.mean - mean) / sigma).max()
    return max(apart, np.abs((run.cov - cov) / (sigma[:, :, None] * sigma[:, None, :])).max())


# --- angles (case 5) ---


def test_angles_are_subtracted_round_the_circle():
    degrees = np.radians
    assert wrap_angle(np.array([degrees(359.0) - degrees(-1.0)]))[0] == pytest.approx(0.0, abs=1e-15)
    assert wrap_angle(np.array([degrees(179.0) - degrees(-179.0)]))[0] == pytest.approx(degrees(-2.0))


@pytest.mark.parametrize("alpha", [1.0, 0.1, 1e-3])
@pytest.mark.parametrize("spread", [0.5, 0.8])
@pytest.mark.parametrize("heading", [math.pi - 0.001, -math.pi + 0.001, 0.3])
def test_the_mean_of_bearings_lies_among_them(alpha, spread, heading):
    """Points round π: sines and cosines under a central weight of -99, or of -1e6, would average to 0."""
    model = sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([heading], [[spread**2]]),
        sq.RandomWalk(1e-6),
        {
            "bearing": sq.Sensor(
                lambda x: np.array([math.remainder(x[0], 2 * math.pi)]), 0.01, manifold=sq.SO2()
            )
        },
    )
    seen = math.remainder(heading + 0.1, 2 * math.pi)
    log = sq.SensorLog({"bearing": sq.Stream([0.0], [[seen]])})
    run = sq.run(sq.UnscentedKalmanFilter(alpha=alpha), model, log)
    innovation = run.innovations["bearing"]
    # weights of a million leave ten digits
    tolerance = 1e-12 / alpha**2
    assert innovation.residual[0, 0] == pytest.approx(0.1, abs=tolerance)
    assert innovation.cov[0, 0, 0] == pytest.approx(spread**2 + 0.01, rel=max(tolerance, 1e-12))
    assert run.mean[0, 0] == pytest.approx(heading + 0.1 * spread**2 / (spread**2 + 0.01), abs=tolerance)


# --- RTS = URTS = batch least squares (case 7) ---


@linear
@pytest.mark.parametrize("estimator", [*FORMS, *SPREADS], ids=repr)
def test_smoothing_is_batch_least_squares(world, estimator, rng):
    problem = world.problem(rng)
    run = sq.RauchTungStriebel(estimator).solve(problem)
    chain = dense.linearise(problem, np.zeros_like(run.mean))
    mean, cov = dense.least_squares(chain)
    assert scaled_difference(run, mean, cov) < 1e-10
    mean, cov = dense.condition(chain)
    assert scaled_difference(run, mean, cov) < 1e-10


# --- sigma points = Kalman filter (case 8) ---


@linear
@pytest.mark.parametrize("estimator", SPREADS, ids=repr)
def test_sigma_points_on_a_linear_problem(world, estimator, rng):
    """All moments to 1e-12, redrawn after the process noise; and so the likelihood."""
    problem = world.problem(rng)
    expected, run = sq.KalmanFilter(keep=True).solve(problem), estimator.solve(problem)
    assert scaled_difference(run, expected.mean, expected.cov) < 1e-12
    ahead = expected.predicted
    sigma = np.sqrt(np.diagonal(ahead.cov, axis1=1, axis2=2))
    assert np.abs((run.predicted.mean - ahead.mean) / sigma).max() < 1e-12
    assert run.log_likelihood == pytest.approx(expected.log_likelihood, rel=1e-12)
    for name, seen in expected.innovations.items():
        size = np.sqrt(np.diagonal(seen.cov, axis1=1, axis2=2))
        other = run.innovations[name]
        assert np.abs((other.residual - seen.residual) / size).max() < 1e-11
        assert np.abs((other.cov - seen.cov) / (size[:, :, None] * size[:, None, :])).max() < 1e-11


# --- consistency (case 10) ---


def test_the_bands_are_those_of_the_tables():
    np.testing.assert_allclose(chi2.ppf([0.025, 0.975], 2), [0.0506, 7.3778], atol=5e-5)
    assert chi2_quantile(0.99, 2) == pytest.approx(9.2103, abs=5e-5)
    np.testing.assert_allclose(chi2_band(4, 50), [3.2546, 4.8212], atol=2e-3)
    np.testing.assert_allclose(np.array(chi2_band(4, 50)) / 4, [0.8136, 1.2053], atol=5e-4)


def monte_carlo(factor, runs=200, steps=60):
    """ANEES and mean NIS, node by node, of a filter whose Q is `factor` times that of the truth."""
    world = LINEAR_WORLDS[0]
    model = world.model
    told = sq.StateSpace(
        model.manifold,
        model.prior,
        sq.ConstantVelocity(0.1 * factor, axes=2),
        model.sensors,
        start=model.start,
    )
    errors, surprises = np.empty((runs, steps)), np.empty((runs, steps))
    for seed in range(runs):
        drawn = world.draw(np.random.default_rng([2026, seed]))
        run = sq.run(sq.KalmanFilter(), told, drawn.log)
        errors[seed] = nees(run, drawn.truth[np.searchsorted(drawn.t, run.t)], np.arange(steps))
        surprises[seed] = run.innovations["position"].nis()
    return errors, surprises


def test_a_matched_filter_is_inside_the_band():
    """200 runs: the average lies inside the 95 % band at 95 % of the nodes, give or take."""
    errors, surprises = monte_carlo(1.0)
    verdict = anees(list(errors), 4)
    assert verdict.runs == 200
    low, high = chi2.ppf([0.025, 0.975], 4 * errors.size) / errors.size
    # errors of neighbouring nodes are alike, so the whole average has the band of fewer draws
    assert low - 0.1 < verdict.mean < high + 0.1
    assert verdict.share_inside > 0.9
    inside = (surprises >= 0.0506) & (surprises <= 7.3778)
    assert inside.mean() == pytest.approx(0.95, abs=0.02)
    band = chi2.ppf([0.025, 0.975], 2 * 200) / 200
    share = np.mean((surprises.mean(axis=0) > band[0]) & (surprises.mean(axis=0) < band[1]))
    assert share > 0.87
    first, last = chi2_band(4, 200)
    assert first < errors[:, -1].mean() < last


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_a_wrong_process_noise_is_outside(factor):
    errors, surprises = monte_carlo(factor, runs=50)
    verdict = anees(list(errors), 4)
    settled = verdict.average[20:]
    outside = settled > verdict.band[1] if factor < 1.0 else settled < verdict.band[0]
    assert outside.mean() > 0.8
    assert (surprises.mean() > 2.2) if factor < 1.0 else (surprises.mean() < 1.8)
