"""One filter, four ways to round: every form gives what Joseph's gives, where double precision suffices."""

import numpy as np
import pytest
from worlds import EVERY_WORLD, LINEAR_WORLDS, without_jacobians

import sequential as sq
from sequential.errors import ModelError

OTHER_FORMS = ("ud", "sqrt", "information")
every_world = pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)
every_form = pytest.mark.parametrize("form", OTHER_FORMS)
iterable_form = pytest.mark.parametrize("form", ["ud", "sqrt"])


def assert_same_run(run, reference, tolerance=1e-9):
    """Estimates, covariances, innovations, verdicts and likelihood."""
    np.testing.assert_allclose(run.manifold.local(reference.mean, run.mean), 0.0, atol=tolerance)
    np.testing.assert_allclose(run.cov, reference.cov, rtol=tolerance, atol=tolerance)
    assert run.log_likelihood == pytest.approx(reference.log_likelihood, rel=tolerance, abs=10 * tolerance)
    for name, seen in run.innovations.items():
        other = reference.innovations[name]
        np.testing.assert_array_equal(seen.accepted, other.accepted)
        np.testing.assert_allclose(seen.residual, other.residual, atol=tolerance)
        np.testing.assert_allclose(seen.cov, other.cov, rtol=tolerance, atol=tolerance)


def assert_same_predictions(run, reference, tolerance=1e-9):
    np.testing.assert_allclose(
        run.manifold.local(reference.predicted.mean, run.predicted.mean), 0.0, atol=tolerance
    )
    np.testing.assert_allclose(run.predicted.cov, reference.predicted.cov, rtol=tolerance, atol=tolerance)
    np.testing.assert_allclose(run.predicted.transition, reference.predicted.transition, atol=tolerance)


@every_form
@every_world
def test_every_form_is_the_same_filter(world, form, rng):
    problem = world.problem(rng)
    run = sq.ExtendedKalmanFilter(keep=True, form=form).solve(problem)
    reference = sq.ExtendedKalmanFilter(keep=True).solve(problem)
    assert_same_run(run, reference)
    assert_same_predictions(run, reference)
    assert run.report.estimator == f"ekf_{form}"


@iterable_form
@every_world
def test_every_form_that_iterates_is_the_same_filter(world, form, rng):
    problem = world.problem(rng)
    run = sq.IteratedExtendedKalmanFilter(form=form).solve(problem)
    assert_same_run(run, sq.IteratedExtendedKalmanFilter().solve(problem))


@every_form
@pytest.mark.parametrize("world", LINEAR_WORLDS, ids=repr)
def test_the_kalman_filter_has_the_forms_too(world, form, rng):
    problem = world.problem(rng)
    run = sq.KalmanFilter(form=form).solve(problem)
    assert run.report.estimator == f"kf_{form}"
    assert_same_run(run, sq.KalmanFilter().solve(problem))


@every_form
def test_differenced_jacobians_serve_every_form(form, rng):
    world = EVERY_WORLD[2]
    problem = sq.prepare(without_jacobians(world.model), world.draw(rng).log)
    run = sq.ExtendedKalmanFilter(form=form).solve(problem)
    assert_same_run(run, sq.ExtendedKalmanFilter().solve(problem), tolerance=1e-7)


@every_form
@every_world
def test_smoothing_behind_every_form(world, form, rng):
    problem = world.problem(rng)
    run = sq.RauchTungStriebel(sq.ExtendedKalmanFilter(form=form)).solve(problem)
    reference = sq.RauchTungStriebel().solve(problem)
    assert run.report.estimator == f"ekf_{form}_rts"
    np.testing.assert_allclose(run.manifold.local(reference.mean, run.mean), 0.0, atol=1e-8)
    np.testing.assert_allclose(run.cov, reference.cov, rtol=1e-7, atol=1e-9)


@every_form
@pytest.mark.parametrize("loss", [None, sq.Loss("huber", 1.345), sq.Loss("cauchy", 1.0)], ids=str)
def test_gates_losses_and_missing_components(form, loss, rng):
    """A pair of correlated readings, outliers in it, and components that are NaN."""
    noise = [[0.2, 0.1], [0.1, 0.3]]
    sensor = sq.LinearSensor([[1.0, 0.0], [1.0, 1.0]], noise, gate=0.9999, loss=loss)
    model = sq.StateSpace(
        sq.Vector(2), sq.Gaussian([0.0, 0.0], 1.0), sq.RandomWalk(0.1), {"pair": sensor}, start=0.0
    )
    z = rng.standard_normal((60, 2))
    z[10] += 40.0
    z[20] += 3.0
    z[30, 0] = z[40, 1] = np.nan
    problem = sq.prepare(model, sq.SensorLog({"pair": sq.Stream(0.1 * np.arange(60), z)}))
    run = sq.KalmanFilter(form=form).solve(problem)
    assert run.report.rejected >= 1
    assert_same_run(run, sq.KalmanFilter().solve(problem))


@pytest.mark.parametrize(
    "estimator", [sq.KalmanFilter, sq.ExtendedKalmanFilter, sq.IteratedExtendedKalmanFilter]
)
def test_a_form_that_is_none(estimator):
    with pytest.raises(ModelError, match=r"no form 'cholesky'; the forms are 'joseph', 'ud', 'sqrt'"):
        estimator(form="cholesky")


def test_the_information_form_does_not_iterate():
    with pytest.raises(ModelError, match=r"information form cannot iterate .* use form='ud'"):
        sq.IteratedExtendedKalmanFilter(form="information")


def forget(x, dt):
    """Forget the first component altogether."""
    return np.array([0.0 * x[0], x[1]])


def test_the_information_form_needs_transitions_that_can_be_undone():
    model = sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([1.0, 1.0], 1.0),
        sq.Process(forget, noise_density=[0.1, 0.1], linear=True),
        {"z": sq.LinearSensor([[1.0, 1.0]], 0.1)},
        start=0.0,
    )
    log = sq.SensorLog({"z": sq.Stream([0.0, 1.0], [1.0, 1.0])})
    with pytest.raises(ModelError, match=r"cannot move to 1\.000000 s: .* use form='ud'"):
        sq.run(sq.KalmanFilter(form="information"), model, log)
    reference = sq.run(sq.KalmanFilter(), model, log)
    for form in ("ud", "sqrt"):
        assert_same_run(sq.run(sq.KalmanFilter(form=form), model, log), reference)


def test_a_process_without_noise_in_every_form(rng):
    """Q = 0 needs no inverse in any form, and a static state is learnt as by least squares."""
    rows, z = rng.standard_normal((30, 3)), rng.standard_normal(30)
    sensors = {f"s{k}": sq.LinearSensor(rows[k : k + 1], 0.5) for k in range(30)}
    model = sq.StateSpace(
        sq.Vector(3), sq.Gaussian(np.zeros(3), 4.0 * np.eye(3)), sq.RandomWalk(0.0), sensors, start=0.0
    )
    log = sq.SensorLog({f"s{k}": sq.Stream([0.1 * k], [z[k]]) for k in range(30)})
    information = np.eye(3) / 4.0 + rows.T @ rows / 0.5
    for form in ("joseph", *OTHER_FORMS):
        run = sq.run(sq.KalmanFilter(form=form), model, log)
        np.testing.assert_allclose(run.cov[-1], np.linalg.inv(information), rtol=1e-10, atol=1e-13)
        np.testing.assert_allclose(run.mean[-1], np.linalg.solve(information, rows.T @ z / 0.5), rtol=1e-10)
