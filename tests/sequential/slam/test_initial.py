"""Where a pose graph begins: exact without noise, equal to GTSAM's, near the truth with noise."""

import gtsam
import numpy as np
import pytest
from graph_files import BOTH, looped

from sequential.errors import ModelError, UnderConstrainedError
from sequential.manifold import SE2, SE3, rotation_matrix
from sequential.slam import Factors, SlamProblem
from sequential.slam.initial import METHODS, initial_poses, lago_headings, links_of
from sequential.slam.models import Between, Displacement, Prior

CASES = [(m, name) for m in BOTH for name in METHODS if not (name == "lago" and m == SE3())]


@pytest.mark.parametrize(("manifold", "method"), CASES, ids=str)
def test_without_noise_every_start_is_the_truth(manifold, method, rng):
    problem, truth = looped(manifold, rng, count=60, sigma=1e-9)
    start = initial_poses(problem, method)
    assert start.index["x"].tolist() == list(range(60))
    np.testing.assert_allclose(manifold.local(truth, start.rows["x"]), 0, atol=2e-6)


@pytest.mark.parametrize(("manifold", "method"), CASES, ids=str)
def test_with_noise_relaxations_come_nearer_than_odometry(manifold, method, rng):
    problem, truth = looped(manifold, rng, count=150, loops=120, sigma=0.1)
    off = {
        name: np.abs(manifold.local(truth, initial_poses(problem, name).rows["x"])).mean()
        for name in (method, "odometry")
    }
    if method == "odometry":
        assert off["odometry"] > 0.1
    else:
        assert off[method] < (0.8 if method == "tree" else 0.4) * off["odometry"]


def native(problem, scale):
    """The same graph in GTSAM, all variances between poses times `scale`.

    GTSAM's own anchor is soft (variance 1e-8, or 1 in space), ours holds: a large scale makes them the same.
    """
    graph = gtsam.NonlinearFactorGraph()
    planar = problem.kinds["x"] == SE2()
    for group in problem.factors:
        for keys, z, cov in zip(group.index.tolist(), group.z, group.covs(), strict=True):
            noise = gtsam.noiseModel.Diagonal.Variances(np.diag(cov) * (scale if len(keys) > 1 else 1.0))
            pose = gtsam.Pose2(*z) if planar else gtsam.Pose3(gtsam.Rot3.Quaternion(*z[:4]), z[4:])
            kind = {(1, True): gtsam.PriorFactorPose2, (2, True): gtsam.BetweenFactorPose2,
                    (1, False): gtsam.PriorFactorPose3, (2, False): gtsam.BetweenFactorPose3}  # fmt: skip
            graph.add(kind[len(keys), planar](*keys, pose, noise))
    return graph


def test_planar_poses_are_those_of_gtsam(rng):
    # the same variance along x and y: gtsam weighs these along the axes of the world, however the body stands
    problem, _ = looped(SE2(), rng, count=80, loops=60, noise=np.diag([0.01, 0.01, 0.004]))
    theirs = gtsam.lago.initialize(native(problem, 1e4))
    ours = initial_poses(problem, "lago").rows["x"]
    other = np.array([[p.x(), p.y(), p.theta()] for p in map(theirs.atPose2, range(80))])
    np.testing.assert_allclose(SE2().local(other, ours), 0, atol=1e-6)


def test_rotations_are_those_of_gtsam(rng):
    problem, _ = looped(SE3(), rng, count=80, loops=60, sigma=0.1)
    theirs = gtsam.InitializePose3.initializeOrientations(native(problem, 1e16))
    ours = rotation_matrix(initial_poses(problem, "chordal").rows["x"][:, :4])
    other = np.stack([theirs.atRot3(k).matrix() for k in range(80)])
    np.testing.assert_allclose(ours, other, atol=1e-6)


def test_turns_are_counted_round_a_loop():
    """A circle of one whole turn: headings add up to 2π, which no wrapped heading tells."""
    count = 40
    index = np.column_stack([np.arange(count), np.roll(np.arange(count), -1)])
    step = np.tile([1.0, 0.0, 2 * np.pi / count + 0.01], (count, 1))
    problem = SlamProblem(
        {"x": SE2()},
        (
            Factors(Prior(SE2()), ("x",), [[0]], np.zeros((1, 3)), 1e-8),
            Factors(Between(SE2()), ("x", "x"), index, step, np.diag([0.1, 0.1, 0.01])),
        ),
    )
    heading = lago_headings(links_of(problem))
    np.testing.assert_allclose(np.unwrap(heading), 2 * np.pi / count * np.arange(count), atol=1e-9)


def test_what_cannot_be_begun_is_said(rng):
    problem, _ = looped(SE2(), rng)
    prior, odometry, _ = problem.factors
    with pytest.raises(ModelError, match="in the plane"):
        initial_poses(looped(SE3(), rng)[0], "lago")
    with pytest.raises(ModelError, match="come from lago, chordal"):
        initial_poses(problem, "magic")
    with pytest.raises(UnderConstrainedError, match="no prior tells any variable"):
        initial_poses(SlamProblem({"x": SE2()}, (odometry,)))
    broken = Factors(odometry.model, ("x", "x"), odometry.index[5:], odometry.z[5:], odometry.noise_cov)
    with pytest.raises(UnderConstrainedError, match=r"x5 the first.*2 pieces"):
        initial_poses(SlamProblem({"x": SE2()}, (prior, broken)))
    alone = Displacement(SE2())
    seen = Factors(alone, ("x", "l"), [[0, 0]], [[1.0, 2.0]], 0.1)
    with pytest.raises(ModelError, match="no factor measures one variable"):
        initial_poses(SlamProblem({"x": SE2(), "l": alone.measured}, (prior, seen)))
    with pytest.raises(ModelError, match="poses on SE2 or SE3 are needed"):
        initial_poses(SlamProblem({"x": SE2(), "l": alone.measured}, (prior, seen)), kind="l")
