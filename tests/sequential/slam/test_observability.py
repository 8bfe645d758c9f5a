"""Why the plain filter is overconfident: it claims to see a turn of the world, and the repairs do not."""

import numpy as np
import pytest
from slam_worlds import loops

from sequential.errors import ModelError
from sequential.manifold import SE2, SE3, Vector
from sequential.slam import EkfSlam, Factors, SlamProblem
from sequential.slam.models import Between, Displacement, Prior
from sequential.slam.observability import WorldWatch, claimed_heading, free_directions


def test_measurements_leave_the_world_free_in_three_directions(rng):
    world = loops(rng, steps=20, landmarks=6, turns=0.5)
    assert free_directions(world.problem, EkfSlam().solve(world.problem)) == 3


def test_in_space_there_are_six(rng):
    se3 = SE3()
    poses, points = se3.random(rng, 1.0, (4,)), rng.standard_normal((5, 3))
    index = np.stack(np.meshgrid(np.arange(4), np.arange(5), indexing="ij"), -1).reshape(-1, 2)
    seen = Displacement(se3).expected(poses[index[:, 0]], points[index[:, 1]])
    moves = np.stack([np.arange(3), np.arange(1, 4)], 1)
    problem = SlamProblem(
        {"x": se3, "l": Vector(3)},
        (
            Factors(Prior(se3), ("x",), [[0]], poses[:1], 1e-4),
            Factors(Between(se3), ("x", "x"), moves, Between(se3).expected(poses[:-1], poses[1:]), 1e-4),
            Factors(Displacement(se3), ("x", "l"), index, seen, 1e-4),
        ),
    )
    assert free_directions(problem, EkfSlam().solve(problem)) == 6


def test_only_the_plain_filter_gains_heading_from_nothing(rng):
    world = loops(rng, scale=1.5)
    assert claimed_heading(world.problem).lost > 1.1
    for linearisation in ("first_estimates", "invariant"):
        claim = claimed_heading(world.problem, EkfSlam(linearisation))
        assert claim.lost == pytest.approx(1.0, abs=1e-9)
        assert "never claimed better" in str(claim)


def test_the_plain_filter_says_so(rng):
    told = str(claimed_heading(loops(rng, scale=1.5).problem))
    assert "nothing measures the heading of the world" in told
    assert "times better" in told


def test_an_absolute_sensor_may_be_claimed(rng):
    """A compass on the way is seen as information about the whole."""
    world = loops(rng, steps=40, turns=1.0)
    fix = Factors(Prior(SE2()), ("x",), [[30]], world.poses[30:31], 1e-6)
    problem = SlamProblem(world.problem.kinds, (*world.problem.factors, fix))
    assert claimed_heading(problem, EkfSlam("invariant")).lost > 2.0


def test_what_is_watched_starts_with_the_prior(rng):
    world = loops(rng, steps=5)
    watch = WorldWatch(world.problem)
    EkfSlam(watch=watch).solve(world.problem)
    assert watch.heading_sigma()[0] == pytest.approx(0.01, rel=1e-9)
    assert watch.steps == [0, 1, 2, 3, 4]


def test_without_a_world_there_is_nothing_to_claim():
    v = Vector(2)
    problem = SlamProblem({"x": v}, (Factors(Between(v), ("x", "x"), [[0, 1]], np.zeros((1, 2)), 1.0),))
    with pytest.raises(ModelError, match="no moving kind"):
        claimed_heading(problem)
