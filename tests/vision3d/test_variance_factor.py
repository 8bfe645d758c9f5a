"""The variance of unit weight is found, with wrong matches among the residuals."""

import numpy as np
import pytest

from sequential.errors import DataError, ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.render import orbit_poses
from vision3d.rigid import transform
from vision3d.triangulate import triangulate
from vision3d.variance_factor import variance_factor


@pytest.mark.parametrize("factor", [0.25, 1.0, 9.0])
@pytest.mark.parametrize("dof", [1, 3, 9])
def test_the_factor_is_found(factor, dof, rng):
    values = factor * rng.chisquare(dof, 20_000)
    assert variance_factor(values, np.full(20_000, dof)) == pytest.approx(factor, rel=0.05)


def test_degrees_of_freedom_may_differ(rng):
    dof = rng.integers(1, 12, 20_000)
    assert variance_factor(0.5 * rng.chisquare(dof), dof) == pytest.approx(0.5, rel=0.03)


def test_wrong_matches_hardly_count(rng):
    values = rng.chisquare(1, 5000)
    values[:500] = rng.uniform(0, 1e4, 500)
    assert variance_factor(values, np.ones(5000)) == pytest.approx(1.0, rel=0.12)


def test_scaled_points_are_those_of_the_right_noise(rng):
    camera = Camera("pinhole", (560, 560, 319.5, 239.5), (), (640, 480))
    poses = orbit_poses((0, 0.1, 1.6), 1.6, 3, arc_rad=0.5)
    points = rng.uniform((-0.45, -0.3, 1.2), (0.45, 0.35, 2.2), (2000, 3))
    pixels = np.stack([camera.project(transform(pose, points)) for pose in poses])
    pixels += rng.normal(0, 0.6, pixels.shape)
    declared, right = (triangulate(camera, poses, pixels, sigma_px=sigma) for sigma in (0.2, 0.6))
    factor = variance_factor(declared.chi2, declared.dof)
    assert factor == pytest.approx(9.0, rel=0.1)
    scaled = declared.scaled(9.0)
    np.testing.assert_allclose(scaled.covs, right.covs, rtol=1e-6)
    np.testing.assert_allclose(scaled.chi2, right.chi2, rtol=1e-6)
    np.testing.assert_allclose(scaled.inverse_std_m, right.inverse_std_m, rtol=1e-6)
    with pytest.raises(ModelError, match="positive"):
        declared.scaled(0.0)


def test_too_little_is_refused():
    with pytest.raises(DataError, match="19 points"):
        variance_factor([*np.ones(19), np.nan], np.ones(20))
    with pytest.raises(ShapeError, match="both"):
        variance_factor(np.ones(30), np.ones(29))
