"""Where double precision ends: readings nearly exact, nearly alike, or of one thing for ever."""

import math
from itertools import islice

import exact
import numpy as np
import pytest
from fuzz import fuzz, problems, random_problem
from worlds import times

import sequential as sq
from factorlab.graph.batch import BatchGraph
from sequential.errors import ModelError

FORMS = ("joseph", "ud", "sqrt", "information")
FACTORED = ("ud", "sqrt")
every_form = pytest.mark.parametrize("form", FORMS)
factored_form = pytest.mark.parametrize("form", FACTORED)


def still(prior, matrix, noise):
    """A static state, to be read once or often."""
    prior = np.asarray(prior)
    return sq.StateSpace(
        sq.Vector(len(prior)),
        sq.Gaussian(np.zeros(len(prior)), prior),
        sq.RandomWalk(0.0),
        {"z": sq.LinearSensor(matrix, noise)},
        start=0.0,
        check=False,
    )


def readings(z, dt=1.0):
    return sq.SensorLog({"z": sq.Stream(dt * np.arange(len(z)), z)})


def assert_covariances(run):
    """Symmetric to the last bit and positive semi-definite to rounding, at every node."""
    np.testing.assert_array_equal(run.cov, np.swapaxes(run.cov, 1, 2))
    variances = np.diagonal(run.cov, axis1=1, axis2=2)
    assert (variances >= 0.0).all()
    sigmas = np.sqrt(np.where(variances > 0.0, variances, 1.0))
    assert np.linalg.eigvalsh(run.cov / (sigmas[:, :, None] * sigmas[:, None, :])).min() > -1e-12


@pytest.mark.parametrize(
    ("form", "delta", "bound"),
    [
        ("joseph", 1e-6, 1e-9),
        ("joseph", 1e-8, 1e-8),
        ("joseph", 1e-9, 1e-9),
        ("joseph", 1e-12, 1e-12),
        ("ud", 1e-6, 1e-9),
        ("ud", 1e-8, 1e-8),
        ("ud", 1e-9, 1e-9),
        ("ud", 1e-12, 1e-12),
        ("sqrt", 1e-6, 1e-9),
        ("sqrt", 1e-8, 1e-8),
        ("sqrt", 1e-9, 1e-7),
        ("sqrt", 1e-12, 1e-4),
        ("information", 1e-6, 1e-9),
        ("information", 1e-8, 1e-8),
        ("information", 1e-9, 1e-9),
        ("information", 1e-12, 1e-12),
    ],
)
def test_two_readings_that_rounding_cannot_tell_apart(form, delta, bound):
    """Grewal and Andrews 2015, example 7.2, through a whole filter."""
    h, noise, z = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0 + delta]]), delta**2 * np.eye(2), [0.3, 0.3]
    run = sq.run(sq.KalmanFilter(form=form), still(np.eye(3), h, noise), readings([z]))
    cov, mean, nis, det = exact.update(np.eye(3), h, noise, np.array(z))
    assert np.abs(run.cov[0] - cov).max() <= bound
    # a residual is rounded before it is divided by δ
    assert np.abs(run.mean[0] - mean).max() <= bound + 1e-15 / delta
    log_likelihood = -0.5 * (nis + math.log(det) + 2.0 * math.log(2.0 * math.pi))
    assert run.log_likelihood == pytest.approx(log_likelihood, rel=bound + 1e-16 / delta)


@every_form
def test_a_nearly_perfect_sensor_for_fifty_thousand_steps(form, rng):
    count, dt = 50_000, 0.01
    model = sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 0.0], [1e8, 1e4]),
        sq.ConstantVelocity(1e-12),
        {"z": sq.LinearSensor([[1.0, 0.0]], 1e-10)},
        start=0.0,
    )
    z = 3.0 + 2.0 * dt * np.arange(count) + 1e-5 * rng.standard_normal(count)
    run = sq.run(sq.KalmanFilter(form=form), model, readings(z[:, None], dt))
    assert_covariances(run)
    # once it has settled, the filter is that of the steady state: det P does not sink below rounding
    spread = np.linalg.det(run.cov[-1]) / np.prod(np.diag(run.cov[-1]))
    assert 0.1 < spread < 1.0
    assert abs(run.mean[-1, 1] - 2.0) < 5.0 * math.sqrt(run.cov[-1, 1, 1])
    np.testing.assert_allclose(
        run.cov[-1], sq.run(sq.KalmanFilter(form="ud"), model, readings(z[:, None], dt)).cov[-1], rtol=1e-6
    )


@factored_form
def test_a_perfect_reading(form, rng):
    """R = 0 leaves H P Hᵀ = 0 and an estimate that repeats the reading, and nothing is raised."""
    root, h = rng.standard_normal((4, 4)), rng.standard_normal((2, 4))
    run = sq.run(sq.KalmanFilter(form=form), still(root @ root.T, h, 0.0), readings([[1.0, -2.0]]))
    assert_covariances(run)
    assert np.abs(h @ run.cov[0] @ h.T).max() < 1e-13 * np.trace(root @ root.T)
    np.testing.assert_allclose(h @ run.mean[0], [1.0, -2.0], atol=1e-12)


@factored_form
def test_positions_read_perfectly_beside_velocities_that_follow_them(form):
    """Six states of a tracker, each velocity known through its position but for a part in a million."""
    prior, h = np.zeros((6, 6)), np.zeros((3, 6))
    for axis, (spread, rest) in enumerate([(1.0e6, 6.4e5), (1.92e6, 1.1e5), (4.0e6, 1e-3)]):
        block = slice(2 * axis, 2 * axis + 2)
        prior[block, block] = [[spread + rest, spread], [spread, spread + 25.0]]
        h[axis, 2 * axis] = 1.0
    prior[0, 2] = prior[2, 0] = -2.5e5
    prior[0, 4] = prior[4, 0] = 1e-8
    run = sq.run(sq.KalmanFilter(form=form), still(prior, h, 0.0), readings([[1.0, 2.0, 3.0]]))
    truth = exact.update(prior, h, np.zeros((3, 3)), np.array([1.0, 2.0, 3.0]))[0]
    assert_covariances(run)
    np.testing.assert_allclose(run.cov[0], truth, atol=1e-13 * prior.max())
    np.testing.assert_array_equal(run.cov[0].diagonal()[1::2] > 0.0, True)


@every_form
def test_a_prior_of_next_to_nothing_known(form):
    """Variances of 1e24 beside a reading of 0.04: the direction that is read has the noise of the reading."""
    prior = np.array([[1e24, 1e-24], [1e-24, 1e24]])
    run = sq.run(sq.KalmanFilter(form=form), still(prior, [[1.0, 0.0]], 0.04), readings([[1.0]]))
    np.testing.assert_allclose(np.diag(run.cov[0]), [0.04, 1e24], rtol=1e-12)
    np.testing.assert_allclose(run.mean[0], [1.0, 0.0], atol=1e-12)


def one_landmark():
    """A unicycle that sees one landmark for ever: turning about it cannot be observed."""
    k = np.arange(5001)
    model = sq.StateSpace(
        manifold=sq.SE2(),
        prior=sq.Gaussian([1.0, -1.0, 0.5], sq.diagonal([0.3, 0.3, 0.1])),
        process=sq.Unicycle(0.02, 0.02, 0.02),
        sensors={"landmark": sq.RangeBearing(np.array([[4.0, 3.0]]), sq.diagonal([0.1, 0.02]))},
        input="odometry",
        start=0.0,
    )
    drive = np.column_stack([1.0 + 0.1 * np.sin(0.01 * k), 0.25 + 0.05 * np.cos(0.013 * k)])
    return model, times(5001, 0.1), drive


def test_symmetry_does_not_drift_where_a_direction_is_never_seen(rng):
    model, t, drive = one_landmark()
    drawn = sq.simulate(
        model, t, rng, inputs=drive, readings={"landmark": 1}, contexts={"landmark": np.zeros((5001, 1))}
    )
    problem = sq.prepare(model, drawn.log)
    reference = sq.ExtendedKalmanFilter().solve(problem)
    for form in FORMS:
        run = sq.ExtendedKalmanFilter(form=form).solve(problem)
        assert_covariances(run)
        np.testing.assert_allclose(run.manifold.local(reference.mean, run.mean), 0.0, atol=1e-7)
        np.testing.assert_allclose(run.cov, reference.cov, rtol=1e-7, atol=1e-12)


@pytest.mark.slow
def test_no_form_yields_on_random_models(request):
    """Sizes 1 to 12, condition numbers to 1e12, missing components."""
    tally = fuzz(10_000 if request.config.getoption("--full") else 1000)
    assert not tally.exceptions, tally
    assert not tally.not_finite, tally
    assert not tally.negative_variance, tally
    # Joseph's form may stop with a sentence, one model in forty
    assert tally.not_positive_definite["joseph"] < 0.05 * tally.models, tally
    for form in FACTORED:
        assert tally.indefinite[form] == 0, tally
        assert tally.not_positive_definite[form] == 0, tally


def test_variances_of_random_models_against_a_hundred_digits():
    """Bounds by quantiles: some of these models are beyond what their own floats determine."""
    small = (problem for _, problem in problems(seed=1) if problem.model.manifold.size <= 5)
    worst = {form: [] for form in FACTORED}
    for problem in islice(small, 60):
        truth = exact.variances(problem)
        for form, errors in worst.items():
            cov = sq.KalmanFilter(form=form).solve(problem).cov
            held = truth > 1e-290
            got = np.diagonal(cov, axis1=1, axis2=2)[held]
            errors.append(np.abs(got / truth[held] - 1.0).max())
    for form, errors in worst.items():
        median, most, largest = np.quantile(errors, [0.5, 0.9, 1.0])
        assert median < 1e-9, form
        assert most < 1e-5, form
        assert largest < 0.5, form


def test_perfect_readings_in_every_estimator():
    """What cannot weigh a reading without noise says so; the others repeat it."""
    model = sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 0.0], [1.0, 1.0]),
        sq.ConstantVelocity(0.1),
        {"z": sq.LinearSensor([[1.0, 0.0]], 0.0)},
        start=0.0,
    )
    problem = sq.prepare(model, readings(np.sin(0.1 * np.arange(20))[:, None], 0.1))
    reference = sq.KalmanFilter(form="ud").solve(problem)
    np.testing.assert_allclose(reference.mean[:, 0], np.sin(0.1 * np.arange(20)), atol=1e-14)
    np.testing.assert_allclose(reference.cov[:, 0], 0.0, atol=1e-18)
    for other in (
        sq.KalmanFilter(),
        sq.KalmanFilter(form="sqrt"),
        sq.IteratedExtendedKalmanFilter(form="ud"),
        sq.UnscentedKalmanFilter(),
    ):
        run = other.solve(problem)
        np.testing.assert_allclose(run.mean, reference.mean, atol=1e-9)
        np.testing.assert_allclose(run.cov, reference.cov, atol=1e-12)
        assert run.log_likelihood == pytest.approx(reference.log_likelihood)
    smoothed = sq.RauchTungStriebel(leave_one_out=False).solve(problem)
    np.testing.assert_allclose(smoothed.mean[:, 0], reference.mean[:, 0], atol=1e-12)
    for refusing in (
        sq.KalmanFilter(form="information"),
        sq.RauchTungStriebel(),
        sq.IteratedSmoother(),
        BatchGraph(),
    ):
        with pytest.raises(ModelError, match=r"sensor 'z' .*without noise.*; "):
            refusing.solve(problem)


def test_a_variance_that_a_move_made_negative_is_found_where_no_reading_follows():
    """One in a hundred thousand: nothing is read at that node, so no S could tell."""
    problem = random_problem(85418)
    for run in (sq.KalmanFilter().solve(problem), sq.ExtendedKalmanFilter().solve(problem)):
        assert np.diagonal(run.cov, axis1=1, axis2=2).min() >= 0.0
    assert "UD form" in sq.KalmanFilter().solve(problem).report.message
