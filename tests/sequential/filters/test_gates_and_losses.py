"""Readings that are wrong: rejected by a gate, weighed down by a loss, and never lost from the record."""

import numpy as np
import pytest

import sequential as sq
from sequential.errors import ModelError

EVERY_FILTER = [sq.ExtendedKalmanFilter(), sq.IteratedExtendedKalmanFilter(), sq.UnscentedKalmanFilter()]
every_filter = pytest.mark.parametrize("estimator", EVERY_FILTER, ids=lambda e: e.name)


def walk(**settings):
    return sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([0.0], 1.0),
        sq.RandomWalk(0.01),
        {"z": sq.LinearSensor([[1.0]], 0.1, **settings)},
        start=0.0,
    )


def log_with_outlier(rng, size=30.0):
    values = rng.normal(0.0, 0.3, 40)
    values[20] = size
    return sq.SensorLog({"z": sq.Stream(np.arange(40) * 0.1, values)})


@every_filter
def test_a_gate_rejects_and_records(estimator, rng):
    log = log_with_outlier(rng)
    run = sq.run(estimator, walk(gate=0.9999), log)
    seen = run.innovations["z"]
    np.testing.assert_array_equal(np.flatnonzero(~seen.accepted), [20])
    assert run.report.rejected == 1
    assert seen.nis()[20] > 1000
    without = log.replaced(z=log["z"].select(np.arange(40) != 20))
    clean = sq.run(estimator, walk(gate=0.9999), without, at=log["z"].t)
    np.testing.assert_allclose(run.mean, clean.mean, atol=1e-12)
    assert run.log_likelihood == pytest.approx(clean.log_likelihood)


@every_filter
@pytest.mark.parametrize("loss", [sq.Loss("huber", 1.345), sq.Loss("cauchy", 1.0)], ids=lambda s: s.kind)
def test_a_loss_holds_an_outlier_down(estimator, loss, rng):
    log = log_with_outlier(rng)
    plain, robust = (sq.run(estimator, walk(loss=given), log) for given in (None, loss))
    assert abs(robust.mean[20, 0]) < 0.25 * abs(plain.mean[20, 0])
    assert robust.innovations["z"].accepted.all()
    # the innovation and its covariance are those of the whole noise: honest about the surprise
    assert robust.innovations["z"].cov[20, 0, 0] < 0.3


@every_filter
@pytest.mark.parametrize("kind", ["huber", "cauchy"])
def test_a_wide_loss_is_no_loss(estimator, kind, rng):
    log = log_with_outlier(rng)
    plain, wide = (sq.run(estimator, walk(loss=given), log) for given in (None, sq.Loss(kind, 1e6)))
    np.testing.assert_allclose(wide.mean, plain.mean, atol=1e-6)


@pytest.mark.parametrize("kind", ["huber", "cauchy"])
def test_the_weight_is_on_the_information(kind):
    """One reading: the update with weight w is the update with noise R/w."""
    loss, noise, z = sq.Loss(kind, 1.0), 0.5, 6.0
    squared = z**2 / (1.0 + noise)
    weight = 1.0 / np.sqrt(squared) if kind == "huber" else 1.0 / (1.0 + squared)
    model = sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([0.0], 1.0),
        sq.RandomWalk(0.0),
        {"z": sq.LinearSensor([[1.0]], noise, loss=loss)},
    )
    log = sq.SensorLog({"z": sq.Stream([0.0], [z])})
    for estimator in EVERY_FILTER:
        run = sq.run(estimator, model, log)
        assert run.mean[0, 0] == pytest.approx(z / (1.0 + noise / weight))
        assert run.cov[0, 0, 0] == pytest.approx(1.0 - 1.0 / (1.0 + noise / weight))


@pytest.mark.parametrize("gate", [0.0, 1.0, 9.0, -0.1])
def test_a_gate_is_a_probability(gate, rng):
    with pytest.raises(ModelError, match=r"probability between 0 and 1, such as 0\.999"):
        sq.run(sq.ExtendedKalmanFilter(), walk(gate=gate), log_with_outlier(rng))


def test_a_loss_has_a_known_kind():
    for kind, k in (("tukey", 1.0), ("huber", 0.0), ("cauchy", -1.0)):
        with pytest.raises(ModelError, match="a loss is Loss"):
            sq.Loss(kind, k)
