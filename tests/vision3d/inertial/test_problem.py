"""Residuals with their Jacobians, and normal equations with an arrow against dense ones."""

from dataclasses import replace

import numpy as np
import pytest
from cam_imu_worlds import recorded

from vision3d.inertial.adjust import BiasWalk, adjust, freedoms, normal_equations
from vision3d.inertial.banded import FREE, Solved
from vision3d.inertial.grid import Grid
from vision3d.inertial.problem import Problem
from vision3d.inertial.state import Constants, State

WALK = BiasWalk(2e-5, 3e-4)
ORDER = 6


def world_at(rng, constants, seconds=6.0):
    """A problem in two stretches, and a state near its truth."""
    world = recorded(3, seconds=seconds)
    grid = Grid.over([(0.1, 2.4), (3.0, 5.8)], 0.12, ORDER, 2.0)
    imu = world.imu.select(grid.inside(world.imu.t))
    corners = world.corners.select(grid.inside(world.corners.t + world.rig.time_offset_s, 0.02))
    pose = world.motion.pose(grid.centres - world.rig.time_offset_s)
    gains = np.eye(3) + 0.02 * rng.normal(size=(2, 3, 3))
    state = State(
        grid, pose[:, :4], pose[:, 4:], world.rig.camera_T_imu, world.rig.time_offset_s, world.motion.gravity,
        0.01 * rng.normal(size=(grid.nodes, 3)), 0.1 * rng.normal(size=(grid.nodes, 3)), gains[0], gains[1],
    )  # fmt: skip
    n, c = len(imu.t), len(corners.frame)
    problem = Problem(
        world.rig.camera, corners, imu, constants, 0.002, 0.02, 1.0,
        rng.uniform(0.5, 1.0, n), rng.uniform(0.5, 1.0, n), rng.uniform(0.5, 1.0, c),
    )  # fmt: skip
    return problem, state


def direction(rng, state, constants):
    scale = np.concatenate([np.full(6, 0.1), [1e-3], np.full(constants.count - 7, 0.1)])
    return Solved(
        rng.normal(size=(state.grid.count, 6)) * [1.0, 1.0, 1.0, 0.1, 0.1, 0.1],
        rng.normal(size=constants.count) * scale,
        rng.normal(size=(state.grid.nodes, 6)),
    )


EVERY = [Constants("calibrated"), Constants("scale"), Constants("scale-misalignment", board_scale=True)]


@pytest.mark.parametrize("constants", EVERY, ids=lambda one: one.imu_model)
def test_inertial_jacobians_meet_differences(constants, rng):
    problem, state = world_at(rng, constants)
    linear = problem.linear(state)
    h = 1e-6
    for _ in range(3):
        push = direction(rng, state, constants)
        plus, minus = (problem.linear(state.moved(push, constants, sign * h)) for sign in (1, -1))
        for name in ("gyro", "accel"):
            expected = (getattr(plus, name).e - getattr(minus, name).e) / (2 * h)
            own = getattr(linear, name).applied(push.controls, push.constants, push.nodes, ORDER)
            np.testing.assert_allclose(own, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("constants", EVERY, ids=lambda one: one.imu_model)
def test_condensed_frames_carry_gradient_and_curvature_of_their_corners(constants, rng):
    problem, state = world_at(rng, constants)
    linear = problem.linear(state)
    h = 1e-6
    weight = problem.corner_weight[:, None] / (problem.corner_scale * problem.corners.sigma_px[:, None]) ** 2
    for _ in range(3):
        push = direction(rng, state, constants)
        plus, minus = (problem.linear(state.moved(push, constants, sign * h)) for sign in (1, -1))
        moved = (plus.residuals_px - minus.residuals_px) / (2 * h)
        own = linear.frames.applied(push.controls, push.constants, push.nodes, ORDER)
        assert np.sum(own**2) == pytest.approx(np.sum(weight * moved**2), rel=1e-6)
        expected = np.sum(weight * moved * linear.residuals_px)
        size = np.sqrt(np.sum(own**2) * np.sum(linear.frames.e**2))
        assert abs(np.sum(own * linear.frames.e) - expected) < 1e-7 * size


@pytest.mark.parametrize("constants", [EVERY[0], EVERY[2]], ids=lambda one: one.imu_model)
def test_the_arrow_is_the_dense_system(constants, rng):
    problem, state = world_at(rng, constants, seconds=6.0)
    linear = problem.linear(state)
    system = normal_equations(problem, state, linear, WALK)
    K, q, B = state.grid.count, constants.count, state.grid.nodes
    size = 6 * K + q + 6 * B
    rows, errors = [], []
    for one in (linear.gyro, linear.accel, linear.frames):
        root = np.sqrt(one.weight)[:, None]
        J = np.zeros((*one.e.shape, size))
        for n in range(len(one.e)):
            first, node = 6 * one.at.first[n], 6 * K + q + 6 * one.at.node[n]
            J[n][:, first : first + 6 * ORDER] = one.J[n, :, : 6 * ORDER]
            J[n][:, 6 * K : 6 * K + q] = one.J[n, :, 6 * ORDER : 6 * ORDER + q]
            J[n][:, node : node + 12] = one.J[n, :, 6 * ORDER + q :]
        rows.append((root[..., None] * J).reshape(-1, size))
        errors.append((root * one.e).ravel())
    J, e = np.concatenate(rows), np.concatenate(errors)
    H, g = J.T @ J, J.T @ e
    prior, gradient, _ = WALK.prior(state, q)
    H[6 * K :, 6 * K :] += prior
    g[6 * K :] += gradient
    controls = np.arange(6 * K)
    H[controls, controls] += np.maximum(FREE, 1e-12 * H[controls, controls])
    system.factor()
    step = system.solve()
    expected = -np.linalg.solve(H, g)
    np.testing.assert_allclose(step.controls.ravel(), expected[: 6 * K], atol=1e-6 * np.abs(expected).max())
    np.testing.assert_allclose(step.constants, expected[6 * K : 6 * K + q], rtol=1e-5, atol=1e-7)
    covariance = np.linalg.inv(H)[6 * K :, 6 * K :]
    spread = np.sqrt(np.outer(np.diagonal(covariance), np.diagonal(covariance)))
    assert np.abs((system.border_cov - covariance) / spread).max() < 1e-5
    hat = np.linalg.inv(H)
    adjusted = adjust(problem, state, WALK, iterations=0)
    used = freedoms(adjusted, probes=60)
    begin = 0
    for one, found in zip((linear.gyro, linear.accel, linear.frames), used, strict=True):
        own = J[begin : begin + one.e.size]
        begin += one.e.size
        exact = np.sum((own @ hat) * own)
        assert found == pytest.approx(exact, rel=0.05)


def test_a_step_and_back_is_where_one_was(rng):
    constants = EVERY[2]
    _, state = world_at(rng, constants)
    push = direction(rng, state, constants)
    there = state.moved(push, constants, 1e-3)
    assert np.linalg.norm(there.gravity) == pytest.approx(np.linalg.norm(state.gravity))
    back = there.moved(push, constants, -1e-3)
    np.testing.assert_allclose(back.positions, state.positions, atol=1e-15)
    np.testing.assert_allclose(back.rotations, state.rotations, atol=1e-12)
    np.testing.assert_allclose(back.gyro_matrix, state.gyro_matrix, atol=1e-15)
    assert back.board_scale == pytest.approx(state.board_scale)


def test_a_grid_knows_its_stretches():
    grid = Grid.over([(0.0, 1.0), (2.0, 2.5)], 0.1, 6, 1.0)
    assert grid.count == 10 + 5 + 5 + 5
    at = grid.locate(np.array([0.0, 0.55, 1.0, 2.0, 2.5]))
    np.testing.assert_array_equal(at.first, [0, 5, 9, 15, 19])
    np.testing.assert_allclose(at.u, [0.0, 0.5, 1.0, 0.0, 1.0], atol=1e-9)
    np.testing.assert_array_equal(grid.inside(np.array([-0.1, 0.5, 1.5, 2.2])), [False, True, False, True])
    assert replace(at).u is at.u
