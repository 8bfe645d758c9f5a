"""A start grown as measurements arrive is where iSAM2 ends, and better than dead reckoning."""

import numpy as np
import pytest
from planar_worlds import camera_tour, mounted_camera

from factorlab.graph.slam import BatchSlam, IncrementalSlam
from factorlab.graph.slam.growing import grown
from sequential.manifold import SE2, Vector
from sequential.slam import Factors, SlamProblem
from sequential.slam.models import Between, LandmarkRangeBearing, PlanarProjection, Prior


def loops(rng, steps=300, turn_noise=0.02):
    """Three rounds among landmarks, with odometry that loses its heading."""
    angle = 6.0 * np.pi * np.arange(steps) / steps
    x = SE2().normalize(np.column_stack([20.0 * np.sin(angle), 20.0 - 20.0 * np.cos(angle), angle]))
    place = rng.uniform(-25.0, 45.0, (25, 2)) * [1.0, 1.0]
    sigma = np.array([0.05, 0.02, turn_noise])
    z = Between(SE2()).expected(x[:-1], x[1:])
    driven = SE2().retract(z, sigma * rng.standard_normal((steps - 1, 3)))
    pose, who = np.nonzero(np.linalg.norm(x[:, None, :2] - place, axis=2) < 12.0)
    seen = LandmarkRangeBearing().expected(x[pose], place[who])
    seen = seen + [0.1, 0.01] * rng.standard_normal(seen.shape)
    steps_of = np.column_stack([np.arange(steps - 1), np.arange(1, steps)])
    return SlamProblem(
        {"x": SE2(), "l": Vector(2)},
        (
            Factors(Prior(SE2()), ("x",), [[0]], x[:1], 1e-6),
            Factors(Between(SE2()), ("x", "x"), steps_of, driven, sigma**2),
            Factors(LandmarkRangeBearing(), ("x", "l"), np.column_stack([pose, who]), seen, [1e-2, 1e-4]),
        ),
    )


def test_it_ends_where_isam2_ends(rng):
    problem = loops(rng)
    batch = BatchSlam("incremental", covariance=False).solve(problem)
    isam2 = IncrementalSlam(threshold=1e-3, covariance=False, online=False).solve(problem)
    assert batch.report.details["chi2"] == pytest.approx(isam2.report.details["chi2"], rel=1e-6)
    gap = SE2().local(batch.values.rows["x"], isam2.values.rows["x"])
    assert np.abs(gap).max() < 1e-3


def test_its_cost_is_never_above_that_of_dead_reckoning(rng):
    for noise in (0.05, 0.2):
        problem = loops(rng, turn_noise=noise)
        dead = BatchSlam("steps", covariance=False, check=False).solve(problem)
        better = BatchSlam("incremental", covariance=False, check=False).solve(problem)
        assert better.report.details["chi2"] <= dead.report.details["chi2"] * (1.0 + 1e-6)


def test_points_of_one_camera_and_poses_by_odometry_are_solved_together(rng):
    world = camera_tour(rng, steps=40)
    x = world.poses
    sigma = np.array([0.02, 0.005, 0.01])
    z = SE2().retract(Between(SE2()).expected(x[:-1], x[1:]), sigma * rng.standard_normal((39, 3)))
    camera = world.problem.factors[0]
    seen = np.unique(np.asarray(camera.index)[:, 1], return_counts=True)
    often = np.isin(np.asarray(camera.index)[:, 1], seen[0][seen[1] > 12])
    kept = Factors(camera.model, ("x", "l"), np.asarray(camera.index)[often], camera.z[often], 0.25)
    steps_of = np.column_stack([np.arange(39), np.arange(1, 40)])
    problem = SlamProblem(
        world.problem.kinds,
        (
            Factors(Prior(SE2()), ("x",), [[0]], x[:1], 1e-8),
            Factors(Between(SE2()), ("x", "x"), steps_of, z, sigma**2),
            kept,
        ),
    )
    values = grown(problem)
    off = np.linalg.norm(values.rows["x"][:, :2] - x[:, :2], axis=1)
    assert off.max() < 0.4  # the scale is the odometry's
    run = BatchSlam(values, covariance=False).solve(problem)
    freedom = 2 * len(kept) - 3 * len(values.index["l"])
    assert run.report.details["chi2"] < 1.3 * freedom


def test_a_fisheye_on_the_floor_has_no_native_factor():
    from factorlab.graph.slam import native_factor
    from vision3d.camera import Camera

    _, mount = mounted_camera()
    assert (
        native_factor(PlanarProjection(Camera("fisheye4", (300, 300, 320, 240), (0, 0, 0, 0)), mount)) is None
    )
