"""The derivatives in the error-state filter meet differences of the models that they stand for."""

import numpy as np
import pytest

from sequential.attitude import attitude_from_angles
from sequential.attitude import error_state_layout as at
from sequential.attitude.error_state_heading_kernel import look
from sequential.attitude.error_state_tilt_kernel import absorb, propagate_tilt
from sequential.manifold.quaternion import quaternion_exp, rotate

DT, PULL = 0.05, 9.7
TURNED = np.column_stack([rotate(attitude_from_angles([0.4, -0.7, 2.0]), e) for e in np.eye(3)])


def moved(x):
    """Rotation, bias, velocity and position errors a block later, by the model itself."""
    theta, bias, velocity, position = x[:3], x[3:6], x[6:8], x[8:]
    force = rotate(quaternion_exp(theta), np.array([0.0, 0.0, PULL]))[:2]
    return np.concatenate(
        [
            theta - DT * TURNED @ bias,
            bias,
            velocity + DT * force,
            position + DT * velocity + 0.5 * DT**2 * force,
        ]
    )


def slope(function, at_point):
    h = 1e-6
    steps = h * np.eye(len(at_point))
    return np.column_stack([(function(at_point + e) - function(at_point - e)) / (2 * h) for e in steps])


def test_the_covariance_moves_as_the_errors_do(rng):
    root = rng.normal(size=(at.ERRORS, at.ERRORS))
    before = root @ root.T
    state = np.zeros(at.STATE)
    state[at.P : at.P + at.ERRORS**2] = before.ravel()
    state[at.TURNED : at.TURNED + 9] = 4 * TURNED.ravel()
    propagate_tilt(state, DT, PULL, 0.25)
    transition = slope(moved, np.zeros(at.ERRORS))
    after = state[at.P : at.P + at.ERRORS**2].reshape(at.ERRORS, at.ERRORS)
    np.testing.assert_allclose(after, transition @ before @ transition.T, rtol=1e-7, atol=1e-7)


NOMINAL = np.array([0.3, 0.4, -0.9, 0.01, -0.02, 0.015, 0.012])  # heading, north, up, iron, delay
FIELD, RATE = np.array([-0.1, 0.4, -0.88]), np.array([1.0, -2.0, 0.7])


def looked(nominal, axis):
    """Innovation of one component, and the row that the filter takes for minus its slope."""
    c, d = np.cos(nominal[0]), np.sin(nominal[0])
    about = np.array([[c, -d, 0.0], [d, c, 0.0], [0.0, 0.0, 1.0]])
    state = np.zeros(at.STATE)
    state[at.DELTA : at.DELTA + 7] = nominal
    state[at.TURNED : at.TURNED + 9] = 3 * TURNED.ravel()
    state[at.SAMPLES] = 3
    field = about @ FIELD
    slide = np.cross(about @ RATE, field)
    innovation = look(state, axis, field[axis], slide[axis], c, d)
    return innovation, state[at.ROW : at.ROW + 7].copy()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_field_depends_on_what_is_sought_as_the_row_says(axis):
    _, row = looked(NOMINAL, axis)
    slopes = slope(lambda x: np.array([looked(x, axis)[0]]), NOMINAL)[0]
    np.testing.assert_allclose(-slopes[1:], row[1:], atol=1e-8)
    if axis == 0:  # to the reference, that is where the heading is right
        facing = NOMINAL.copy()
        facing[0], facing[3:] = np.arctan2(FIELD[0], FIELD[1]), 0.0
        facing[1] = np.hypot(FIELD[0], FIELD[1])
        straight = slope(lambda x: np.array([looked(x, axis)[0]]), facing)[0]
        np.testing.assert_allclose(-straight[0], looked(facing, axis)[1][0], atol=1e-8)


def test_a_reading_corrects_as_the_formula_of_kalman(rng):
    root = rng.normal(size=(at.ERRORS, at.ERRORS))
    before, row = root @ root.T, rng.normal(size=at.ERRORS)
    state = np.zeros(at.STATE)
    state[at.P : at.P + at.ERRORS**2] = before.ravel()
    state[at.GAIN : at.GAIN + at.ERRORS] = before @ row
    variance = row @ before @ row + 0.7
    absorb(state, at.P, at.ERRORS, at.X, 1.3, variance)
    gain = before @ row / variance
    np.testing.assert_allclose(state[at.X : at.X + at.ERRORS], 1.3 * gain, rtol=1e-12)
    after = state[at.P : at.P + at.ERRORS**2].reshape(at.ERRORS, at.ERRORS)
    np.testing.assert_allclose(after, before - variance * np.outer(gain, gain), atol=1e-10)
