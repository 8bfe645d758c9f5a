"""Every declared Jacobian meets central differences, and a wrong one is reported."""

import numpy as np
import pytest
from worlds import EVERY_WORLD

import sequential as sq
from sequential.errors import JacobianMismatchError
from sequential.jacobians import check_jacobians, difference, unchecked
from sequential.model import evaluate

every_world = pytest.mark.parametrize("world", EVERY_WORLD, ids=repr)


@every_world
def test_process_jacobian_along_a_drive(world, rng):
    model, drawn = world.model, world.draw(rng)
    f, manifold = model.process_functions, model.manifold
    for k in rng.choice(len(drawn.t) - 1, 5, replace=False):
        u = np.zeros(1) if world.inputs is None else world.inputs[k]
        for dt in (1e-3, 0.3):

            def step(x, u=u, dt=dt):
                return evaluate(f.value, x, u, dt, f.params, manifold.size)

            assert_matches(f, step, drawn.truth[k], u, dt, manifold, manifold)


@every_world
def test_sensor_jacobians_along_a_drive(world, rng):
    model, drawn = world.model, world.draw(rng)
    for name, sensor in model.sensors.items():
        f, stream = model.sensor_functions[name], drawn.log[name]
        for k in rng.choice(len(stream), 5, replace=False):
            u = np.zeros(1) if stream.context is None else stream.context[k]
            x = drawn.truth[np.searchsorted(drawn.t, stream.t[k])]

            def observe(x, f=f, u=u, sensor=sensor):
                return evaluate(f.value, x, u, 0.0, f.params, sensor.manifold.size)

            assert_matches(f, observe, x, u, 0.0, model.manifold, sensor.manifold)


def assert_matches(f, function, x, u, dt, domain, image):
    if f.jacobian is None:
        return
    declared = evaluate(f.jacobian, x, u, dt, f.params, image.dim * domain.dim)
    expected = difference(function, x, domain, image).ravel()
    np.testing.assert_allclose(declared, expected, rtol=0, atol=1e-6 * max(1.0, np.abs(expected).max()))


@every_world
def test_process_noise_is_a_covariance(world):
    model, d = world.model, world.model.manifold.dim
    f = model.process_functions
    u = np.zeros(1) if world.inputs is None else world.inputs[3]
    cov = evaluate(f.noise, model.prior.mean, u, 0.1, f.params, d * d).reshape(d, d)
    np.testing.assert_array_equal(cov, cov.T)
    assert np.linalg.eigvalsh(cov).min() > -1e-18


@every_world
def test_the_check_passes_from_other_seeds(world):
    for seed in range(1, 4):
        check_jacobians(world.model, dt=0.05, seed=seed)


def model_with(sensor, process=None):
    process = process or sq.RandomWalk(1.0)
    return sq.StateSpace(sq.Vector(2), sq.Gaussian([1.0, 2.0], 1.0), process, {"tip": sensor})


def squared(x):
    return np.array([x[0] ** 2 + x[1]])


def test_a_wrong_sensor_jacobian_is_named_with_its_worst_entry():
    wrong = sq.Sensor(squared, 1.0, jacobian=lambda x: np.array([[x[0], 1.0]]))
    with pytest.raises(
        JacobianMismatchError, match=r"sensors\['tip'\]\.observe .* row 0, column 0: declared 1, .* 2;"
    ):
        model_with(wrong)
    model_with(sq.Sensor(squared, 1.0, jacobian=lambda x: np.array([[2 * x[0], 1.0]])))


def test_a_wrong_process_jacobian_is_named():
    wrong = sq.Process(
        lambda x, dt: x * (1 + dt), noise_density=1.0, jacobian=lambda x, dt: np.eye(2) + 0 * x[0] * dt
    )
    with pytest.raises(JacobianMismatchError, match=r"Process\.step"):
        model_with(sq.Sensor(squared, 1.0), wrong)


def test_a_jacobian_of_nan_is_wrong():
    with pytest.raises(JacobianMismatchError, match="declared nan"):
        model_with(sq.Sensor(squared, 1.0, jacobian=lambda x: np.array([[2 * x[0], np.nan]])))


def test_the_check_can_be_suspended_for_a_while():
    wrong = sq.Sensor(squared, 1.0, jacobian=lambda x: np.array([[x[0], 1.0]]))
    with unchecked():
        model_with(wrong)
    with pytest.raises(JacobianMismatchError):
        model_with(wrong)


def test_difference_on_a_manifold():
    pose = sq.SE2()
    x = np.array([1.0, 2.0, 3.1])
    np.testing.assert_allclose(difference(lambda y: y, x, pose, pose), np.eye(3), atol=1e-9)
