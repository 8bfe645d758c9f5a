"""A function that Numba refuses gives the same numbers, slower, and its errors arrive."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from worlds import EVERY_WORLD, pendulum_step, pendulum_tip

import sequential as sq

PENDULUM = next(world for world in EVERY_WORLD if "pendulum" in world.name)
CONSTANTS = {"gravity over length": SimpleNamespace(value=4.0), "damping": SimpleNamespace(value=0.1)}

every_estimator = pytest.mark.parametrize(
    "estimator",
    [
        sq.ExtendedKalmanFilter(),
        sq.IteratedExtendedKalmanFilter(),
        sq.UnscentedKalmanFilter(),
        sq.RauchTungStriebel(),
        sq.IteratedSmoother(tolerance=1e-9),
    ],
    ids=lambda e: e.name,
)


def stubborn_step(x, dt):
    """The pendulum's step with its constants in a dictionary of objects, which Numba does not know."""
    stiff, damping = CONSTANTS["gravity over length"].value, CONSTANTS["damping"].value
    angle = x[0] + 0.5 * dt * x[1]
    rate = x[1] + 0.5 * dt * (-stiff * math.sin(x[0]) - damping * x[1])
    return [x[0] + dt * rate, x[1] + dt * (-stiff * math.sin(angle) - damping * rate)]


def stubborn_tip(x):
    return CONSTANTS and [math.sin(x[0]), 1.0 - math.cos(x[0])]


def pendulum_with(step, tip, noise_density=(1e-4, 0.01)):
    return sq.StateSpace(
        manifold=sq.Vector(2),
        prior=PENDULUM.model.prior,
        process=sq.Process(step, noise_density=noise_density),
        sensors={"tip": sq.Sensor(tip, [0.01, 0.01])},
        start=0.0,
    )


@every_estimator
@pytest.mark.parametrize("step", [pendulum_step, stubborn_step], ids=["compiled step", "interpreted step"])
@pytest.mark.parametrize("tip", [pendulum_tip, stubborn_tip], ids=["compiled tip", "interpreted tip"])
def test_interpreted_equals_compiled(estimator, step, tip, rng):
    log = PENDULUM.draw(rng).log
    compiled = sq.run(estimator, PENDULUM.model, log)
    run = sq.run(estimator, pendulum_with(step, tip), log)
    np.testing.assert_allclose(run.mean, compiled.mean, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.cov, compiled.cov, rtol=0, atol=1e-9)
    message = run.report.message
    assert ("process step" in message) == (step is stubborn_step)
    assert ("sensor 'tip'" in message) == (tip is stubborn_tip)
    assert ("could not be compiled" in message) == (step is stubborn_step or tip is stubborn_tip)


def test_an_interpreted_noise_is_added(rng):
    log = PENDULUM.draw(rng).log
    density = np.diag([1e-4, 0.01])

    def noise(x, dt):
        return CONSTANTS and density * dt

    process = sq.Process(pendulum_step, noise_cov=noise)
    model = sq.StateSpace(sq.Vector(2), PENDULUM.model.prior, process, PENDULUM.model.sensors, start=0.0)
    compiled, run = (sq.run(sq.ExtendedKalmanFilter(), m, log) for m in (PENDULUM.model, model))
    np.testing.assert_allclose(run.cov, compiled.cov, rtol=0, atol=1e-12)


@every_estimator
def test_an_error_in_a_function_arrives(estimator, rng):
    def broken(x):
        if CONSTANTS and x[0] < 0.0:
            raise ZeroDivisionError("the pendulum swung through")
        return [math.sin(x[0]), 1.0 - math.cos(x[0])]

    log = PENDULUM.draw(rng).log
    with pytest.raises(ZeroDivisionError, match="swung through"):
        sq.run(estimator, pendulum_with(pendulum_step, broken), log)


def test_after_an_error_the_model_works_again(rng):
    mood = {"bad": False}

    def moody(x):
        if mood["bad"]:
            raise ValueError("not today")
        return [math.sin(x[0]), 1.0 - math.cos(x[0])]

    log, model = PENDULUM.draw(rng).log, pendulum_with(pendulum_step, moody)
    good = sq.run(sq.ExtendedKalmanFilter(), model, log)
    mood["bad"] = True
    with pytest.raises(ValueError, match="not today"):
        sq.run(sq.ExtendedKalmanFilter(), model, log)
    mood["bad"] = False
    np.testing.assert_array_equal(sq.run(sq.ExtendedKalmanFilter(), model, log).mean, good.mean)


@pytest.mark.parametrize(
    "tip",
    [
        lambda x: [math.sin(x[0]), 1.0 - math.cos(x[0])],
        lambda x: (math.sin(x[0]), 1.0 - math.cos(x[0])),
        lambda x: np.array([[math.sin(x[0]), 1.0 - math.cos(x[0])]]),
        lambda x: np.array([np.sin(x[0]), 1.0 - np.cos(x[0])]),
    ],
    ids=["list", "tuple", "row", "numpy functions"],
)
def test_a_reading_may_come_in_any_container(tip, rng):
    log = PENDULUM.draw(rng).log
    run = sq.run(sq.ExtendedKalmanFilter(), pendulum_with(pendulum_step, tip), log)
    assert run.report.message == ""
    np.testing.assert_allclose(
        run.mean, sq.run(sq.ExtendedKalmanFilter(), PENDULUM.model, log).mean, atol=1e-12
    )


def test_a_function_may_write_into_its_argument(rng):
    def rude(x, dt):
        x[1] += 0.0 * dt
        x[0] = 99.0
        return np.array([0.5, 0.1])

    model = pendulum_with(rude, pendulum_tip)
    log = PENDULUM.draw(rng).log
    run = sq.run(sq.ExtendedKalmanFilter(keep=True), model, log)
    np.testing.assert_allclose(run.predicted.mean[1:], np.broadcast_to([0.5, 0.1], (len(run) - 1, 2)))
