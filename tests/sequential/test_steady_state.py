"""Where filters settle: published gains, long runs of the filter itself, and sentences where none settles."""

import numpy as np
import pytest
from linear_processes import CONTINUOUS, declare
from worlds import LINEAR_WORLDS

import sequential as sq
from sequential import discretise
from sequential.errors import ModelError, NonlinearModelError, ShapeError

CV = sq.ConstantVelocity(0.5)
POSITION = {"position": sq.LinearSensor([[1.0, 0.0]], 0.25)}


def test_the_figures_of_constant_velocity():
    """q = 0.5, dt = 0.1, r = 0.25."""
    settled = sq.steady_state(declare(CV, sq.Vector(2), POSITION), 0.1)
    upper = settled.predicted_cov[np.triu_indices(2)]
    np.testing.assert_allclose(upper, [0.0871508527, 0.1298365997, 0.3606174331], atol=5e-11)
    np.testing.assert_allclose(settled.gain.ravel(), [0.2584921615, 0.3850994257], atol=5e-11)
    assert 5 < settled.settles < 10


def test_the_nile_settles_where_the_closed_form_says():
    """A local level: P = (q + √(q² + 4 q r)) / 2."""
    q, r = 1469.1, 15099.0
    model = declare(sq.LinearProcess([[1.0]], q), sq.Vector(1), {"z": sq.LinearSensor([[1.0]], r)})
    expected = (q + np.sqrt(q * q + 4 * q * r)) / 2
    assert expected == pytest.approx(5501.25794, abs=5e-6)
    assert sq.steady_state(model, 1.0).predicted_cov[0, 0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("index", [1e-3, 0.1, 1.0, 30.0])
def test_kalatas_gains_are_those_of_the_equation(index):
    """One acceleration per step: α and β/T from the tracking index alone, whatever T and σ_v."""
    step, noise = 0.7, 3.0
    f, q = discretise.piecewise_white_acceleration(step, index * noise / step**2)
    model = declare(sq.LinearProcess(f, q), sq.Vector(2), {"z": sq.LinearSensor([[1.0, 0.0]], noise**2)})
    alpha, beta = sq.alpha_beta(index)
    np.testing.assert_allclose(sq.steady_state(model, step).gain.ravel(), [alpha, beta / step], rtol=1e-9)


def test_a_tracking_index_of_a_tenth():
    np.testing.assert_allclose(sq.alpha_beta(0.1), (0.36, 0.08), rtol=1e-13)
    with pytest.raises(ModelError, match="a tracking index is positive, got 0"):
        sq.alpha_beta(0.0)


@pytest.mark.parametrize("name", [name for name in CONTINUOUS if name not in {"spring", "parts"}])
def test_a_long_run_ends_there(name, rng):
    """Every linear process: the last covariances and the last gain of a filter that had time."""
    process, manifold = CONTINUOUS[name]
    n, dt = manifold.size, 0.5
    model = declare(process, manifold, {"some": sq.LinearSensor(rng.standard_normal((2, n)), [0.3, 0.2])})
    settled = sq.steady_state(model, dt)
    t = np.arange(1500) * dt
    run = sq.run(sq.KalmanFilter(keep=True), model, sq.SensorLog({"some": sq.Stream(t, np.zeros((1500, 2)))}))
    scale = np.abs(settled.predicted_cov).max()
    np.testing.assert_allclose(run.predicted.cov[-1], settled.predicted_cov, rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(run.cov[-1], settled.cov, rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(run.innovations["some"].cov[-1], settled.innovation_cov, rtol=1e-8)


@pytest.mark.parametrize("world", LINEAR_WORLDS, ids=repr)
def test_several_sensors_at_once(world):
    settled = sq.steady_state(world.model, 0.3)
    F, Q, H = settled.transition, settled.process_cov, settled.matrix
    np.testing.assert_allclose(F @ settled.cov @ F.T + Q, settled.predicted_cov, rtol=0, atol=1e-12)
    information = np.linalg.inv(settled.predicted_cov)
    at = 0
    for sensor in world.model.sensors.values():
        h = H[at : at + sensor.manifold.dim]
        np.testing.assert_array_equal(h, sensor.matrix)
        information += h.T @ np.linalg.solve(sensor.noise_cov, h)
        at += len(h)
    np.testing.assert_allclose(np.linalg.inv(information), settled.cov, rtol=1e-10)


def test_units_do_not_matter():
    """Metres or micrometres, seconds the same."""
    settled = sq.steady_state(declare(CV, sq.Vector(2), POSITION), 0.1)
    small = sq.ConstantVelocity(0.5e12)
    sensors = {"position": sq.LinearSensor([[1.0, 0.0]], 0.25e12)}
    fine = sq.steady_state(declare(small, sq.Vector(2), sensors, 1e12 * np.eye(2)), 0.1)
    np.testing.assert_allclose(fine.predicted_cov, 1e12 * settled.predicted_cov, rtol=1e-10)
    np.testing.assert_allclose(fine.gain, settled.gain, rtol=1e-10)


def test_noise_that_moves_both_state_and_reading():
    """Cross covariance S: the equation itself, and a Monte Carlo of its predictor."""
    model = declare(sq.LinearProcess([[0.9, 0.2], [0.0, 0.8]], np.diag([0.3, 0.2])), sq.Vector(2), POSITION)
    S = np.array([[0.15], [0.1]])
    settled = sq.steady_state(model, 1.0, cross_cov=S)
    F, Q, H, P = settled.transition, settled.process_cov, settled.matrix, settled.predicted_cov
    gain = settled.predictor_gain(S)
    np.testing.assert_allclose(F @ P @ F.T + Q - gain @ settled.innovation_cov @ gain.T, P, atol=1e-12)
    assert np.trace(P) < np.trace(sq.steady_state(model, 1.0).predicted_cov)
    rng = np.random.default_rng(3)
    joint = np.block([[Q, S], [S.T, np.array([[0.25]])]])
    noise = rng.multivariate_normal(np.zeros(3), joint, size=(60, 4000))
    error = np.zeros((4000, 2))
    for w in noise:  # e' = (F - K H) e + w - K v
        error = error @ (F - gain @ H).T + w[:, :2] - w[:, 2:] @ gain.T
    np.testing.assert_allclose(error.T @ error / 4000, P, atol=0.05)


def test_a_cross_covariance_has_a_shape():
    with pytest.raises(ShapeError, match=r"cross_cov must have shape \(2, 1\), got \(1, 2\)"):
        sq.steady_state(declare(CV, sq.Vector(2), POSITION), 0.1, cross_cov=[[0.1, 0.2]])


def table_model():
    table = sq.LinearProcess(np.stack([np.eye(2)] * 3), np.eye(2))
    return sq.StateSpace(
        sq.Vector(2), sq.Gaussian([0.0, 0.0], [1.0, 1.0]), table, POSITION, input="row", start=0.0
    )


UNSETTLED = {
    "velocity alone is seen": (
        lambda: declare(CV, sq.Vector(2), {"v": sq.LinearSensor([[0.0, 1.0]], 0.1)}),
        r"no sensor ever sees x0, which does not decay",
    ),
    "the difference of two walks": (
        lambda: declare(sq.RandomWalk(1.0), sq.Vector(2), {"sum": sq.LinearSensor([[1.0, 1.0]], 0.1)}),
        r"no sensor ever sees 0\.71 x0 - 0\.71 x1 \(in standard deviations",
    ),
    "a position three integrals up": (
        lambda: declare(sq.ConstantAcceleration(1.0), sq.Vector(3), {"a": sq.LinearSensor([[0.0, 0, 1]], 1)}),
        r"no sensor ever sees x[01], which does not decay",
    ),
    "a constant": (
        lambda: declare(
            sq.Independent(p=CV, bias=sq.RandomWalk(0.0)),
            sq.Product(p=sq.Vector(2), bias=sq.Vector(1)),
            {"a": sq.LinearSensor([[1, 0, 0]], 0.1), "b": sq.LinearSensor([[1, 0, 1]], 0.1)},
        ),
        r"no process noise ever disturbs bias\.x0, so it is learnt for ever",
    ),
    "a table": (table_model, "is a table of steps, so there is no steady state"),
    "no sensors": (lambda: declare(CV, sq.Vector(2), {}), "a model without sensors has no steady state"),
}


@pytest.mark.parametrize("case", UNSETTLED)
def test_what_does_not_settle_is_named(case):
    make, message = UNSETTLED[case]
    with pytest.raises(ModelError, match=message):
        sq.steady_state(make(), 0.1)


def test_what_decays_may_be_hidden():
    """An unseen Gauss-Markov bias keeps its stationary variance."""
    state = sq.Product(p=sq.Vector(2), bias=sq.Vector(1))
    process = sq.Independent(p=CV, bias=sq.GaussMarkov(5.0, 0.4))
    settled = sq.steady_state(declare(process, state, {"a": sq.LinearSensor([[1, 0, 0]], 0.1)}), 0.1)
    assert settled.cov[2, 2] == pytest.approx(0.16, rel=1e-10)


def test_a_nonlinear_model_is_refused():
    model = sq.StateSpace(
        sq.SE2(), sq.Gaussian([0.0, 0, 0], np.eye(3)), sq.Unicycle(1, 1, 1),
        {"gps": sq.Position(0.1, axes=2)}, "odometry",
    )  # fmt: skip
    with pytest.raises(NonlinearModelError, match="the state lives on SE2"):
        sq.steady_state(model, 0.1)
    with pytest.raises(ModelError, match=r"dt is 0\.0; a step takes a positive number of seconds"):
        sq.steady_state(declare(CV, sq.Vector(2), POSITION), 0.0)
