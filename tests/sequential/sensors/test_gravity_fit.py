import numpy as np
import pytest

from sequential.errors import DataError
from sequential.sensors import local_gravity
from sequential.sensors.gravity_fit import NAMES, matrix_of, norm_jacobian, norms
from sequential.sensors.multi_position import matrix_jacobian


def parameters(rng):
    return np.r_[rng.uniform(0.5, 2.0, 3), 0.1 * rng.standard_normal(3), rng.standard_normal(3)]


def differenced(function, x, step=1e-6):
    ends = [(function(x + step * e), function(x - step * e)) for e in np.eye(len(x))]
    return np.stack([(a - b).ravel() / (2 * step) for a, b in ends], axis=1)


def test_jacobians_meet_differences(rng):
    x, means = parameters(rng), 5 * rng.standard_normal((8, 3))
    np.testing.assert_allclose(norm_jacobian(x, means), differenced(lambda p: norms(p, means), x), atol=1e-7)
    np.testing.assert_allclose(
        matrix_jacobian(x), differenced(lambda p: np.r_[matrix_of(p).ravel(), p[6:]], x), atol=1e-7
    )
    assert len(NAMES) == len(x)


def test_gravity_of_known_places():
    assert local_gravity(0.0) == pytest.approx(9.78033, abs=1e-5)
    assert local_gravity(np.pi / 2) == pytest.approx(9.83219, abs=1e-5)
    assert local_gravity(np.radians(45.0)) == pytest.approx(9.80620, abs=1e-5)
    assert local_gravity(0.5, 1000.0) - local_gravity(0.5) == pytest.approx(-0.00308, abs=1e-5)
    with pytest.raises(DataError, match="radians"):
        local_gravity(48.1)
    with pytest.raises(DataError, match="100 km"):
        local_gravity(0.5, 1e6)
