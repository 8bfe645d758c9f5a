"""Every set of sigma points: moments, angles, linear models to rounding, ill-conditioned readings."""

import math

import exact
import numpy as np
import pytest
from laws import EVERY_MANIFOLD
from switching import coasting, draw
from worlds import CURVED_WORLDS, constant_velocity, random_walk

import sequential as sq
from sequential.errors import ModelError, ShapeError
from sequential.filters.sigma_sets import SETS, SigmaSet

UKF, CKF = sq.UnscentedKalmanFilter, sq.CubatureKalmanFilter
FILTERS = [
    UKF(),
    UKF(0.1, 2.0, 1.0),
    UKF(points="julier", kappa=1.0),
    UKF(points="julier", kappa=-0.5),
    UKF(points="simplex"),
    CKF(),
]
every_filter = pytest.mark.parametrize("estimator", FILTERS, ids=str)
every_set = pytest.mark.parametrize("points", SETS)


@every_set
@pytest.mark.parametrize("dim", [1, 2, 3, 6, 15])
def test_two_moments_of_a_unit_covariance(points, dim):
    drawn, weights, others = sq.sigma_points(np.zeros(dim), np.eye(dim), points=points)
    assert len(drawn) == {"simplex": dim + 1, "cubature": 2 * dim}.get(points, 2 * dim + 1)
    np.testing.assert_allclose(weights.sum(), 1.0, atol=1e-14)
    np.testing.assert_allclose(weights @ drawn, 0.0, atol=1e-14)
    np.testing.assert_allclose((others[:, None] * drawn).T @ drawn, np.eye(dim), atol=1e-13)
    if points != "simplex":  # third moments vanish with symmetry
        np.testing.assert_allclose(
            np.einsum("s,sa,sb,sc->abc", weights, drawn, drawn, drawn), 0.0, atol=1e-13
        )


@every_set
@pytest.mark.parametrize("manifold", EVERY_MANIFOLD, ids=repr)
def test_two_moments_on_every_manifold(points, manifold, rng):
    d = manifold.dim
    half = 0.05 * rng.standard_normal((d, d))
    mean, cov = manifold.random(rng), half @ half.T
    drawn, weights, others = sq.sigma_points(mean, cov, 1.0, points=points, manifold=manifold)
    tangents = manifold.local(mean, drawn)
    np.testing.assert_allclose(weights @ tangents, 0.0, atol=1e-12)
    np.testing.assert_allclose((others[:, None] * tangents).T @ tangents, cov, atol=1e-12)


def test_the_textbook_numbers():
    """x = 0, P = diag(1, 4), κ = 1: points at √3 standard deviations, weights 1/3 and 1/6."""
    drawn, weights, others = sq.sigma_points([0.0, 0.0], [1.0, 4.0], kappa=1.0)
    r = math.sqrt(3.0)
    np.testing.assert_allclose(drawn, [[0, 0], [r, 0], [0, 2 * r], [-r, 0], [0, -2 * r]], atol=1e-15)
    np.testing.assert_allclose(weights, [1 / 3, 1 / 6, 1 / 6, 1 / 6, 1 / 6])
    np.testing.assert_allclose(weights, others, rtol=1e-14)
    singular = sq.sigma_points([1.0, 2.0], [[1.0, 1.0], [1.0, 1.0]], points="cubature")
    np.testing.assert_allclose(
        singular.points - [1.0, 2.0], [[math.sqrt(2)] * 2, [0, 0], [-math.sqrt(2)] * 2, [0, 0]]
    )


def test_a_cubature_filter_is_an_unscented_one_without_settings(rng):
    for world in CURVED_WORLDS:
        log = world.draw(rng).log
        ckf, ukf = sq.run(CKF(), world.model, log), sq.run(UKF(1.0, 0.0, 0.0), world.model, log)
        np.testing.assert_allclose(ckf.mean, ukf.mean, rtol=0, atol=1e-12)
        np.testing.assert_allclose(ckf.cov, ukf.cov, rtol=0, atol=1e-12)


@every_filter
@pytest.mark.parametrize("world", [constant_velocity(), random_walk()], ids=repr)
def test_linear_models_to_rounding(estimator, world, rng):
    """UKF = CKF = KF: moments, innovations and likelihood, filtered and smoothed."""
    problem = world.problem(rng)
    # points at a tenth of σ lose one digit of a slope and two of the weights
    tolerance = 1e-12 if getattr(estimator, "alpha", 1.0) == 1.0 else 1e-10
    for mine, plain in (
        (estimator, sq.KalmanFilter()),
        (sq.RauchTungStriebel(estimator), sq.RauchTungStriebel(sq.KalmanFilter())),
    ):
        run, kalman = mine.solve(problem), plain.solve(problem)
        scale = max(1.0, np.abs(kalman.mean).max())
        np.testing.assert_allclose(run.mean, kalman.mean, rtol=0, atol=tolerance * scale)
        np.testing.assert_allclose(run.cov, kalman.cov, rtol=0, atol=tolerance)
        assert run.log_likelihood == pytest.approx(kalman.log_likelihood, rel=tolerance)
        for name, seen in kalman.innovations.items():
            assert np.abs(run.innovations[name].residual - seen.residual).max() < 10 * tolerance * scale
            assert np.abs(run.innovations[name].cov - seen.cov).max() < 10 * tolerance


@every_filter
def test_gates_losses_and_missing_components(estimator, rng):
    """On a linear model all of them act as in the extended filter."""
    log, _, _ = draw((coasting(0.3),), np.eye(1), 60, 0.5, rng)
    z = log["position"].values.copy()
    z[10:20, 0] = np.nan
    z[12] = np.nan
    z[30] += 20.0
    spoilt = log.replaced(position=sq.Stream(log["position"].t, z))
    for settings in ({"gate": 0.999}, {"loss": sq.Loss("huber", 1.345)}, {"loss": sq.Loss("cauchy", 1.0)}):
        model = coasting(0.3, **settings)
        run, ekf = sq.run(estimator, model, spoilt), sq.run(sq.ExtendedKalmanFilter(), model, spoilt)
        np.testing.assert_allclose(run.mean, ekf.mean, atol=1e-9)
        np.testing.assert_allclose(run.cov, ekf.cov, atol=1e-9)
        assert run.log_likelihood == pytest.approx(ekf.log_likelihood, rel=1e-9)
        assert run.report.rejected == ekf.report.rejected
        assert run.report.missing == 1


@every_filter
@pytest.mark.parametrize("delta", [1e-6, 1e-7, 1e-8, 1e-9])
def test_two_readings_that_differ_by_rounding(estimator, delta):
    """Bierman's example: S is singular in double precision, and the update is made in UD form."""
    h, noise = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0 + delta]]), delta**2 * np.eye(2)
    model = sq.StateSpace(
        sq.Vector(3),
        sq.Gaussian(np.zeros(3), np.eye(3)),
        sq.RandomWalk(0.0),
        {"z": sq.LinearSensor(h, noise)},
    )
    run = sq.run(estimator, model, sq.SensorLog({"z": sq.Stream([0.0], [[1.0, 1.0 + 0.5 * delta]])}))
    cov, _, _, _ = exact.update(np.eye(3), h, noise, [1.0, 1.0 + 0.5 * delta])
    # a slope is a difference of rounded readings: 1e-16 / δ of H's second row is lost before any algebra
    slack = 20.0 if getattr(estimator, "alpha", 1.0) == 1.0 else 2000.0
    np.testing.assert_allclose(run.cov[0], cov, rtol=0, atol=slack * 1e-16 / delta + 1e-9)


@every_filter
def test_what_is_known_perfectly(estimator, rng):
    """A singular prior without process noise, read again and again almost without noise."""
    model = sq.StateSpace(
        sq.Vector(3), sq.Gaussian([1.0, 2.0, 3.0], np.diag([1.0, 1e-30, 1e-8])),
        sq.RandomWalk([0.1, 0.0, 0.0]), {"sum": sq.LinearSensor([[1.0, 1.0, 1.0]], 1e-14)},
    )  # fmt: skip
    log = sq.SensorLog({"sum": sq.Stream(np.arange(50.0), rng.normal(6.0, 1.0, 50))})
    run, ekf = sq.run(estimator, model, log), sq.run(sq.ExtendedKalmanFilter(), model, log)
    np.testing.assert_allclose(run.mean, ekf.mean, atol=1e-6)
    assert np.diagonal(run.cov, axis1=1, axis2=2).min() >= 0.0
    np.testing.assert_allclose(run.mean[:, 1], 2.0, atol=1e-12)


@every_filter
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_a_covariance_that_becomes_singular(estimator, noise, rng):
    """A step that forgets a component without bringing noise to it."""
    forget = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 1.0]])
    process = sq.LinearProcess(forget, np.diag([noise, 0.0, 0.0]))
    sensor = sq.LinearSensor([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0]], [1e-4, 0.1])
    prior = sq.Gaussian(np.zeros(3), np.eye(3))
    model = sq.StateSpace(sq.Vector(3), prior, process, {"z": sensor}, start=0.0)
    log = sq.simulate(model, np.arange(30.0), rng).log
    run, kalman = sq.run(estimator, model, log), sq.run(sq.KalmanFilter(form="ud"), model, log)
    np.testing.assert_allclose(run.mean, kalman.mean, atol=1e-8)
    np.testing.assert_allclose(run.cov, kalman.cov, atol=1e-10)
    assert run.log_likelihood == pytest.approx(kalman.log_likelihood, rel=1e-7)


@pytest.mark.parametrize("alpha", [1.0, 0.1, 1e-3])
@pytest.mark.parametrize("spread", [0.3, 0.5])
def test_a_bearing_is_averaged_about_the_central_point(alpha, spread):
    """Bearings on both sides of π; an average of sines and cosines fails where a weight is negative."""
    sensor = sq.Sensor(bearing, [1e-4], manifold=sq.SO2())
    model = sq.StateSpace(
        sq.Vector(2), sq.Gaussian([-2.0, 0.0], sq.diagonal([1e-3, spread])), sq.RandomWalk(0.0), {"b": sensor}
    )
    for z in (math.pi - 0.05, -math.pi + 0.05):
        log = sq.SensorLog({"b": sq.Stream([0.0], [z])})
        seen = sq.run(UKF(alpha), model, log).innovations["b"]
        assert seen.residual[0, 0] == pytest.approx(math.remainder(z - math.pi, 2 * math.pi), abs=1e-3)
        assert math.sqrt(seen.cov[0, 0, 0]) == pytest.approx(spread / 2.0, rel=0.15)


def bearing(x):
    return np.array([math.atan2(x[1], x[0])])


@pytest.mark.parametrize(
    "estimator", [UKF(points="julier", kappa=1.0), UKF(points="simplex"), CKF()], ids=str
)
@pytest.mark.parametrize("world", CURVED_WORLDS, ids=repr)
def test_curved_worlds_forwards_and_backwards(estimator, world, rng):
    """Close to the extended filter and smoother, covariances definite, smoothers narrower."""
    log = world.draw(rng).log
    run, ekf = sq.run(estimator, world.model, log), sq.run(sq.ExtendedKalmanFilter(), world.model, log)
    smooth = sq.run(sq.RauchTungStriebel(estimator), world.model, log)
    other = sq.run(sq.RauchTungStriebel(), world.model, log)
    for mine, theirs in ((run, ekf), (smooth, other)):
        apart = np.abs(mine.manifold.local(theirs.mean, mine.mean)) / theirs.sigmas()
        assert np.median(apart) < (0.4 if "simplex" in estimator.name else 0.2)  # which is not symmetric
        np.testing.assert_array_equal(mine.cov, np.swapaxes(mine.cov, 1, 2))
        scaled = mine.cov / (mine.sigmas()[:, :, None] * mine.sigmas()[:, None, :])
        assert np.linalg.eigvalsh(scaled).min() > 0.0
    assert np.median(smooth.sigmas() / run.sigmas()) < 1.0
    assert smooth.report.estimator == f"{estimator.name}_rts"


def test_what_does_not_fit_is_refused():
    with pytest.raises(ModelError, match="no sigma points 'gauss'"):
        UKF(points="gauss")
    with pytest.raises(ModelError, match=r"CubatureKalmanFilter\(\)"):
        UKF(points="cubature")
    with pytest.raises(ModelError, match="do not spread over 2 directions"):
        sq.sigma_points([0.0, 0.0], 1.0, kappa=-2.0)
    with pytest.raises(ShapeError, match=r"has shape \(7,\)"):
        sq.sigma_points([0.0, 0.0], 1.0, manifold=sq.SE3())
    assert [UKF().name, UKF(points="simplex").name, CKF().name] == ["ukf", "ukf_simplex", "ckf"]
    assert SigmaSet("simplex").unit(2).shape == (3, 2)
