"""What nothing sees: found by trying, and the same whichever way it is asked."""

from dataclasses import replace

import numpy as np
import pytest
from slam_worlds import loops

from sequential.errors import ModelError
from sequential.manifold import SE2, SE3, Vector
from sequential.slam import Factors, SlamProblem
from sequential.slam.gauge import FRAME, POINT, STILL, VECTOR, act, directions, world_roles
from sequential.slam.models import Between, Displacement, Prior


def test_poses_are_frames_and_landmarks_points(rng):
    assert world_roles(loops(rng, steps=5).problem) == {"x": FRAME, "l": POINT}


def test_what_has_no_world_is_left_alone(rng):
    problem = loops(rng, steps=5).problem
    scale = Factors(Prior(Vector(2)), ("s",), [[0]], np.zeros((1, 2)), 1.0)
    with_scale = replace(problem, kinds=problem.kinds | {"s": Vector(2)}, factors=(*problem.factors, scale))
    assert world_roles(with_scale)["l"] == POINT


def test_a_problem_without_a_pose_is_refused():
    v = Vector(2)
    problem = SlamProblem({"x": v}, (Factors(Between(v), ("x", "x"), [[0, 1]], np.zeros((1, 2)), 1.0),))
    with pytest.raises(ModelError, match="no moving kind on SE2 or SE3"):
        world_roles(problem)


def test_three_dimensions_and_marker_frames():
    se3 = SE3()
    problem = SlamProblem(
        {"x": se3, "m": se3, "l": Vector(3)},
        (
            Factors(Between(se3), ("x", "m"), [[0, 0]], se3.identity()[None], 1.0),
            Factors(Displacement(se3), ("x", "l"), [[0, 0]], np.zeros((1, 3)), 1.0),
        ),
    )
    assert world_roles(problem) == {"x": FRAME, "m": FRAME, "l": POINT}


@pytest.mark.parametrize("rigid", [SE2(), SE3()], ids=repr)
@pytest.mark.parametrize("role", [FRAME, POINT, VECTOR, STILL])
def test_directions_are_the_derivative_of_the_motion(rng, rigid, role):
    axes = 2 if isinstance(rigid, SE2) else 3
    manifold = rigid if role == FRAME else Vector(axes)
    value = manifold.random(rng)
    found = directions(rigid, role, value, manifold.dim)
    for j in range(rigid.dim):
        step = np.zeros(rigid.dim)
        step[j] = 1e-6
        ahead, behind = (act(rigid, rigid.retract(rigid.identity(), s * step), role, value) for s in (1, -1))
        slope = (manifold.local(value, ahead) - manifold.local(value, behind)) / 2e-6
        np.testing.assert_allclose(found[:, j], slope, atol=1e-8)
