"""The climb: curvature by differences, Newton at the end, and what is said where there is no summit."""

import numpy as np
import pytest

from sequential.tuning.search import climb, curvature

HESSIAN = -np.array([[2.0, 0.6, 0.0], [0.6, 1.5, -0.3], [0.0, -0.3, 1.2]])


def hill(u, top=(0.3, -0.7, 0.2)):
    off = u - np.asarray(top)
    return 5.0 + 0.5 * off @ HESSIAN @ off


def test_curvature_of_a_quadratic_is_exact():
    shape = curvature(hill, np.zeros(3))
    np.testing.assert_allclose(shape.hessian, HESSIAN, atol=1e-9)
    np.testing.assert_allclose(shape.gradient, -HESSIAN @ [0.3, -0.7, 0.2], atol=1e-9)
    np.testing.assert_allclose(shape.newton(), [0.3, -0.7, 0.2], atol=1e-9)
    np.testing.assert_allclose(shape.sigmas() ** 2, np.diag(np.linalg.inv(-HESSIAN)), atol=1e-9)


def test_a_quadratic_is_climbed():
    summit = climb(hill, 3, 300)
    np.testing.assert_allclose(summit.at, [0.3, -0.7, 0.2], atol=1e-6)
    assert summit.value == pytest.approx(5.0)
    assert summit.converged
    assert summit.message == ""


def test_newton_finishes_what_the_simplex_began():
    summit = climb(hill, 3, 25)
    np.testing.assert_allclose(summit.at, [0.3, -0.7, 0.2], atol=1e-6)
    assert summit.converged


def test_cliffs_are_avoided():
    summit = climb(lambda u: hill(u) if u.min() > -1.0 else -np.inf, 3, 300)
    np.testing.assert_allclose(summit.at, [0.3, -0.7, 0.2], atol=1e-6)


def test_a_saddle_is_reported():
    summit = climb(lambda u: 0.1 * u[0] ** 2 - u[1] ** 2, 2, 60)
    assert not summit.converged
    assert "not positive definite" in summit.message
    assert np.isnan(summit.curvature.sigmas()).all()
