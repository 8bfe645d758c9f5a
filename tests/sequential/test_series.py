"""Many series in one call: each the same as by itself, whatever is shared."""

import numpy as np
import pytest

import sequential as sq
from sequential.errors import ModelError, NonlinearModelError, ShapeError

T = 0.1 * np.arange(40)
VARIANTS = {
    "whole": (0.0, {}),
    "holes of their own": (0.3, {}),
    "gated": (0.0, {"gate": 0.9}),
    "huber, holes": (0.2, {"loss": sq.Loss("huber", 1.0)}),
}


def model_of(**settings):
    matrix = np.hstack([np.eye(2), np.zeros((2, 2))])
    sensor = sq.LinearSensor(matrix, [[0.4, 0.1], [0.1, 0.3]], **settings)
    return sq.StateSpace(
        sq.Vector(4), sq.Gaussian(np.zeros(4), 2.0), sq.ConstantVelocity(0.5, 2), {"z": sensor}
    )


def series(rng, holes=0.0, count=7):
    z = np.cumsum(rng.normal(size=(count, len(T), 2)), axis=1)
    z[rng.random(z.shape) < holes] = np.nan
    return z


def assert_each_is_its_own_run(found, model, z):
    __tracebackhide__ = True
    for s, own in enumerate(z):
        run = sq.run(sq.KalmanFilter(), model, sq.SensorLog({"z": sq.Stream(T, own)}))
        np.testing.assert_allclose(found.mean[s], run.mean, atol=1e-9)
        np.testing.assert_allclose(found.cov[s], run.cov, atol=1e-9)
        assert found.log_likelihood[s] == pytest.approx(run.log_likelihood, abs=1e-8)
        used = run.innovations["z"]
        np.testing.assert_allclose(found.nis()[s, used.row], used.nis(), atol=1e-8)


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("variant", VARIANTS)
def test_each_series_is_its_own_run(variant, threads, rng):
    holes, settings = VARIANTS[variant]
    model, z = model_of(**settings), series(rng, holes)
    found = sq.filter_series(model, T, z, threads=threads)
    assert found.shared == (variant == "whole")
    assert_each_is_its_own_run(found, model, z)


def test_series_with_the_same_holes_share_their_covariances(rng):
    model, z = model_of(), series(rng)
    z[:, rng.random(z.shape[1:]) < 0.3] = np.nan
    z[:, 11] = np.nan
    found = sq.filter_series(model, T, z)
    assert found.shared
    assert_each_is_its_own_run(found, model, z)
    apart = sq.filter_series(model, T, z, shared=False)
    np.testing.assert_allclose(found.mean, apart.mean, atol=1e-10)


def test_readings_that_rounding_cannot_tell_apart_are_not_shared(rng):
    sensor = sq.LinearSensor([[1.0, 1.0], [1.0, 1.0 + 1e-8]], 1e-16)
    model = sq.StateSpace(sq.Vector(2), sq.Gaussian([0.0, 0.0], 1.0), sq.RandomWalk(1e-3), {"z": sensor})
    z = np.repeat(rng.normal(size=(3, 5, 1)), 2, axis=2)
    found = sq.filter_series(model, np.arange(5.0), z)
    assert not found.shared
    assert np.isfinite(found.mean).all()
    with pytest.raises(ModelError, match="an innovation covariance is in doubt"):
        sq.filter_series(model, np.arange(5.0), z, shared=True)


def test_any_model_goes_through_threads(rng):
    model = model_of()
    logs = [sq.SensorLog({"z": sq.Stream(T, z)}) for z in series(rng)]
    for run, log in zip(sq.run_many(sq.UnscentedKalmanFilter(), model, logs, threads=3), logs, strict=True):
        np.testing.assert_array_equal(run.mean, sq.run(sq.UnscentedKalmanFilter(), model, log).mean)


def test_wrong_series_are_told_what_is_wrong(rng):
    model, z = model_of(), series(rng)
    with pytest.raises(ShapeError, match=r"z of shape \(series, 40, 2\), got \(7, 40, 1\)"):
        sq.filter_series(model, T, z[..., :1])
    with pytest.raises(ModelError, match="has a gate or a loss"):
        sq.filter_series(model_of(gate=0.9), T, z, shared=True)
    bent = sq.Sensor(lambda x: np.array([x[0] * x[1]]), 1.0)
    curved = sq.StateSpace(model.manifold, model.prior, model.process, {"z": bent})
    with pytest.raises(NonlinearModelError, match="is not declared linear"):
        sq.filter_series(curved, T, z)
    late = sq.StateSpace(model.manifold, model.prior, model.process, model.sensors, start=1.0)
    with pytest.raises(ModelError, match="the first 10 stamps are before the model's start"):
        sq.filter_series(late, T, z)
