"""Odometry gathered into steps: beside composing every sample, and beside a Monte Carlo."""

import numpy as np
import pytest

from sequential.errors import DataError, ShapeError
from sequential.log import Stream
from sequential.manifold import SE2
from sequential.slam.models.groups import between
from sequential.slam.wheel_steps import WheelNoise, nodes_at, wheel_steps

S = 1_000_000_000


def driven(rng, count=60):
    """Wheels that read every 0.1 s."""
    t = np.arange(count) * (S // 10)
    return Stream(t, np.column_stack([rng.uniform(0.0, 0.5, count), rng.uniform(-1.0, 1.0, count)]))


def composed(wheels, nodes, error=None):
    """Poses (K, 3) at the nodes, every sample's arc composed with an error of its own."""
    edges = np.unique(np.concatenate([wheels.t[(wheels.t > nodes[0]) & (wheels.t < nodes[-1])], nodes]))
    pose, poses, se2 = np.zeros(3), [], SE2()
    for k, now in enumerate(edges):
        if now in nodes:
            poses.append(pose)
        if k + 1 < len(edges):
            dt = (edges[k + 1] - now) * 1e-9
            row = np.searchsorted(wheels.t, now, side="right") - 1
            speed, rate = wheels.values[row] if row >= 0 else (0.0, 0.0)
            pose = se2.retract(pose, np.array([speed, 0.0, rate]) * dt)
            pose = pose if error is None else se2.retract(pose, error[k] * np.sqrt(dt))
    return np.array(poses)


def test_steps_are_the_samples_put_one_after_the_other(rng):
    wheels, nodes = driven(rng), np.array([0.03, 0.5, 0.52, 1.71, 5.9]) * S
    nodes = nodes.astype(np.int64)
    moves, covs = wheel_steps(wheels, nodes, WheelNoise(0.1, 0.1, 0.1))
    poses = composed(wheels, nodes)
    np.testing.assert_allclose(moves, between(SE2(), poses[:-1], poses[1:]), atol=1e-12)
    assert covs.shape == (4, 3, 3)


def test_before_the_first_sample_the_robot_stands(rng):
    wheels = driven(rng)
    moves, _ = wheel_steps(wheels, np.array([-2 * S, -S, 0]), WheelNoise(0.1, 0.1, 0.1))
    np.testing.assert_allclose(moves, 0.0, atol=1e-15)


def test_covariances_are_those_of_samples_with_errors(rng):
    wheels, nodes = driven(rng, 12), np.array([0, S])
    noise = WheelNoise(0.05, 0.02, 0.08)
    (move,), (cov,) = wheel_steps(wheels, nodes, noise)
    drawn = []
    for _ in range(3000):
        error = rng.standard_normal((20, 3)) * [noise.along, noise.across, noise.heading]
        drawn.append(SE2().local(move, composed(wheels, nodes, error)[1]))
    spread = np.cov(np.array(drawn).T)
    scale = np.sqrt(np.diag(cov))
    np.testing.assert_allclose(spread / np.outer(scale, scale), cov / np.outer(scale, scale), atol=0.1)


def test_slip_grows_with_the_way_and_the_turn():
    wheels = Stream(np.array([0, S]), np.array([[2.0, 0.0], [0.0, -0.5]]))
    _, covs = wheel_steps(wheels, np.array([0, S, 2 * S]), WheelNoise(0.0, 0.0, 0.0, slip=0.1, turn_slip=0.2))
    np.testing.assert_allclose(np.diag(covs[0]), [0.02, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(np.diag(covs[1]), [0.0, 0.0, 0.02], atol=1e-15)


def test_nodes_are_the_stamps_and_none_far_apart():
    nodes = nodes_at(np.array([3 * S, 3 * S, 4 * S]), S, 0.5)
    np.testing.assert_array_equal(nodes, np.array([10, 15, 20, 25, 30, 35, 40]) * S // 10)


def test_bad_odometry_is_named(rng):
    with pytest.raises(ShapeError, match="two columns"):
        wheel_steps(Stream(np.array([0, S]), np.zeros((2, 3))), np.array([0, S]), WheelNoise(1, 1, 1))
    with pytest.raises(DataError, match="two ascending times"):
        wheel_steps(driven(rng), np.array([0]), WheelNoise(1, 1, 1))
