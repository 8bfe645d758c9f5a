"""The starry night without its map: what the problem holds, and what estimators make of it."""

import numpy as np
import pytest

from factorlab.datasets import load_slam
from factorlab.graph.slam import BatchSlam
from sequential.evaluate import umeyama
from sequential.slam import check_factor_model
from sequential.slam.models import StereoProjection


@pytest.fixture(scope="module")
def night(data_dir):
    (dataset,) = load_slam("starry_night", data=data_dir / "robot" / "barfoot")
    return dataset


@pytest.fixture(scope="module")
def solved(night):
    return BatchSlam().solve(night.problem)


def test_counts(night):
    start, steps, sight = night.problem.factors
    assert (len(start), len(steps), len(sight)) == (1, 1777, 9345)
    assert len(night.problem.indices("x")) == len(night.truth) == 1778
    assert sorted(night.landmarks) == night.problem.indices("l").tolist() == list(range(20))
    assert night.problem.start is None, "points and poses are placed by readings alone"


def test_the_points_fit_the_truth(night):
    """At the true poses and points the columns have the variances that the file states; the row has twice
    that of a mean of two independent ones, because both carry the same error."""
    sight = night.problem.factors[2]
    assert isinstance(sight.model, StereoProjection)
    poses = np.hstack([night.truth.quaternion, night.truth.position])[sight.index[:, 0]]
    points = np.stack([night.landmarks[i] for i in sight.index[:, 1]])
    errors = sight.model.errors(sight.z, poses, points)
    np.testing.assert_allclose(errors.var(axis=0) / np.diag(sight.noise_cov), [1.0, 1.0, 2.0], rtol=0.03)
    check_factor_model(sight.model, sight.z[:50], poses[:50], points[:50])


def test_a_batch_finds_way_and_map(night, solved):
    """Not aligned: 24 mm RMSE of the way, 29 mm of the map."""
    off = solved.values.rows["x"][:, 4:] - night.truth.position
    assert np.sqrt((off**2).sum(axis=1).mean()) == pytest.approx(0.0237, abs=5e-4)
    gap = solved.values.rows["l"] - np.stack([night.landmarks[i] for i in solved.values.index["l"]])
    assert np.sqrt((gap**2).sum(axis=1).mean()) == pytest.approx(0.0294, abs=5e-4)
    assert solved.report.details["chi2"] == pytest.approx(2652.1, rel=1e-3)


def test_the_map_is_a_map(night, solved):
    """Aligned, points lie within 2 cm of the surveyed ones: the rest is the first pose's."""
    points = solved.values.rows["l"]
    surveyed = np.stack([night.landmarks[i] for i in solved.values.index["l"]])
    rotation, translation, _ = umeyama(points, surveyed)
    gap = points @ rotation.T + translation - surveyed
    assert np.sqrt((gap**2).sum(axis=1).mean()) < 0.02
