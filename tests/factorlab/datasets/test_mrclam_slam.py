"""MRCLAM without its map: what the problem holds, and how well both estimators solve it."""

import numpy as np
import pytest

from factorlab.datasets.mrclam_slam import load_mrclam_slam
from factorlab.graph.slam import BatchSlam
from sequential.manifold import SE2
from sequential.slam import EkfSlam, Factors, SlamProblem
from sequential.slam.ekf import filtered_start


def shortened(problem, steps):
    """The first steps of a problem."""
    groups = []
    for group, at in zip(problem.factors, problem.steps, strict=True):
        kept, noise = at < steps, np.asarray(group.noise_cov)
        groups.append(
            Factors(
                group.model,
                group.slots,
                np.asarray(group.index)[kept],
                np.asarray(group.z)[kept],
                noise[kept] if noise.ndim == 3 else noise,
                name=group.name,
                unknown=group.unknown,
            )
        )
    return SlamProblem(problem.kinds, tuple(groups), t=problem.t[:steps])


def position_rmse(dataset, run):
    rows, truth = dataset.truth.at(dataset.problem.t)
    error = run.values.rows["x"][rows, :2] - truth.position
    return np.sqrt(np.mean(np.sum(error**2, axis=1)))


def anees(dataset, run):
    rows, truth = dataset.truth.at(dataset.problem.t)
    poses = SE2().normalize(np.column_stack([truth.position, truth.heading]))
    error = SE2().local(run.values.rows["x"][rows], poses)
    squared = np.einsum("ni,nij,nj->n", error, np.linalg.inv(run.covs["x"][rows]), error)
    return squared.mean() / 3


def test_a_robot_is_one_problem(data_dir):
    (one,) = load_mrclam_slam(data_dir / "robot" / "mrclam7", robot=2)
    problem = one.problem
    assert len(problem.indices("l")) == 15
    assert len(one.landmarks) == 15
    assert len(problem.indices("x")) == len(problem.t)
    assert np.diff(problem.t).max() <= 0.5e9 + 1
    (hidden,) = load_mrclam_slam(data_dir / "robot" / "mrclam7", robot=2, hidden=True)
    assert not hidden.landmarks
    assert len(hidden.problem.indices("l")) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "bar"), [(1, 0.6), (2, 0.4)])
def test_the_batch_finds_the_posts(data_dir, robot, bar):
    """The aim of the comparison with the reference: 0.6 and 0.4 m, ANEES/3 of 2 at most."""
    (one,) = load_mrclam_slam(data_dir / "robot" / "mrclam7", robot)
    start = filtered_start(one.problem)
    run = BatchSlam(initial=start).solve(one.problem)
    assert position_rmse(one, run) < bar
    assert anees(one, run) < 2.0
    again = BatchSlam(initial=run.values, covariance=False).solve(one.problem)
    assert again.report.details["chi2"] == pytest.approx(run.report.details["chi2"], rel=1e-6)


@pytest.mark.slow
def test_posts_without_barcodes_are_told_apart(data_dir):
    (one,) = load_mrclam_slam(data_dir / "robot" / "mrclam7", 2, hidden=True)
    (known,) = load_mrclam_slam(data_dir / "robot" / "mrclam7", 2)
    problem = shortened(one.problem, 800)
    run = EkfSlam("invariant").solve(problem)
    ids = np.asarray(shortened(known.problem, 800).factors[-1].index)[:, 1]
    found = run.associations
    right = sum(np.bincount(ids[found == post]).max() for post in np.unique(found[found >= 0]))
    assert right / len(ids) > 0.85  # posts stand in groups, 18 cm apart
