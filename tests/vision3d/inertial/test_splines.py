"""Weights of uniform B-splines, and the rotation spline with its derivatives."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from sequential.manifold import SO3
from sequential.manifold.quaternion import quaternion_from_matrix, rotation_matrix
from vision3d.inertial.basis import cumulative_weights, weights
from vision3d.inertial.rotation_spline import turning, turning_only


@pytest.mark.parametrize("order", [3, 4, 5, 6])
@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_weights_are_those_of_scipy(order, derivative, rng):
    u = rng.uniform(0.0, 1.0, 20)
    knots = np.arange(-order + 1, order + 1, dtype=float)
    for j in range(order):
        coefficients = np.zeros(order)
        coefficients[j] = 1.0
        spline = BSpline(knots, coefficients, order - 1)
        expected = spline.derivative(derivative)(u) if derivative else spline(u)
        np.testing.assert_allclose(weights(order, u, derivative)[:, j], expected, atol=1e-12)


def test_cumulative_weights_are_sums_from_the_end(rng):
    u = rng.uniform(0.0, 1.0, 9)
    own = weights(6, u)
    np.testing.assert_allclose(own.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(cumulative_weights(6, u)[:, 0], 1.0 - own[:, 0], atol=1e-14)
    np.testing.assert_allclose(cumulative_weights(6, u)[:, -1], own[:, -1], atol=1e-14)


@pytest.fixture
def spline(rng):
    order, count = 6, 12
    controls = [SO3().identity()]
    for _ in range(count - 1):
        controls.append(SO3().retract(controls[-1], rng.normal(0.0, 0.3, 3)))
    first = rng.integers(0, count - order + 1, 15)
    return np.array(controls), first, rng.uniform(0.05, 0.95, 15), np.full(15, 0.07), order


def test_rate_is_the_derivative_of_the_rotation(spline):
    controls, first, u, step, order = spline
    R, rate = turning_only(controls, first, u, step, order)
    h = 1e-6
    ahead, behind = (
        quaternion_from_matrix(turning_only(controls, first, u + sign * h, step, order)[0])
        for sign in (1, -1)
    )
    np.testing.assert_allclose(rate, SO3().local(behind, ahead) / (2 * h * step[:, None]), atol=1e-6)
    np.testing.assert_allclose(R @ np.swapaxes(R, 1, 2), np.broadcast_to(np.eye(3), R.shape), atol=1e-12)


def test_jacobians_meet_differences(spline, rng):
    controls, first, u, step, order = spline
    found = turning(controls, first, u, step, order)
    np.testing.assert_allclose(found.R, turning_only(*spline)[0], atol=1e-13)
    np.testing.assert_allclose(found.rate, turning_only(*spline)[1], atol=1e-12)
    h = 1e-6
    for _ in range(4):
        push = rng.normal(size=(len(controls), 3))
        plus, minus = (
            turning_only(SO3().retract(controls, sign * h * push), first, u, step, order) for sign in (1, -1)
        )
        near = push[first[:, None] + np.arange(order)]
        rotation = SO3().local(quaternion_from_matrix(minus[0]), quaternion_from_matrix(plus[0])) / (2 * h)
        np.testing.assert_allclose(np.einsum("nkij,nkj->ni", found.d_R, near), rotation, atol=1e-7)
        rate = (plus[1] - minus[1]) / (2 * h)
        np.testing.assert_allclose(np.einsum("nkij,nkj->ni", found.d_rate, near), rate, atol=1e-5)


def test_equal_steps_turn_at_a_constant_rate():
    turn = np.array([0.02, -0.01, 0.03])
    controls = [SO3().identity()]
    for _ in range(9):
        controls.append(SO3().retract(controls[-1], turn))
    first = np.array([0, 1, 3])
    _, rate = turning_only(np.array(controls), first, np.array([0.1, 0.5, 0.9]), np.full(3, 0.1), 6)
    np.testing.assert_allclose(rate, np.tile(turn / 0.1, (3, 1)), atol=1e-12)
    assert rotation_matrix(SO3().identity()).shape == (3, 3)
