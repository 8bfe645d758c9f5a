"""The kernel of linear models: against the extended filter's, made for one size, with a frozen gain."""

import numpy as np
import pytest

import sequential as sq
from sequential.errors import ModelError

STEPS = 600


def track(axes=1, *, gate=None, loss=None):
    matrix = np.hstack([np.eye(axes), np.zeros((axes, axes))])
    sensor = sq.LinearSensor(matrix, 0.3 * np.eye(axes) + 0.1, gate=gate, loss=loss)
    prior = sq.Gaussian(np.zeros(2 * axes), 4.0)
    return sq.StateSpace(sq.Vector(2 * axes), prior, sq.ConstantVelocity(0.5, axes=axes), {"z": sensor})


def readings(rng, axes=1, holes=0.0):
    z = np.cumsum(rng.normal(size=(STEPS, axes)), axis=0)
    z[rng.random(z.shape) < holes] = np.nan
    return sq.SensorLog({"z": sq.Stream(0.1 * np.arange(STEPS), z)})


def assert_same(one, other, atol=1e-9):
    __tracebackhide__ = True
    np.testing.assert_allclose(one.mean, other.mean, atol=atol)
    np.testing.assert_allclose(one.cov, other.cov, atol=atol)
    assert one.log_likelihood == pytest.approx(other.log_likelihood, abs=1e-6)
    for name, seen in one.innovations.items():
        np.testing.assert_allclose(seen.nis(), other.innovations[name].nis(), atol=1e-7)
        np.testing.assert_array_equal(seen.accepted, other.innovations[name].accepted)


VARIANTS = {
    "plain": {},
    "gated": {"gate": 0.9},
    "huber": {"loss": sq.Loss("huber", 1.0)},
    "cauchy, gated": {"loss": sq.Loss("cauchy", 1.0), "gate": 0.99},
}


@pytest.mark.parametrize("holes", [0.0, 0.3])
@pytest.mark.parametrize("variant", VARIANTS)
def test_the_linear_kernel_is_the_extended_filter(variant, holes, rng):
    model, log = track(2, **VARIANTS[variant]), readings(rng, 2, holes)
    assert_same(sq.run(sq.KalmanFilter(), model, log), sq.run(sq.ExtendedKalmanFilter(), model, log))


def test_inputs_and_multi_rate_sensors_go_through_the_linear_kernel(rng):
    process = sq.ContinuousProcess([[0.0, 1.0], [0.0, -0.5]], [[0.0], [1.0]], 0.2, B=[[0.0], [1.0]])
    sensors = {"place": sq.LinearSensor([[1.0, 0.0]], 0.5), "speed": sq.LinearSensor([[0.0, 1.0]], 0.1)}
    model = sq.StateSpace(sq.Vector(2), sq.Gaussian([0.0, 0.0], 1.0), process, sensors, input="force")
    log = sq.SensorLog(
        {
            "force": sq.Stream(0.05 * np.arange(200), rng.normal(size=200)),
            "place": sq.Stream(0.5 + 0.4 * np.arange(20), rng.normal(size=20)),
            "speed": sq.Stream(0.3 + 0.13 * np.arange(60), rng.normal(size=60)),
        }
    )
    assert_same(sq.run(sq.KalmanFilter(), model, log), sq.run(sq.ExtendedKalmanFilter(), model, log))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plain", "made"),
    [
        (sq.KalmanFilter(), sq.KalmanFilter(specialise=True)),
        (sq.ExtendedKalmanFilter(), sq.ExtendedKalmanFilter(specialise=True)),
        (sq.UnscentedKalmanFilter(), sq.UnscentedKalmanFilter(specialise=True)),
    ],
    ids=["kf", "ekf", "ukf"],
)
def test_a_kernel_made_for_one_size_gives_the_same(plain, made, rng):
    model, log = track(), readings(rng, holes=0.1)
    assert_same(sq.run(made, model, log), sq.run(plain, model, log), atol=1e-10)


def test_a_frozen_gain_is_that_of_the_steady_state_and_costs_no_accuracy(rng):
    model, log = track(2), readings(rng, 2)
    free, frozen = (sq.run(sq.KalmanFilter(freeze=f), model, log) for f in (None, 1e-12))
    assert_same(frozen, free)
    np.testing.assert_array_equal(frozen.cov[-1], frozen.cov[-200])
    assert not np.array_equal(frozen.cov[20], frozen.cov[21])
    np.testing.assert_allclose(frozen.cov[-1], sq.steady_state(model, 0.1).cov, rtol=1e-9)


def test_a_frozen_gain_thaws_where_the_rhythm_changes(rng):
    model, log = track(), readings(rng)
    t, z = log["z"].t.copy(), log["z"].values.copy()
    t[400:] += 5_000_000_000
    z[300] = np.nan
    log = sq.SensorLog({"z": sq.Stream(t, z)})
    free, frozen = (sq.run(sq.KalmanFilter(freeze=f), model, log) for f in (None, 1e-12))
    assert_same(frozen, free)
    assert frozen.cov[400, 0, 0] > 1.1 * frozen.cov[399, 0, 0]


def test_a_reading_that_its_gate_rejects_thaws_the_gain(rng):
    model, log = track(gate=0.999), readings(rng)
    z = log["z"].values.copy()
    z[300] += 100.0
    log = sq.SensorLog({"z": sq.Stream(log["z"].t, z)})
    free, frozen = (sq.run(sq.KalmanFilter(freeze=f), model, log) for f in (None, 1e-12))
    assert not frozen.innovations["z"].accepted[300]
    assert_same(frozen, free)


def test_what_cannot_be_frozen_or_made_for_a_size_says_so():
    with pytest.raises(ModelError, match="freeze is a share of the covariance between 0 and 1"):
        sq.KalmanFilter(freeze=2.0)
    with pytest.raises(ModelError, match="form 'ud' computes its factors at every reading"):
        sq.KalmanFilter(freeze=1e-12, form="ud")
    with pytest.raises(ModelError, match="form 'sqrt' has no kernels of one size"):
        sq.ExtendedKalmanFilter(form="sqrt", specialise=True)
