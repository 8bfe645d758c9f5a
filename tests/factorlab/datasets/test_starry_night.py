"""The starry night: what is in it, that all smoothers are one, and how far off each estimator is."""

import dataclasses

import numpy as np
import pytest

from factorlab.compare import compare, document
from factorlab.compare.text import terminal
from factorlab.datasets import load
from factorlab.datasets.starry_night import WIDER
from factorlab.graph import BatchGraph, IncrementalGraph
from sequential import SE3, IteratedSmoother, run
from sequential.errors import DataError, ModelError


@pytest.fixture(scope="module")
def night(data_dir):
    (dataset,) = load("starry_night", data=data_dir / "robot" / "barfoot")
    return dataset


@pytest.fixture(scope="module")
def table(night):
    return compare(night, ("ekf", "ekf_rts", "batch"))


def test_counts(night):
    assert len(night.log["twist"]) == len(night.truth) == 1900
    assert len(night.log["stereo"]) == 9410
    assert night.log["stereo"].values.shape == (9410, 3)
    assert night.held_out is None
    assert night.axes == 3


def test_readings_fit_the_truth_as_the_file_says(night):
    """The variances in the file are those of the residuals about its truth: every convention is right."""
    from sequential.model import evaluate

    f, stereo = night.model.sensor_functions["stereo"], night.log["stereo"]
    rows, truth = night.truth.at(stereo.t)
    poses = np.concatenate([truth.quaternion, truth.position], axis=1)
    off = np.array(
        [
            stereo.values[row] - evaluate(f.value, x, stereo.context[row], 0.0, f.params, 3)
            for row, x in zip(rows, poses, strict=True)
        ]
    )
    stated = np.diag(night.model.sensors["stereo"].noise_cov) / WIDER**2
    np.testing.assert_allclose(off.var(axis=0)[:2], stated[:2], rtol=1e-3)
    assert np.abs(np.median(off, axis=0)).max() < 3.5


def test_the_native_graph_and_the_chain_are_one(night):
    ours = run(IteratedSmoother(leave_one_out=False), night.model, night.log)
    theirs = run(BatchGraph(route="native"), night.model, night.log)
    assert np.abs(SE3().local(ours.mean, theirs.mean)).max() < 1e-4
    scale = np.sqrt(np.einsum("nii->ni", ours.cov))
    off = (ours.cov - theirs.cov) / (scale[:, :, None] * scale[:, None, :])
    assert np.abs(off).max() < 1e-3


def test_figures(table):
    """RMSE (m) of the position, and that every axis knows how far off it is."""
    rows = {row.name: row for row in table.rows}
    assert rows["ekf"].rmse == pytest.approx(0.0268, abs=3e-4)
    assert rows["batch"].rmse == pytest.approx(0.0197, abs=2e-4)
    assert rows["batch"].axes.names == ("x", "y", "z", "rotation x", "rotation y", "rotation z")
    for row in table.rows:
        assert (row.axes.inside() > 0.96).all()
        assert 0.8 < row.axes.nees_per_axis() < 1.6


def test_noise_as_stated_is_overconfident(night):
    """The reason for wider noise: errors that readings share, taken for independent."""
    stated = night.build(dict.fromkeys(("turn", "move", "pixels"), 1.0))
    table = compare(dataclasses.replace(night, model=stated), ("ekf", "batch"), lags=())
    before, after = table.rows
    assert before.axes.nees_per_axis() > 4
    assert after.axes.nees_per_axis() > 5
    assert after.axes.inside().min() < 0.8
    assert before.nis.mean < 1, "the innovations say the opposite"
    assert any("off together" in reason for reason in table.bought.why)


def test_points_of_a_picture_are_off_together(data_dir):
    """Without the truth: both rows of a pair carry one error of 11 px, and differ by 2."""
    import scipy.io

    raw = scipy.io.loadmat(data_dir / "robot" / "barfoot" / "dataset3.mat")
    rows = raw["y_k_j"][:, raw["y_k_j"][0] >= 0]
    assert (rows[1] - rows[3]).std() < 2.0
    assert np.sqrt(raw["y_var"].ravel()[[1, 3]]).min() > 11.0


def test_every_axis_is_told(table, night):
    told = document((table,), "factorlab compare starry_night")["estimators"]["batch"]["axes"]
    assert told["rotation y"]["unit"] == "rad"
    assert 0.7 < told["rotation y"]["inside_3sigma"] < 1.0
    assert 0.0 < told["x"]["rmse"] < 0.02
    text = "\n".join(terminal(table))
    assert "rotation z" in text
    assert "inside ±3σ" in text


def test_isam2_says_why_not(night):
    with pytest.raises(ModelError, match="one Gauss-Newton step an update"):
        run(IncrementalGraph(), night.model, night.log)


def test_a_missing_file_is_a_sentence(tmp_path):
    with pytest.raises(DataError, match=r"dataset3\.mat.*FACTORLAB_DATA"):
        load("starry_night", data=tmp_path)
