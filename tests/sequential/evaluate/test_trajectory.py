"""Stamped poses at the door, and interpolation between them."""

import numpy as np
import pytest

from sequential.errors import DataError, NotFiniteError, ShapeError, TimeOrderError
from sequential.evaluate import Trajectory, interpolate
from sequential.manifold import SE3, quaternion_exp


def test_a_planar_trajectory_lies_in_the_plane():
    poses = Trajectory.planar([0.0, 1.0], [[1.0, 2.0], [3.0, 4.0]], [0.0, np.pi / 2])
    assert poses.position[:, 2].tolist() == [0.0, 0.0]
    np.testing.assert_allclose(poses.quaternion[1], [np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=1e-15)


def test_arrays_are_read_only_and_quaternions_canonical():
    poses = Trajectory([0.0], [[0.0, 0.0, 0.0]], [[-2.0, 0.0, 0.0, 0.0]])
    assert poses.quaternion.tolist() == [[1.0, 0.0, 0.0, 0.0]]
    for array in (poses.t, poses.position, poses.quaternion):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_interpolation_is_linear_and_turns_the_short_way():
    turn = np.array([0.0, 0.0, 3.0])
    poses = Trajectory([0, 10], [[0, 0, 0], [10, 20, 30]], quaternion_exp(np.outer([0.0, 1.0], turn)))
    between, covered = interpolate(poses, np.array([0, 3, 10]))
    assert covered.all()
    np.testing.assert_allclose(between.position, [[0, 0, 0], [3, 6, 9], [10, 20, 30]], atol=1e-12)
    np.testing.assert_allclose(between.quaternion[1], quaternion_exp(0.3 * turn), atol=1e-12)


def test_interpolation_reproduces_its_own_poses(rng):
    states = SE3().random(rng, shape=(20,))
    t = np.cumsum(rng.integers(1, 100, 20))
    t[7] = t[6]  # a repeated stamp, as real truth files have
    poses = Trajectory(t, states[:, 4:], states[:, :4])
    again, covered = interpolate(poses, t[8:])
    assert covered.all()
    np.testing.assert_allclose(again.position, poses.position[8:], atol=1e-12)


def test_times_outside_and_inside_long_pauses_are_not_covered():
    poses = Trajectory([0, 10, 1000], np.zeros((3, 3)))
    found, covered = interpolate(poses, np.array([-1, 5, 10, 500, 1000, 1001]), max_gap_ns=100)
    assert covered.tolist() == [False, True, True, False, True, False]
    assert found.t.tolist() == [5, 10, 1000]
    assert interpolate(poses, np.array([500]))[1].all()
    with pytest.raises(DataError, match="covers none of the 1 times asked for"):
        interpolate(poses, np.array([2000]))


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (([0, 1], np.zeros((3, 3))), ShapeError, r"2 stamps need positions of shape \(2, 3\), got \(3, 3\)"),
        (([0], [[0, 0, np.nan]]), NotFiniteError, "positions of pose 0 hold NaN or infinity .* drop"),
        (([0], np.zeros((1, 3)), [[0, 0, 0, 0]]), DataError, "quaternion of pose 0 is zero"),
        (
            ([0.0, 2.0, 1.0], np.zeros((3, 3))),
            TimeOrderError,
            "backwards at pose 2: 2.000000 s then 1.000000 s",
        ),
    ],
)
def test_what_is_not_a_trajectory_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        Trajectory(*arguments)
