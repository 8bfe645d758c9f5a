"""Our charts are GTSAM's: a filter covariance and a graph marginal may be compared entry by entry."""

import gtsam
import numpy as np
import pytest

from sequential.manifold import SE2, SE3, SO2, SO3, NavState, rotation_matrix

TOLERANCE = 1e-9


def to_rot3(x):
    return gtsam.Rot3.Quaternion(*x[:4])


def to_pose2(x):
    return gtsam.Pose2(*x)


def to_pose3(x):
    return gtsam.Pose3(to_rot3(x), x[4:])


def to_nav_state(x):
    return gtsam.NavState(to_rot3(x), x[4:7], x[7:])


def from_rot3(rotation):
    q = rotation.toQuaternion()
    wxyz = np.array([q.w(), q.x(), q.y(), q.z()])
    return wxyz if wxyz[0] >= 0.0 else -wxyz


def from_pose2(pose):
    return np.array([pose.x(), pose.y(), pose.theta()])


def from_pose3(pose):
    return np.concatenate([from_rot3(pose.rotation()), pose.translation()])


def from_nav_state(state):
    return np.concatenate([from_rot3(state.attitude()), state.position(), state.velocity()])


CHARTS = [
    pytest.param(SO2(), lambda x: gtsam.Rot2(x[0]), lambda r: np.array([r.theta()]), id="Rot2"),
    pytest.param(SO3(), to_rot3, from_rot3, id="Rot3"),
    pytest.param(SE2(), to_pose2, from_pose2, id="Pose2"),
    pytest.param(SE3(), to_pose3, from_pose3, id="Pose3"),
    pytest.param(NavState(), to_nav_state, from_nav_state, id="NavState"),
]


@pytest.mark.parametrize(("manifold", "to_gtsam", "from_gtsam"), CHARTS)
def test_retract_and_local_are_gtsams(manifold, to_gtsam, from_gtsam, rng):
    states = manifold.random(rng, shape=(100,))
    steps = rng.standard_normal((100, manifold.dim))
    moved, back = manifold.retract(states, steps), manifold.local(states[:-1], states[1:])
    for x, step, y in zip(states, steps, moved, strict=True):
        theirs = from_gtsam(to_gtsam(x).retract(step))
        np.testing.assert_allclose(y, theirs, rtol=0, atol=TOLERANCE)
    for x, y, step in zip(states[:-1], states[1:], back, strict=True):
        theirs = to_gtsam(x).localCoordinates(to_gtsam(y))
        np.testing.assert_allclose(step, theirs, rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize(("manifold", "to_gtsam", "from_gtsam"), CHARTS[2:4])
def test_transport_is_gtsams_adjoint_and_derivative(manifold, to_gtsam, from_gtsam, rng):
    for _ in range(100):
        x, y = manifold.random(rng), manifold.random(rng)
        carried, inverse_jacobian = manifold.transport(x, y)
        y_x = to_gtsam(y).inverse().compose(to_gtsam(x))
        np.testing.assert_allclose(carried, y_x.AdjointMap(), rtol=0, atol=TOLERANCE)
        derivative = type(y_x).ExpmapDerivative(manifold.local(x, y))
        np.testing.assert_allclose(inverse_jacobian, derivative, rtol=0, atol=TOLERANCE)


def test_quaternions_are_hamilton_scalar_first(rng):
    for q in SO3().random(rng, shape=(100,)):
        np.testing.assert_allclose(rotation_matrix(q), to_rot3(q).matrix(), rtol=0, atol=TOLERANCE)


def test_pose2_drives_along_an_arc():
    """A quarter turn over an arc of length pi/2 ends one radius ahead and one to the left."""
    end = SE2().retract(SE2().identity(), np.array([np.pi / 2, 0.0, np.pi / 2]))
    np.testing.assert_allclose(end, [1.0, 1.0, np.pi / 2], atol=1e-15)


def test_nav_state_moves_along_the_axes_it_had_before_the_step():
    facing_left = np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5), *[0.0] * 6])
    step = np.array([0.0, 0.0, 1.0, 2.0, 0.0, 0.0, 3.0, 0.0, 0.0])
    moved = NavState().retract(facing_left, step)
    np.testing.assert_allclose(moved[4:], [0.0, 2.0, 0.0, 0.0, 3.0, 0.0], atol=1e-15)
