"""EKF-SLAM with landmarks that no single reading places: one camera, kept poses."""

import numpy as np
import pytest
from planar_worlds import camera_tour

from sequential.manifold import SE2
from sequential.slam import EkfSlam, Factors, SlamProblem
from sequential.slam.beginnings import needs_several
from sequential.slam.models import Between, LandmarkRangeBearing, Prior

SIGMA = np.array([0.02, 0.005, 0.01])


def tour_by_odometry(rng, steps=25, points=25):
    """The camera's tour with odometry in the place of known poses."""
    world = camera_tour(rng, steps=steps, points=points)
    x, camera = world.poses, world.problem.factors[0]
    z = SE2().retract(Between(SE2()).expected(x[:-1], x[1:]), SIGMA * rng.standard_normal((steps - 1, 3)))
    index = np.column_stack([np.arange(steps - 1), np.arange(1, steps)])
    first = Factors(Prior(SE2()), ("x",), [[0]], x[:1], 1e-8)
    driven = Factors(Between(SE2()), ("x", "x"), index, z, SIGMA**2)
    return SlamProblem(world.problem.kinds, (first, driven, camera)), world


def normalised(run, x):
    error = SE2().local(run.online.mean, x)[1:]
    weighed = np.linalg.solve(run.online.cov[1:], error[..., None])[..., 0]
    return np.einsum("ni,ni->n", error, weighed).mean() / 3.0


def test_points_begin_by_several_views_and_hold_the_odometry(rng):
    problem, world = tour_by_odometry(rng)
    run = EkfSlam().solve(problem)
    assert len(run.values.index["l"]) > 0.5 * len(world.points)
    assert np.linalg.norm(run.online.mean[:, :2] - world.poses[:, :2], axis=1).max() < 0.4
    off = np.linalg.norm(run.values.rows["l"] - world.points[run.values.index["l"]], axis=1)
    spread = np.sqrt(np.trace(run.covs["l"], axis1=1, axis2=2))
    assert np.quantile(off / spread, 0.9) < 3.0


def test_with_one_pose_at_a_time_no_point_would_begin(rng):
    problem, _ = tour_by_odometry(rng, steps=8)
    run = EkfSlam(keep=1).solve(problem)
    assert "l" not in run.values.index
    assert "keep more poses" in run.report.message


@pytest.mark.slow
def test_it_is_honest_at_half_a_pixel():
    """Monte Carlo: the mean over runs of the normalised error of the poses is near one."""
    means = []
    for seed in range(5):
        problem, world = tour_by_odometry(np.random.default_rng(seed), steps=15, points=20)
        means.append(normalised(EkfSlam().solve(problem), world.poses))
    assert 0.4 < np.mean(means) < 2.0


def test_which_problems_need_several_views(rng):
    problem, world = tour_by_odometry(rng, steps=5)
    assert needs_several(problem)
    seen = Factors(LandmarkRangeBearing(), ("x", "l"), [[0, 0]], [[1.0, 0.0]], 0.1)
    from sequential.manifold import Vector

    assert not needs_several(SlamProblem({"x": SE2(), "l": Vector(2)}, (*problem.factors[:2], seen)))
    assert not needs_several(SlamProblem({"x": SE2()}, problem.factors[:2]))
    assert world.points.shape[1] == 3
