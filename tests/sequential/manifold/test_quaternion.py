"""Rotations: the same group whichever way it is written, accurate from zero to pi."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sequential.manifold import (
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_log,
    quaternion_multiply,
    quaternion_normalize,
    right_jacobian,
    right_jacobian_inverse,
    rotate,
    rotation_matrix,
    skew,
)

numbers = st.floats(-1.0, 1.0)
vectors = arrays(np.float64, 3, elements=numbers)
quaternions = (
    arrays(np.float64, 4, elements=numbers)
    .filter(lambda q: np.linalg.norm(q) > 1e-3)
    .map(quaternion_normalize)
)
sizes = st.sampled_from([1e-280, 1e-160, 1e-20, 1e-8, 1e-5, 1e-3, 0.1, 1.0])


def same_rotation(p, q, tolerance=1e-14):
    return min(np.abs(p - q).max(), np.abs(p + q).max()) <= tolerance


@given(quaternions, quaternions, vectors)
def test_product_of_quaternions_is_product_of_matrices(p, q, v):
    both = quaternion_multiply(p, q)
    np.testing.assert_allclose(rotation_matrix(both), rotation_matrix(p) @ rotation_matrix(q), atol=1e-14)
    np.testing.assert_allclose(rotate(both, v), rotate(p, rotate(q, v)), atol=1e-14)
    np.testing.assert_allclose(rotate(p, v), rotation_matrix(p) @ v, atol=1e-14)


@given(quaternions)
def test_inverse_undoes(q):
    np.testing.assert_allclose(quaternion_multiply(q, quaternion_inverse(q)), [1, 0, 0, 0], atol=1e-15)


@given(quaternions)
def test_matrix_is_a_rotation_and_leads_back(q):
    matrix = rotation_matrix(q)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    assert same_rotation(quaternion_from_matrix(matrix), q)


@given(quaternions)
def test_log_ignores_sign_and_length(q):
    np.testing.assert_allclose(quaternion_log(3.0 * q), quaternion_log(q), rtol=1e-14, atol=0)
    assert same_rotation(quaternion_exp(quaternion_log(-q)), q)
    assert np.linalg.norm(quaternion_log(q)) <= np.pi + 1e-15


@given(vectors.filter(lambda v: np.linalg.norm(v) > 0.1), sizes)
def test_log_undoes_exp_with_full_relative_accuracy(direction, size):
    phi = size * direction
    np.testing.assert_allclose(quaternion_log(quaternion_exp(phi)), phi, rtol=1e-14, atol=1e-300)


@given(vectors.filter(lambda v: np.linalg.norm(v) > 0.1), st.sampled_from([0.0, 1e-15, 1e-9, 1e-4, 0.1]))
def test_log_undoes_exp_near_pi(direction, gap):
    phi = (np.pi - gap) * direction / np.linalg.norm(direction)
    back = quaternion_log(quaternion_exp(phi))
    # at pi itself the two signs mean one rotation
    assert min(np.abs(back - phi).max(), np.abs(back + phi).max() + 1e3 * gap) <= 2e-15


@given(vectors)
def test_right_jacobians_invert_each_other(direction):
    phi = np.pi * direction
    np.testing.assert_allclose(right_jacobian(phi) @ right_jacobian_inverse(phi), np.eye(3), atol=1e-12)


@given(vectors, st.sampled_from([1e-9, 1e-3, 0.3, 1.0, 3.0]))
def test_right_jacobian_is_the_derivative_of_exp(direction, size):
    phi, h = size * direction, 1e-5
    back = quaternion_inverse(quaternion_exp(phi))
    ends = [[quaternion_exp(phi + sign * h * axis) for axis in np.eye(3)] for sign in (1.0, -1.0)]
    ahead, behind = quaternion_log(quaternion_multiply(back, np.array(ends)))
    np.testing.assert_allclose(right_jacobian(phi), (ahead - behind).T / (2.0 * h), atol=1e-9)


@given(vectors, vectors)
def test_skew_is_the_cross_product(u, v):
    np.testing.assert_allclose(skew(u) @ v, np.cross(u, v), atol=1e-15)


def test_quarter_turn_about_z_takes_x_to_y():
    q = quaternion_exp(np.array([0.0, 0.0, np.pi / 2]))
    np.testing.assert_allclose(rotate(q, np.array([1.0, 0.0, 0.0])), [0.0, 1.0, 0.0], atol=1e-15)


@pytest.mark.parametrize("axis", np.eye(3))
def test_half_turns_from_matrices(axis):
    """Half turns have qw = 0: the case where a naive conversion divides by zero."""
    half_turn = 2.0 * np.outer(axis, axis) - np.eye(3)
    assert same_rotation(quaternion_from_matrix(half_turn), np.array([0.0, *axis]))


def test_functions_broadcast(rng):
    q, v = quaternion_exp(rng.standard_normal((5, 1, 3))), rng.standard_normal((4, 3))
    assert rotate(q, v).shape == (5, 4, 3)
    assert quaternion_multiply(q, q[:, 0]).shape == (5, 5, 4)
    matrices = rotation_matrix(q)
    assert matrices.shape == (5, 1, 3, 3)
    assert quaternion_from_matrix(matrices).shape == q.shape
    assert right_jacobian(v).shape == right_jacobian_inverse(v).shape == skew(v).shape == (4, 3, 3)
