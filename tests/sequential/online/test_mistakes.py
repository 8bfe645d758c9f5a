"""What cannot be is a sentence, and leaves every belief as it was."""

import math

import numpy as np
import pytest
import worlds

import sequential as sq
from sequential.errors import FactorlabError


def cart():
    return sq.StateSpace(
        sq.Vector(2),
        sq.Gaussian([0.0, 1.0], [1.0, 1.0]),
        sq.ConstantVelocity(0.1),
        {
            "position": sq.LinearSensor([[1.0, 0.0]], 0.25),
            "both": sq.LinearSensor(np.eye(2), [[0.3, 0.1], [0.1, 0.2]]),
        },
    )


def explode(x, dt):
    return np.array([x[0] + dt * math.sqrt(x[0])])


def unit():
    model = worlds.unicycle_range_bearing().model
    online = sq.Online(sq.ExtendedKalmanFilter(), model)
    return online, online.start()


def carted():
    online = sq.Online(sq.KalmanFilter(), cart())
    return online, online.start()


def rooted():
    model = sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([-1.0], [1.0]),
        sq.Process(explode, noise_density=1.0),
        {"z": sq.LinearSensor([[1.0]], 1.0)},
        check=False,
    )
    online = sq.Online(sq.ExtendedKalmanFilter(), model)
    return online, online.start()


def turned():
    model = sq.StateSpace(
        sq.SO3(),
        sq.Gaussian([1.0, 0, 0, 0], np.eye(3)),
        sq.RandomWalk(0.1),
        {"attitude": sq.Sensor(lambda x: x, 0.1 * np.eye(3), manifold=sq.SO3())},
        check=False,
    )
    online = sq.Online(sq.ExtendedKalmanFilter(), model)
    return online, online.start()


def forget(x, dt):
    return 0.0 * dt * x


def informed():
    model = sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([1.0], [1.0]),
        sq.Process(forget, noise_density=1.0),
        {"z": sq.LinearSensor([[1.0]], 0.0)},
        check=False,
    )
    online = sq.Online(sq.ExtendedKalmanFilter(form="information"), model)
    return online, online.start()


NAN, INF = math.nan, math.inf
MISTAKES = [
    (carted, lambda o, b: o.update(b, "gps", 1.0), r"no sensor 'gps'; it has 'position', 'both'"),
    (carted, lambda o, b: o.update(b, "both", 1.0), r"'both' is 2 numbers, got an array of shape \(\)"),
    (carted, lambda o, b: o.update(b, "position", [1, 2]), r"'position' is one number, .* shape \(2,\)"),
    (carted, lambda o, b: o.update(b, "both", [[1, 2]]), r"got an array of shape \(1, 2\)"),
    (carted, lambda o, b: o.update(b, "both", [1, INF]), r"'both' is .*it must be finite, or NaN"),
    (carted, lambda o, b: o.update(b, "both", [1, 2], noise_cov=-1.0), r"noise_cov of a reading of 'both'"),
    (carted, lambda o, b: o.predict(b, -0.1), r"a step lasts zero or more seconds, got dt = -0.1"),
    (carted, lambda o, b: o.predict(b, NAN), r"a step lasts zero or more seconds, got dt = nan"),
    (
        carted,
        lambda o, b: o.step(b, INF, "position", 1.0),
        r"a step lasts zero or more seconds, got dt = inf",
    ),
    (carted, lambda o, b: o.predict(b, 0.1, [1.0]), r"ConstantVelocity is not driven by an input"),
    (carted, lambda o, _: o.belief(sq.Gaussian([1.0], [1.0]), 0.0), r"a mean of shape \(2,\) .* got \(1,\)"),
    (carted, lambda o, _: o.update(turned()[1], "position", 1.0), r"a belief about .* was handed to a model"),
    (unit, lambda o, b: o.predict(b, 0.1), r"driven by 'odometry': give its 2 numbers as u"),
    (unit, lambda o, b: o.predict(b, 0.1, [1.0]), r"driven by 2 numbers of 'odometry', .* shape \(1,\)"),
    (unit, lambda o, b: o.predict(b, 0.1, [1.0, NAN]), r"the input .* a sensor may miss a reading, an input"),
    (unit, lambda o, b: o.update(b, "odometry", [1.0, 0.0]), r"'odometry' drives the process; .* predict"),
    (unit, lambda o, b: o.update(b, "landmark", [1.0, 0.0]), r"needs 1 context numbers .* got none"),
    (
        unit,
        lambda o, b: o.update(b, "landmark", [1.0, 0.0], 4),
        r"landmark 4, .* has 4 landmarks",
    ),
    (unit, lambda o, b: o.update(b, "landmark", [1.0, 0.0], NAN), r"sees landmark nan"),
    (
        turned,
        lambda o, b: o.update(b, "attitude", [1, 0, 0, NAN]),
        r"whole or missing: make every",
    ),
    (rooted, lambda o, b: o.predict(b, 0.1), r"no longer finite after the prediction: a model function"),
    (
        informed,
        lambda o, b: o.predict(b, 0.1),
        r"information form cannot make the prediction: the",
    ),
    (
        informed,
        lambda o, b: o.update(b, "z", 1.0),
        r"make the update by a reading of 'z': .* form='ud'",
    ),
    (
        rooted,
        lambda o, b: o.step(b, 0.1, "z", 1.0),
        r"no longer finite after the update by a reading of 'z': a model function returned NaN",
    ),
]


@pytest.mark.parametrize(("make", "mistake", "sentence"), MISTAKES, ids=[m[2][:40] for m in MISTAKES])
def test_a_mistake_is_a_sentence_and_does_no_harm(make, mistake, sentence):
    online, belief = make()
    mean = belief.mean.copy()
    with pytest.raises(FactorlabError, match=sentence) as caught:
        mistake(online, belief)
    assert "\n" not in str(caught.value)
    np.testing.assert_array_equal(belief.mean, mean)


@pytest.mark.parametrize(
    ("estimator", "sentence"),
    [
        (sq.IteratedSmoother(), "IteratedSmoother has no online form: it needs the whole log; take one of"),
        (
            sq.InteractingMultipleModel([worlds.unicycle_range_bearing().model] * 2, transition=0.9),
            "InteractingMultipleModel has no online form: it mixes its models at the nodes of a log",
        ),
        (
            sq.ParticleFilter(rng=np.random.default_rng(1)),
            "ParticleFilter has no online form: its belief is a cloud of particles",
        ),
        (sq.KalmanFilter(), "KalmanFilter takes linear models only: the state lives on"),
    ],
    ids=["a smoother", "models", "particles", "a model that is not linear"],
)
def test_a_filter_that_cannot_says_so(estimator, sentence):
    with pytest.raises(FactorlabError, match=sentence):
        sq.Online(estimator, worlds.unicycle_range_bearing().model)
