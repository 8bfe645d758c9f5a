"""Sigma points: their moments, the angles they must not average, and what they do where Jacobians mislead."""

import math

import numpy as np
import pytest
from worlds import CURVED_WORLDS

import sequential as sq
from sequential.errors import ModelError

UKF, EKF = sq.UnscentedKalmanFilter(), sq.ExtendedKalmanFilter()


@pytest.mark.parametrize(
    "ukf", [UKF, sq.UnscentedKalmanFilter(0.5, 2.0, 1.0), sq.UnscentedKalmanFilter(kappa=-2.0)]
)
@pytest.mark.parametrize("dim", [3, 15])
def test_weights_reproduce_the_first_two_moments(ukf, dim):
    gamma, central, _, other = ukf.weights(dim)
    assert central + 2 * dim * other == pytest.approx(1.0)
    assert 2 * other * gamma**2 == pytest.approx(1.0)


@pytest.mark.parametrize(("alpha", "kappa"), [(0.0, 0.0), (-1.0, 0.0), (1.0, -2.0), (math.nan, 0.0)])
def test_points_that_do_not_spread_are_refused(alpha, kappa):
    model = sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 0.0], 1.0),
        sq.RandomWalk(1.0),
        {"z": sq.LinearSensor([[1.0, 0]], 1.0)},
    )
    log = sq.SensorLog({"z": sq.Stream([0.0, 1.0], [0.0, 1.0])})
    with pytest.raises(ModelError, match="do not spread over 2 directions"):
        sq.run(sq.UnscentedKalmanFilter(alpha=alpha, kappa=kappa), model, log)


def squared(x):
    return np.array([x[0] ** 2])


def test_the_mean_of_a_square_is_seen():
    """E[x²] = μ² + σ²: a Jacobian misses the σ², sigma points do not; Var[x²] = 2σ⁴ + 4μ²σ² is exact too."""
    mu, sigma, noise = 0.5, 0.8, 0.1
    model = sq.StateSpace(
        sq.Vector(1), sq.Gaussian([mu], sigma**2), sq.RandomWalk(0.0), {"z": sq.Sensor(squared, noise)}
    )
    log = sq.SensorLog({"z": sq.Stream([0.0], [1.0])})
    seen = sq.run(UKF, model, log).innovations["z"]
    assert seen.residual[0, 0] == pytest.approx(1.0 - (mu**2 + sigma**2))
    assert seen.cov[0, 0, 0] == pytest.approx(2 * sigma**4 + 4 * mu**2 * sigma**2 + noise)
    assert sq.run(EKF, model, log).innovations["z"].residual[0, 0] == pytest.approx(1.0 - mu**2)


def tower(heading, x=-10.0):
    """A vehicle near the origin that sees a landmark behind it, at a bearing of about ±π."""
    return sq.StateSpace(
        sq.SE2(),
        sq.Gaussian([0.0, 0.0, heading], sq.diagonal([0.5, 0.5, 0.2])),
        sq.Unicycle(0.01, 0.01, 0.01),
        {"landmark": sq.RangeBearing([[x, 0.0]], sq.diagonal([0.1, 0.01]))},
        input="odometry",
        start=0.0,
    )


@pytest.mark.parametrize("heading", [0.0, 1e-3, -1e-3, 0.05])
@pytest.mark.parametrize("bearing", [math.pi - 0.01, -math.pi + 0.01])
def test_a_bearing_near_pi_is_no_trap(heading, bearing):
    """Sigma points straddle ±π here; an average of their angles would point forwards."""
    log = sq.SensorLog(
        {"odometry": sq.Stream([0.0], [[0.0, 0.0]]), "landmark": sq.Stream([0.0], [[10.0, bearing]], [0.0])}
    )
    runs = [sq.run(e, tower(heading), log) for e in (UKF, EKF)]
    wrapped = math.remainder(bearing - (math.pi - heading), 2 * math.pi)
    for run in runs:
        seen = run.innovations["landmark"]
        assert seen.residual[0, 1] == pytest.approx(wrapped, abs=0.02)
        assert seen.cov[0, 1, 1] < 0.06
    manifold = runs[0].manifold
    apart = manifold.local(runs[0].mean[0], runs[1].mean[0])
    assert np.abs(apart).max() < 0.02


def test_turning_the_world_by_359_degrees_changes_nothing():
    """The same drive with every heading 359° further: equal but for the turn."""
    turn = math.radians(359.0)

    def circle(angle):
        c, s = math.cos(angle), math.sin(angle)
        marks = np.array([[4.0, 1.0], [-3.0, 5.0], [-2.0, -4.0]]) @ np.array([[c, s], [-s, c]])
        model = sq.StateSpace(
            sq.SE2(),
            sq.Gaussian([c, s, math.remainder(0.3 + angle, 2 * math.pi)], sq.diagonal([0.3, 0.3, 0.1])),
            sq.Unicycle(0.05, 0.05, 0.05),
            {"landmark": sq.RangeBearing(marks, sq.diagonal([0.1, 0.03]))},
            input="odometry",
            start=0.0,
        )
        t = np.arange(200) * 0.1
        drawn = sq.simulate(
            model, t, np.random.default_rng(5), inputs=np.tile([1.0, 1.0], (200, 1)),
            readings={"landmark": 3}, contexts={"landmark": (np.arange(67) % 3)[:, None]},
        )  # fmt: skip
        return model, drawn

    straight, turned = circle(0.0), circle(turn)
    for estimator in (EKF, UKF, sq.RauchTungStriebel(), sq.IteratedSmoother()):
        run, other = (sq.run(estimator, model, drawn.log) for model, drawn in (straight, turned))
        heading = np.angle(np.exp(1j * (run.mean[:, 2] + turn - other.mean[:, 2])))
        np.testing.assert_allclose(heading, 0.0, atol=1e-6)
        # the tangent is the body's own, so that covariances agree as they stand
        np.testing.assert_allclose(run.cov, other.cov, rtol=0, atol=1e-8)
        assert np.abs(run.mean[:, 2]).max() <= math.pi


@pytest.mark.parametrize("world", CURVED_WORLDS, ids=repr)
def test_small_spreads_give_the_extended_filter(world, rng):
    """With α → 0 the regression becomes the derivative."""
    log = world.draw(rng).log
    ekf, ukf = (
        sq.run(EKF, world.model, log),
        sq.run(sq.UnscentedKalmanFilter(alpha=0.01, beta=0.0), world.model, log),
    )
    scale = np.sqrt(np.diagonal(ekf.cov, axis1=1, axis2=2))
    apart = np.abs(ekf.manifold.local(ekf.mean, ukf.mean) / scale)
    assert np.median(apart) < 0.1


def test_a_part_without_uncertainty_stays_put(rng):
    """A singular prior: one direction is known perfectly."""
    model = sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([1.0, 2.0], np.diag([1.0, 1e-30])),
        sq.RandomWalk([0.1, 0.0]),
        {"sum": sq.LinearSensor([[1.0, 1.0]], 0.1)},
    )
    log = sq.SensorLog({"sum": sq.Stream(np.arange(5.0), rng.normal(3.0, 1.0, 5))})
    run = sq.run(UKF, model, log)
    np.testing.assert_allclose(run.mean[:, 1], 2.0, atol=1e-12)
    np.testing.assert_allclose(run.mean, sq.run(EKF, model, log).mean, atol=1e-9)
