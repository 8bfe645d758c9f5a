"""MRCLAM 7: what is in it, how well a robot is placed, and what each part of the model is good for."""

import numpy as np
import pytest

from factorlab.datasets import load
from sequential import SE2, ExtendedKalmanFilter, IteratedSmoother, run
from sequential.errors import DataError


@pytest.fixture(scope="module", params=[1, 2])
def robot(request, data_dir):
    (dataset,) = load("mrclam", data=data_dir / "robot" / "mrclam7", robot=request.param)
    return dataset


def _score(dataset, result):
    """Position RMSE (m) and mean normalised pose error over 3, without alignment."""
    rows, truth = dataset.truth.at(result.t)
    error = dataset.positions(result)[rows] - truth.position
    pose, manifold = SE2(), result.manifold
    recorded = pose.normalize(np.column_stack([truth.position, truth.heading]))
    e = pose.local(result.part("pose")[rows], recorded)
    tangent = manifold.tangent("pose")
    cov = result.cov[rows][:, tangent, tangent]
    nees = np.einsum("ni,nij,nj->n", e, np.linalg.inv(cov), e)
    return np.sqrt((error**2).sum(axis=1).mean()), nees.mean() / 3


def test_counts(robot):
    seen = {"mrclam-robot1": 2578, "mrclam-robot2": 3818}[robot.name]
    ignored = {"mrclam-robot1": 650, "mrclam-robot2": 700}[robot.name]
    assert len(robot.log["sighting"]) == seen
    assert any(f"{ignored} sightings of other robots ignored" in note for note in robot.notes)
    assert robot.log["sighting"].context.max() <= 14
    assert robot.log["odometry"].covers == "after"


def test_pauses_of_the_odometry_are_held(robot):
    """Up to 1.03 s in the files, which would count as a gap."""
    assert np.diff(robot.log["odometry"].t).max() <= 0.5e9


def test_moments_far_from_vicon_are_not_scored(robot):
    stamps = robot.truth.t
    pause = int(np.argmax(np.diff(stamps)))
    middle = (stamps[pause] + stamps[pause + 1]) // 2
    rows, _ = robot.truth.at(np.array([stamps[pause], middle]))
    np.testing.assert_array_equal(rows, [0])


def test_smoother(robot):
    """One setting for both robots; the bounds of the project are 0.105 and 0.125 m."""
    result = run(IteratedSmoother(), robot.model, robot.log)
    rmse, anees = _score(robot, result)
    assert rmse < 0.045
    assert 0.7 < anees < 1.5
    assert result.report.converged
    camera, scale = result.part("camera")[-1], result.part("range_scale")[-1]
    assert np.abs(camera).max() < 0.06
    assert 0.01 < scale < 0.06


def test_filter(robot):
    rmse, anees = _score(robot, run(ExtendedKalmanFilter(), robot.model, robot.log))
    assert rmse < 0.08
    assert 0.7 < anees < 1.5


def test_the_recorded_range_is_a_depth(robot):
    """Dividing it by the cosine of the bearing makes the innovations far likelier; no truth is needed."""
    seen = robot.log["sighting"]
    raw = seen.values * np.column_stack([np.cos(seen.values[:, 1]), np.ones(len(seen))])
    as_recorded = robot.log.replaced(sighting=type(seen)(seen.t, raw, seen.context))
    ours, theirs = (run(ExtendedKalmanFilter(), robot.model, log) for log in (robot.log, as_recorded))
    assert ours.log_likelihood > theirs.log_likelihood + 1000


def test_all_robots_or_one(data_dir):
    folder = data_dir / "robot" / "mrclam7"
    assert [d.name for d in load("mrclam", data=folder)] == ["mrclam-robot1", "mrclam-robot2"]
    with pytest.raises(DataError, match="holds robots 1, 2 of MRCLAM, not robot 4"):
        load("mrclam", data=folder, robot=4)


@pytest.mark.parametrize("given", [None, "elsewhere"])
def test_a_missing_folder_is_a_sentence(given, tmp_path, monkeypatch):
    monkeypatch.delenv("FACTORLAB_DATA", raising=False)
    data = None if given is None else tmp_path / given
    with pytest.raises(DataError, match=r"Landmark_Groundtruth.*set FACTORLAB_DATA.*utoronto"):
        load("mrclam", data=data)
