"""Robust essential matrices: truth, backends, what a covariance is, and sentences."""

import numpy as np
import pytest
from two_view_worlds import PINHOLE, world

from sequential.errors import DataError, ModelError, ShapeError
from vision3d.ray_pairs import ray_pairs
from vision3d.robust import RansacSettings, fit_essential
from vision3d.robust.essential import fit_essential_rows
from vision3d.two_view import essential_matrix, recover_pose

SIGMA = 0.3 / 522.0


def normalised(it):
    rays = (PINHOLE.unproject(it.pixels_a), PINHOLE.unproject(it.pixels_b))
    return [ray[:, :2] / ray[:, 2:] for ray in rays], rays


def signed(E, truth):
    return E * np.sign(np.sum(E * truth))


@pytest.mark.parametrize("wrong", [0.0, 0.5, 0.7])
def test_right_pairs_among_wrong_ones(rng, wrong):
    it = world(rng, wrong=wrong, baseline=0.5)
    points, rays = normalised(it)
    for pair in (points, rays):
        fitted = fit_essential(*pair, RansacSettings(3.0 * SIGMA))
        assert fitted.inliers[it.right].mean() > 0.95
        np.testing.assert_allclose(np.linalg.svd(fitted.model, compute_uv=False), [1, 1, 0], atol=1e-9)
        assert abs(signed(fitted.model, essential_matrix(it.b_T_a)) - essential_matrix(it.b_T_a)).max() < 0.05


def test_pixels_through_a_lens_and_points_of_the_plane_agree(rng):
    it = world(rng, wrong=0.2, baseline=0.5)
    points, _ = normalised(it)
    rows, _ = ray_pairs(PINHOLE, PINHOLE, it.pixels_a, it.pixels_b)
    by_pixels = fit_essential_rows(rows, RansacSettings(0.9))
    by_points = fit_essential(*points, RansacSettings(0.9 / 522.5))
    # fx and fy differ by a percent, and so do the noises
    assert abs(signed(by_pixels.model, by_points.model) - by_points.model).max() < 2e-3
    assert by_pixels.sigma / 522.5 == pytest.approx(by_points.sigma, rel=0.05)


@pytest.mark.parametrize("method", ["RANSAC", "USAC_ACCURATE", "LMEDS", "poselib"])
def test_backends_find_the_same_matrix(rng, method):
    it = world(rng, wrong=0.3, baseline=0.5)
    points, _ = normalised(it)
    options = (
        {"backend": "poselib"} if method == "poselib" else {"backend": "opencv", "opencv_method": method}
    )
    fitted = fit_essential(*points, RansacSettings(3.0 * SIGMA, **options), rng=rng)
    right = recover_pose(fitted.model, *(ray[it.right] for ray in normalised(it)[1]))
    assert abs(right.b_T_a[4:] - it.b_T_a[4:]).max() < 0.3
    assert fitted.inliers[it.right].mean() > 0.7


@pytest.mark.slow
def test_covariance_is_honest(seeds):
    nees = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        it = world(rng, baseline=0.5)
        fitted = fit_essential(*normalised(it)[0], RansacSettings(4.0 * SIGMA), rng=rng)
        assert np.linalg.matrix_rank(fitted.cov, tol=1e-9 * np.trace(fitted.cov)) == 5
        truth = essential_matrix(it.b_T_a)
        error = (signed(truth, fitted.model) - fitted.model).ravel()
        nees.append(error @ np.linalg.pinv(fitted.cov, rcond=1e-9) @ error / 5.0)
    assert 0.8 < np.median(nees) / 0.87 < 1.5


def test_bad_input_is_told(rng):
    it = world(rng, count=20)
    points, rays = normalised(it)
    with pytest.raises(DataError, match="6 matches"):
        fit_essential(points[0][:5], points[1][:5])
    with pytest.raises(ShapeError, match="arrays"):
        fit_essential(points[0], points[1][:5])
    with pytest.raises(ModelError, match="backend='own'"):
        fit_essential(-rays[0], rays[1], RansacSettings(0.002, backend="opencv"))
    with pytest.raises(ModelError, match="RHO"):
        fit_essential(*points, RansacSettings(0.002, backend="opencv", opencv_method="RHO"))
