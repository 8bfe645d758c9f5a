"""Covariances and densities at the door."""

import numpy as np
import pytest

from sequential.errors import ModelError, NotPositiveDefiniteError, ShapeError
from sequential.manifold import Vector
from sequential.model import Gaussian
from sequential.models import LinearSensor, Position, RandomWalk
from sequential.noise import ImuNoise, diagonal, require_covariance


@pytest.mark.parametrize(
    ("given", "expected"), [(4.0, [4, 4]), ([4.0, 9.0], [4, 9]), (np.diag([1.0, 2.0]), [1, 2])]
)
def test_a_number_a_vector_and_a_matrix(given, expected):
    cov = require_covariance(given, 2, "it")
    assert np.array_equal(cov, np.diag(expected))
    with pytest.raises(ValueError, match="read-only"):
        cov[0, 0] = 1.0


@pytest.mark.parametrize(
    ("cov", "error", "message"),
    [
        ([1.0, 2.0, 3.0], ShapeError, r"noise must have shape \(2, 2\), got \(3,\)"),
        (np.eye(3), ShapeError, r"noise must have shape \(2, 2\), got \(3, 3\)"),
        ([[1.0, np.nan], [np.nan, 1.0]], NotPositiveDefiniteError, "noise holds NaN or infinity"),
        (
            [[1.0, 0.5], [0.1, 1.0]],
            NotPositiveDefiniteError,
            r"noise is not symmetric: largest difference 0\.4",
        ),
        ([[1.0, 2.0], [2.0, 1.0]], NotPositiveDefiniteError, "not positive definite: smallest eigenvalue -1"),
        ([1.0, 0.0], NotPositiveDefiniteError, "not positive definite: smallest eigenvalue 0"),
        (-1.0, NotPositiveDefiniteError, "not positive definite: smallest eigenvalue -1"),
    ],
)
def test_what_is_no_covariance_is_refused(cov, error, message):
    with pytest.raises(error, match=message):
        require_covariance(cov, 2, "noise")


def test_a_density_may_be_zero_on_some_axis_but_not_negative():
    assert np.array_equal(require_covariance([1.0, 0.0], 2, "it", definite=False), np.diag([1.0, 0.0]))
    with pytest.raises(NotPositiveDefiniteError, match="not positive semi-definite"):
        require_covariance([1.0, -1e-6], 2, "it", definite=False)


def test_axes_of_very_different_size_are_no_fault(rng):
    sigmas = 10.0 ** np.linspace(-9, 9, 7)
    root = np.eye(7) + 0.3 * rng.standard_normal((7, 7))
    cov = np.outer(sigmas, sigmas) * (root @ root.T)
    np.testing.assert_allclose(require_covariance(cov, 7, "it"), cov, rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: Position([[1, 0, 0], [0, -1, 0], [0, 0, 1]]),
            "the noise_cov of a Position is not positive definite",
        ),
        (
            lambda: LinearSensor([[1.0, 0.0]], -1.0),
            "the noise_cov of a LinearSensor is not positive semi-definite",
        ),
        (
            lambda: Gaussian([0.0, 0.0], [[1.0, 2.0], [2.0, 1.0]]),
            "the covariance of a Gaussian is not positive",
        ),
        (
            lambda: RandomWalk([[1.0, 2.0], [2.0, 1.0]]).functions(Vector(2)),
            "the density of a RandomWalk is not",
        ),
    ],
)
def test_the_message_names_whose_covariance_it_is(make, message):
    with pytest.raises(NotPositiveDefiniteError, match=message):
        make()


def test_diagonal_squares_deviations():
    assert np.array_equal(diagonal([1.0, 3.0]), np.diag([1.0, 9.0]))


@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_densities_are_finite_and_not_negative(value):
    with pytest.raises(
        ModelError, match=r"ImuNoise\.accel_density is .*; a density is a finite number, zero or more"
    ):
        ImuNoise(1e-3, value, 0.0, 0.0)


def test_scaling_leaves_the_bias_walks_alone():
    assert ImuNoise(1.0, 2.0, 3.0, 4.0, 5.0).scaled(10.0) == ImuNoise(10.0, 20.0, 3.0, 4.0, 5.0)


def test_what_kalibr_leaves_out_is_named():
    with pytest.raises(
        ModelError, match=r"missing: accelerometer_noise_density, .*accelerometer_random_walk"
    ):
        ImuNoise.from_kalibr({"gyroscope_noise_density": 1.0})
