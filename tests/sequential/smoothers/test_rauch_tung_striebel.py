"""The backward pass: behind any filter, on singular covariances, with gates."""

import numpy as np
import pytest

import sequential as sq


def two_parts(static_sigma):
    """A wandering number and a constant offset; the sensor sees their sum, another the first alone."""
    return sq.StateSpace(
        sq.Product(level=sq.Vector(1), offset=sq.Vector(1)),
        sq.Gaussian([0.0, 0.0], np.diag([1.0, static_sigma**2])),
        sq.RandomWalk([0.1, 0.0]),
        {"sum": sq.LinearSensor([[1.0, 1.0]], 0.1), "level": sq.LinearSensor([[1.0, 0.0]], 0.2)},
        start=0.0,
        static=("offset",),
    )


@pytest.fixture
def log(rng):
    t = np.arange(30) * 0.5
    return sq.SensorLog(
        {"sum": sq.Stream(t, rng.normal(1.0, 0.5, 30)), "level": sq.Stream(t, rng.normal(0, 0.5, 30))}
    )


@pytest.mark.parametrize("filter_", [sq.KalmanFilter(), sq.UnscentedKalmanFilter()], ids=lambda e: e.name)
def test_a_static_part_has_one_estimate(log, filter_):
    run = sq.run(sq.RauchTungStriebel(filter_), two_parts(1.0), log)
    offset = run.part("offset")
    np.testing.assert_allclose(offset, np.broadcast_to(offset[-1], offset.shape), atol=1e-9)
    np.testing.assert_allclose(run.cov[:, 1, 1], run.cov[-1, 1, 1], rtol=1e-9)


@pytest.mark.parametrize(
    "filter_", [sq.ExtendedKalmanFilter(), sq.UnscentedKalmanFilter()], ids=lambda e: e.name
)
def test_what_is_known_perfectly_stays_known(log, filter_):
    """A vanishing variance is left out of the backward pass instead of blowing it up."""
    run = sq.run(sq.RauchTungStriebel(filter_), two_parts(1e-12), log)
    without = sq.StateSpace(
        sq.Vector(1), sq.Gaussian([0.0], 1.0), sq.RandomWalk(0.1),
        {"sum": sq.LinearSensor([[1.0]], 0.1), "level": sq.LinearSensor([[1.0]], 0.2)}, start=0.0,
    )  # fmt: skip
    plain = sq.run(sq.RauchTungStriebel(), without, log)
    np.testing.assert_allclose(run.part("level"), plain.mean, atol=1e-9)
    np.testing.assert_allclose(run.cov[:, 0, 0], plain.cov[:, 0, 0], atol=1e-9)
    np.testing.assert_allclose(run.part("offset"), 0.0, atol=1e-12)


def test_rejected_readings_stay_rejected(log):
    values = log["level"].values.copy()
    values[11] = 40.0
    spoilt = log.replaced(level=sq.Stream(log["level"].t, values))
    model = two_parts(1.0)
    gated = sq.StateSpace(
        model.manifold, model.prior, model.process,
        {**model.sensors, "level": sq.LinearSensor([[1.0, 0.0]], 0.2, gate=0.99999999)}, start=0.0,
    )  # fmt: skip
    run = sq.run(sq.RauchTungStriebel(), gated, spoilt)
    left = run.innovations["level"]
    np.testing.assert_array_equal(np.flatnonzero(~left.accepted), [11])
    without = spoilt.replaced(level=spoilt["level"].select(np.arange(30) != 11))
    clean = sq.run(sq.RauchTungStriebel(), model, without)
    np.testing.assert_allclose(run.mean, clean.mean, atol=1e-9)
    # of a reading that was left out anyway, the smoother's prediction is the one it made
    assert left.residual[11, 0] == pytest.approx(40.0 - clean.mean[11, 0])
    assert left.cov[11, 0, 0] == pytest.approx(0.2 + clean.cov[11, 0, 0])


def test_robust_weights_are_part_of_leaving_out():
    """A reading weighed down by w was used with R/w; leaving it out must not take more away than it gave."""
    loss = sq.Loss("cauchy", 1.0)
    t, z = np.arange(3.0), np.array([0.0, 5.0, 0.1])
    model = sq.StateSpace(
        sq.Vector(1),
        sq.Gaussian([0.0], 1.0),
        sq.RandomWalk(0.2),
        {"z": sq.LinearSensor([[1.0]], 0.3, loss=loss)},
    )
    log = sq.SensorLog({"z": sq.Stream(t, z)})
    forward = sq.run(sq.ExtendedKalmanFilter(), model, log)
    weight = 1.0 / (1.0 + forward.innovations["z"].nis())
    run = sq.run(sq.RauchTungStriebel(), model, log)
    for k in range(3):
        # the same smoother with the weights written into the noise, and one reading gone
        others = np.arange(3) != k
        precision = np.diag(np.where(others, weight / 0.3, 0.0))
        prior = 1.0 + 0.2 * np.minimum.outer(t, t)
        cov = np.linalg.inv(np.linalg.inv(prior) + precision)
        mean = cov @ precision @ z
        assert run.innovations["z"].residual[k, 0] == pytest.approx(z[k] - mean[k])
        assert run.innovations["z"].cov[k, 0, 0] == pytest.approx(cov[k, k] + 0.3)


def test_names_and_reports(log):
    assert sq.RauchTungStriebel().name == "ekf_rts"
    assert sq.RauchTungStriebel(sq.UnscentedKalmanFilter()).name == "ukf_rts"
    run = sq.run(sq.RauchTungStriebel(sq.UnscentedKalmanFilter()), two_parts(1.0), log)
    assert run.report.estimator == "ukf_rts"
    assert run.report.seconds > 0
    assert run.predicted is not None
    np.testing.assert_array_equal(run.predicted.transition[0], np.eye(2))
