"""The rail: what is in it, what its two corrections are worth, and one dimension in which all must agree."""

from dataclasses import replace

import numpy as np
import pytest

from factorlab.compare import compare, document
from factorlab.datasets import load
from factorlab.datasets.rail import TRUTH_LATE_S
from factorlab.graph import BatchGraph
from sequential import (
    Gaussian,
    IteratedSmoother,
    KalmanFilter,
    LinearProcess,
    LinearSensor,
    RauchTungStriebel,
    SensorLog,
    StateSpace,
    Stream,
    Vector,
    run,
    tabulated_input,
    tune,
)
from sequential.errors import DataError

RTS = RauchTungStriebel(KalmanFilter(), leave_one_out=False)


@pytest.fixture(scope="module")
def rail(data_dir):
    (dataset,) = load("rail", data=data_dir / "robot" / "barfoot")
    return dataset


def score(dataset, result):
    """RMSE (m) and mean normalised error."""
    rows, truth = dataset.truth.at(result.t)
    error = (dataset.positions(result)[rows] - truth.position)[:, 0]
    return np.sqrt(np.mean(error**2)), np.mean(error**2 / dataset.position_cov(result)[rows, 0, 0])


def test_counts(rail):
    assert len(rail.log["odometry"]) == 12709
    assert len(rail.log["laser"]) == 12709
    assert rail.log["odometry"].covers == "before"
    assert rail.held_out is None
    assert rail.axes == 1
    assert 0.28 < rail.truth.position.min() < rail.truth.position.max() < 3.62


def test_smoothers_are_one(rail):
    """RTS, Gauss-Newton on the chain and the factor graph: 12 709 instants, to 1e-9."""
    smoothed = run(RTS, rail.model, rail.log)
    for other in (IteratedSmoother(leave_one_out=False), BatchGraph()):
        found = run(other, rail.model, rail.log)
        np.testing.assert_allclose(found.mean, smoothed.mean, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.cov, smoothed.cov, rtol=0, atol=1e-9)


def test_the_filter_says_how_far_off_it_is(rail):
    result = run(KalmanFilter(), rail.model, rail.log)
    rmse, honest = score(rail, result)
    assert rmse < 0.0058
    assert 0.8 < honest < 1.2
    assert 0.95 < np.mean(result.innovations["laser"].nis()) < 1.05


def as_stated(rail, data, every=1):
    """The course's own model: one state, white noise of the stated variances, all else as it is."""
    import scipy.io

    recorded = {k: np.ravel(v) for k, v in scipy.io.loadmat(data / "dataset1.mat").items() if k[0] != "_"}
    t, step = recorded["t"], 0.1
    place = recorded["l"][0] - recorded["r"]
    process = LinearProcess([[1.0]], [[step**2 * recorded["v_var"][0]]], [[step]])
    model = StateSpace(
        Vector(1), Gaussian(place[:1], [0.02**2]), process,
        {"laser": LinearSensor([[1.0]], recorded["r_var"][0])}, "odometry", 0.0,
    )  # fmt: skip
    streams = {
        "odometry": Stream(t, recorded["v"], covers="before"),
        "laser": Stream(t[::every], place[::every]),
    }
    return model, SensorLog(streams)


@pytest.fixture(scope="module")
def folder(data_dir):
    return data_dir / "robot" / "barfoot"


@pytest.mark.parametrize(
    ("every", "filter_rmse", "smoother_rmse"), [(1, 0.0253, 0.0208), (100, 0.0716, 0.0504)]
)
def test_the_course_s_model_is_overconfident(rail, folder, every, filter_rmse, smoother_rmse):
    """The reason for the corrections: taken for white, the noise leaves three times the error, unsaid."""
    model, log = as_stated(rail, folder, every)
    recorded = replace(rail, truth=replace(rail.truth, t=rail.truth.t + round(TRUTH_LATE_S * 1e9)))
    for estimator, expected in ((KalmanFilter(), filter_rmse), (RTS, smoother_rmse)):
        rmse, honest = score(recorded, run(estimator, model, log, at=recorded.truth.t))
        assert rmse == pytest.approx(expected, abs=2e-4)
        assert honest > 3


def test_a_table_of_steps_says_the_same(rail, folder):
    """The discrete model with one F, Q, B, and as a table that has a row for every step."""
    model, log = as_stated(rail, folder)
    count = len(log["odometry"])
    process = model.process
    tabulated = LinearProcess(np.ones((count, 1, 1)), process.Q, process.B)
    odometry = log["odometry"]
    rows = tabulated_input(odometry.t, odometry.values, covers="before")
    other = replace(model, process=tabulated)
    one, two = run(RTS, model, log), run(RTS, other, log.replaced(odometry=rows))
    np.testing.assert_allclose(one.mean, two.mean, rtol=0, atol=1e-12)
    np.testing.assert_allclose(one.cov, two.cov, rtol=0, atol=1e-12)


def disagreement(rail, late, scale):
    """RMS (m) of what laser and odometry say was driven in a second, for other stamps and speeds."""
    laser, odometry = rail.log["laser"], rail.log["odometry"]
    second = 10
    driven = np.concatenate([[0.0], np.cumsum(odometry.values[1:, 0] * 0.1 * scale)])
    driven = np.interp(laser.t, odometry.t + round(late * 1e9), driven)
    place = laser.values[:, 0]
    apart = (place[second:] - place[:-second]) - (driven[second:] - driven[:-second])
    return np.sqrt(np.mean(apart[second:-second] ** 2))


def test_laser_and_odometry_ask_for_the_corrections(rail):
    """Without the truth: as recorded, they agree far less."""
    here = disagreement(rail, 0.0, 1.0)
    assert here < 0.0066
    assert disagreement(rail, -0.05, 1.0) > 2 * here
    assert disagreement(rail, 0.1, 1.0) > 1.5 * here
    assert disagreement(rail, 0.0, 1.0 / 0.943) > 2 * here
    assert min(disagreement(rail, 0.0, scale) for scale in (0.98, 1.02)) > 1.05 * here


def test_the_truth_is_late_against_both(rail):
    """Laser and odometry each fit it far better where it is moved earlier (the odometry best by 80 ms)."""
    laser, truth = rail.log["laser"], rail.truth
    spread, apart = {}, {}
    for late in (-0.065, -0.03, 0.0, 0.03, 0.065):
        t = truth.t + round(late * 1e9)
        spread[late] = np.std(laser.values[:, 0] - np.interp(laser.t, t, truth.position[:, 0]))
        moved = replace(rail, log=rail.log.replaced(laser=Stream(truth.t, truth.position)))
        apart[late] = disagreement(moved, -late, 1.0)
    assert spread[0.0] == min(spread.values()) < 0.0068
    assert spread[0.065] > 0.019
    assert apart[0.0] < 0.4 * apart[0.065]  # as recorded


def test_the_noise_is_where_its_likelihood_is_largest(rail):
    found = tune(rail.build, rail.knobs, rail.log)
    assert found.log_likelihood_after - found.log_likelihood_before < 3


def test_the_command_has_every_row(rail):
    whole = document((compare(rail),), "factorlab compare rail")
    rows = whole["estimators"]
    assert list(rows) == ["kf", "kf_rts", "ieks", "batch"]
    for row in rows.values():
        assert row["rmse_m"] < 0.0058
        assert 0.7 < row["normalised_error"]["mean"] < 1.3
        assert row["nis"]["count"] == 12709
    assert rows["kf_rts"]["rmse_m"] == pytest.approx(rows["batch"]["rmse_m"], rel=1e-9)


def test_a_missing_file_is_a_sentence(tmp_path):
    with pytest.raises(DataError, match=r"dataset1\.mat.*FACTORLAB_DATA"):
        load("rail", data=tmp_path)
