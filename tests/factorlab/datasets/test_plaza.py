"""Plaza 1 and 2: what is in them, and how well range-only localisation does."""

from dataclasses import replace

import numpy as np
import pytest

from factorlab.datasets import load
from factorlab.graph import BatchGraph
from sequential import (
    SE2,
    ExtendedKalmanFilter,
    Gaussian,
    IteratedSmoother,
    Product,
    Range,
    StateSpace,
    Vector,
    run,
)
from sequential.errors import DataError


@pytest.fixture(scope="module", params=["plaza1", "plaza2"])
def plaza(request):
    (dataset,) = load(request.param)
    return dataset


def test_counts(plaza):
    readings = {name: len(stream) for name, stream in plaza.log.items()}
    assert readings == {
        "plaza1": {"odometry": 9657, "range": 3527},
        "plaza2": {"odometry": 4090, "range": 1816},
    }.get(plaza.name)
    assert plaza.held_out is None
    assert plaza.axes == 2
    assert plaza.log["odometry"].covers == "before"
    assert set(plaza.log["range"].context[:, 0]) == {0, 1, 2, 3}


def test_odometry_keeps_the_distances_and_turns(plaza):
    """Speeds over their intervals add up to the increments of the file."""
    odometry = plaza.log["odometry"]
    dt = np.diff(odometry.t, prepend=plaza.model.start_ns) * 1e-9
    driven, turned = dt @ odometry.values
    path = np.linalg.norm(np.diff(plaza.truth.position, axis=0), axis=1).sum()
    assert driven == pytest.approx(path, rel=0.01)
    assert abs(turned) > 10


def _score(dataset, estimator):
    result = run(estimator, dataset.model, dataset.log)
    rows, truth = dataset.truth.at(result.t)
    error = dataset.positions(result)[rows] - truth.position
    cov = dataset.position_cov(result)[rows]
    nees = np.einsum("ni,nij,nj->n", error, np.linalg.inv(cov), error)
    return np.sqrt((error**2).sum(axis=1).mean()), nees.mean() / 2, result


def test_filter(plaza):
    rmse, anees, result = _score(plaza, ExtendedKalmanFilter())
    assert rmse < 0.45
    assert 0.5 < anees < 2
    assert 0.8 < np.mean(result.innovations["range"].nis()) < 1.2


def test_smoother(plaza):
    """No alignment, and nothing of the truth but the first position."""
    rmse, anees, result = _score(plaza, IteratedSmoother())
    assert rmse < 0.25
    assert 0.5 < anees < 1.5
    assert result.report.converged
    np.testing.assert_allclose(result.part("range_scale"), 0.07, atol=0.01)
    np.testing.assert_allclose(result.part("range_bias"), 0.0, atol=0.2)


@pytest.mark.parametrize("heading", [0.0, 1.0, 2.0, 3.0, -2.0, -1.0])
def test_the_start_heading_is_found(heading):
    """From any first guess Gauss-Newton ends in the same place, half a turn from the recorded heading."""
    (dataset,) = load("plaza2")
    assert dataset.truth.heading is None
    model = dataset.model
    mean = np.array(model.prior.mean)
    assert mean[2] == 0.0
    mean[2] = heading
    guessed = replace(model, prior=Gaussian(mean, model.prior.cov))
    rmse, _, result = _score(replace(dataset, model=guessed), IteratedSmoother())
    assert rmse < 0.25
    assert result.report.iterations < 15
    recorded = -2.02108900
    apart = np.angle(np.exp(1j * (result.part("pose")[0, 2] - recorded)))
    assert abs(apart) > 2.9


@pytest.mark.parametrize("parts", ["scale", "both"])
def test_batch_graph_agrees(parts):
    """A range scale has no native factor: it must go through linearisation, also where it is alone."""
    (dataset,) = load("plaza2")
    model = dataset.model if parts == "both" else _scale_only(dataset.model)
    log = dataset.log.between(stop=model.start_ns + 60 * 10**9)
    graph, chain = (run(e, model, log) for e in (BatchGraph(covariance=False), IteratedSmoother()))
    np.testing.assert_allclose(graph.part("range_scale"), chain.part("range_scale"), atol=1e-4)
    np.testing.assert_allclose(dataset.positions(graph), dataset.positions(chain), atol=1e-3)


def _scale_only(model):
    state = Product(pose=SE2(), range_scale=Vector(1))
    kept = [0, 1, 2, 4]
    prior = Gaussian(model.prior.mean[kept], model.prior.cov[np.ix_(kept, kept)])
    whole = model.sensors["range"]
    sensor = Range(whole.landmarks, whole.noise_cov, scale="range_scale", loss=whole.loss)
    return StateSpace(
        state, prior, model.process, {"range": sensor}, "odometry", model.start_ns, ("range_scale",)
    )


def test_knobs_build_another_model(plaza):
    values = {knob.name: knob.initial for knob in plaza.knobs}
    model = plaza.build(values | {"range_sigma": 2.0})
    np.testing.assert_allclose(model.sensors["range"].noise_cov, 4.0)
    np.testing.assert_array_equal(model.process_functions.params, plaza.model.process_functions.params)
    np.testing.assert_array_equal(model.prior.mean, plaza.model.prior.mean)


def test_a_missing_file_is_a_sentence(tmp_path):
    with pytest.raises(DataError, match=r"Plaza2_.mat.*gtsam wheel"):
        load("plaza2", data=tmp_path)
