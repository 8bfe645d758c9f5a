"""Declarations at the door: every misfit is a sentence before anything runs."""

import numpy as np
import pytest

import sequential as sq
from sequential.errors import (
    JacobianMismatchError,
    ModelError,
    NonlinearModelError,
    NotFiniteError,
    ShapeError,
)

PRIOR = sq.Gaussian([0.0, 1.0], [1.0, 1.0])
H = [[1.0, 0.0]]


def declare(manifold=None, prior=PRIOR, process=None, sensors=None, **more):
    return sq.StateSpace(
        sq.Vector(2) if manifold is None else manifold,
        prior,
        sq.ConstantVelocity(0.1) if process is None else process,
        {"position": sq.LinearSensor(H, 0.25)} if sensors is None else sensors,
        **more,
    )


def coast(x, dt):
    return np.array([x[0] + dt * x[1], x[1]])


def turn(x, u, dt):
    return np.array([x[0] + dt * x[1], x[1] + dt * u[0]])


MISFITS = {
    "prior of another size": (
        lambda: declare(sq.Vector(3)),
        ShapeError,
        r"stores 3 numbers with 3 tangent directions; the prior has a mean of shape \(2,\)",
    ),
    "mean and covariance": (
        lambda: declare(prior=sq.Gaussian([0.0, 1.0], np.eye(3))),
        ShapeError,
        r"mean of shape \(2,\) and a covariance of shape \(3, 3\)",
    ),
    "NaN in the prior": (
        lambda: sq.Gaussian([np.nan], [1.0]),
        NotFiniteError,
        "the mean of a Gaussian holds NaN or infinity",
    ),
    "a matrix for a mean": (
        lambda: sq.Gaussian([[0.0]], [1.0]),
        ShapeError,
        r"a mean has shape \(n,\), got \(1, 1\)",
    ),
    "no unit quaternion": (
        lambda: declare(sq.SO3(), sq.Gaussian([1.0, 1.0, 0.0, 0.0], np.eye(3)), sq.RandomWalk(1.0), {}),
        sq.FactorlabError,
        r"unit quaternion .* got norm 1\.414.*normalize\(\)",
    ),
    "process and manifold": (
        lambda: declare(process=sq.ConstantVelocity(0.1, axes=2)),
        ModelError,
        r"ConstantVelocity\(axes=2\) needs Vector\(4\); the state is Vector",
    ),
    "inertial process elsewhere": (
        lambda: declare(process=sq.Strapdown(sq.ImuNoise(1, 1, 1, 1)), input="imu"),
        ModelError,
        r"Strapdown needs a state that begins as inertial_state\(\) does",
    ),
    "sensor and manifold": (
        lambda: declare(sensors={"p": sq.LinearSensor([[1.0, 0.0, 0.0]], 1.0)}),
        ModelError,
        "LinearSensor's matrix has 3 columns, the state is",
    ),
    "a part that is not there": (
        lambda: declare(
            sq.Product(a=sq.Vector(2)),
            sensors={"p": sq.Range([[0.0, 0.0]], 1.0, pose="body")},
            process=sq.RandomWalk(1.0),
        ),
        ModelError,
        "Range needs a part 'body' that is a SE2 or Vector",
    ),
    "input without a stream": (
        lambda: declare(process=sq.Process(step=turn, noise_density=[1.0, 1.0], inputs=1)),
        ModelError,
        "Process is driven by an input; name its stream with input=",
    ),
    "static part": (
        lambda: declare(static=("map",)),
        ModelError,
        r"static parts \['map'\] are not parts of the state; it has none",
    ),
    "two noises": (
        lambda: declare(process=sq.Process(step=turn, inputs=1)),
        ModelError,
        "a Process needs either noise_density=… .* or noise_cov=…",
    ),
    "too many arguments": (
        lambda: declare(process=sq.Process(step=lambda a, b, c, d: a + b + c + d, noise_density=1.0)),
        ModelError,
        r"<lambda>\(\) takes 4 arguments; write it as f\(x, u, dt\) or f\(x, dt\)",
    ),
    "a step of another length": (
        lambda: declare(process=sq.Process(step=lambda x, dt: dt * x[:1], noise_density=1.0)),
        ShapeError,
        r"<lambda>\(\) returned 1 numbers where 2 were expected",
    ),
    "a wrong Jacobian": (
        lambda: declare(
            sensors={"p": sq.Sensor(lambda x: [x[0] ** 2], 1.0, jacobian=lambda x: [[3.0 * x[0], 0.5]])}
        ),
        JacobianMismatchError,
        r"sensors\['p'\]\.observe disagrees .* at row 0, column 1.*declared 0\.5.* leave it out",
    ),
    "a loss of no kind": (
        lambda: sq.Loss("l1", 1.0),
        ModelError,
        r"Loss\('huber' \| 'cauchy', k > 0\), got Loss\('l1'",
    ),
    "a negative density": (
        lambda: declare(process=sq.ConstantVelocity(-1.0)),
        ModelError,
        r"acceleration_density is -1\.0; it must be zero or more",
    ),
}


@pytest.mark.parametrize("misfit", MISFITS)
def test_a_misfit_is_a_sentence(misfit):
    make, error, message = MISFITS[misfit]
    with pytest.raises(error, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


LOG = sq.SensorLog({"position": sq.Stream([0.0, 1.0, 2.0], [0.1, 0.9, 2.2])})


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (
            declare(process=sq.Process(step=coast, noise_density=0.1)),
            r"KalmanFilter takes linear models only: Process is not declared linear; use Extended",
        ),
        (
            declare(sensors={"position": sq.Sensor(lambda x: [x[0] ** 3], 1.0)}),
            "linear models only: sensor 'position' is not declared linear; use Extended",
        ),
        (
            declare(sq.SO2(), sq.Gaussian([0.0], [1.0]), sq.RandomWalk(1.0), {}),
            "linear models only: the state lives on SO2",
        ),
    ],
)
def test_a_kalman_filter_says_what_is_not_linear(model, message):
    with pytest.raises(NonlinearModelError, match=message):
        sq.run(sq.KalmanFilter(), model, LOG)


def test_a_gate_is_a_probability():
    model = declare(sensors={"position": sq.LinearSensor(H, 0.25, gate=9.0)})
    with pytest.raises(
        ModelError, match=r"a gate is a probability between 0 and 1, such as 0\.999; got 9\.0"
    ):
        sq.run(sq.KalmanFilter(), model, LOG)


def test_a_model_function_that_fails_says_so_itself():
    def observe(x):
        if x[0] > -1e9:
            msg = "the lens is dirty"
            raise RuntimeError(msg)
        return [open(x)]  # noqa: PTH123 - nothing that Numba could compile

    model = declare(sensors={"position": sq.Sensor(observe, 1.0)}, check=False)
    with pytest.raises(RuntimeError, match="the lens is dirty"):
        sq.run(sq.ExtendedKalmanFilter(), model, LOG)


def test_an_estimate_that_is_lost_is_reported():
    def explode(x, dt):
        return np.array([x[0] / 0.0 if x[0] > 0.5 else x[0] + 1.0, x[1]])

    model = declare(process=sq.Process(step=explode, noise_density=0.1), check=False)
    with pytest.raises(
        NotFiniteError, match=r"'position' is not finite at 2\.0+ s .* a model function returned NaN"
    ):
        sq.run(sq.ExtendedKalmanFilter(), model, LOG)


def test_times_without_an_estimate_are_named():
    run = sq.run(sq.KalmanFilter(), declare(), LOG)
    assert run.index(np.array([1.0])).tolist() == [1]
    with pytest.raises(
        sq.FactorlabError, match=r"no estimate at 0\.500000 s .*; ask for them with run\(…, at=times\)"
    ):
        run.index(np.array([0.5, 0.7]))
