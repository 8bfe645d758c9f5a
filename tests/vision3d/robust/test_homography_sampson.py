"""Sampson's error of a homography: its derivatives, what it is worth on slanted planes, and its honesty."""

import ctypes

import numpy as np
import pytest
from robust_worlds import carried, corner_error_px, nees

from sequential.errors import ModelError
from vision3d.robust import RansacSettings, fit_homography

SLANTED = np.array([[0.9, 0.2, 20.0], [-0.1, 1.1, 40.0], [1.6e-3, -3e-4, 1.0]])
UNIT = SLANTED / np.linalg.norm(SLANTED)
SIGMA_PX = 0.5
LOOSE = RansacSettings(threshold=6.0, refine="msac")


def noisy(rng, count=150):
    """Matches of a slanted plane with the same noise in both images."""
    a = rng.uniform(0.0, 640.0, (count, 2))
    b = carried(SLANTED, a)
    return a + rng.normal(0.0, SIGMA_PX, a.shape), b + rng.normal(0.0, SIGMA_PX, b.shape)


def squared_errors(rows, model):
    """The kernel's."""
    from vision3d.kernels.robust_homography_sampson import sampson_residuals

    number = ctypes.POINTER(ctypes.c_double)
    errors, model = np.empty(len(rows)), np.ascontiguousarray(model)
    pointers = [array.ctypes.data_as(number) for array in (rows, model, errors)]
    sampson_residuals.ctypes(pointers[0], len(rows), 4, pointers[1], pointers[2])
    return errors


def test_the_error_is_the_distance_from_the_nearest_exact_match(rng):
    scaled = np.diag([1 / 300, 1 / 300, 1.0]) @ SLANTED @ np.diag([300.0, 300.0, 1.0])
    scaled /= np.linalg.norm(scaled)
    a = rng.uniform(0.0, 2.0, (5, 2))
    b = carried(scaled, a)
    off_a, off_b = 1e-4 * rng.normal(size=(2, 5, 2))
    told = squared_errors(np.column_stack([a + off_a, b + off_b]), scaled.ravel())
    for i in range(5):
        steps = 1e-6 * np.eye(2)[:, None]
        moved = [(carried(scaled, a[i] + d) - carried(scaled, a[i] - d))[0] for d in steps]
        J = np.transpose(moved) / 2e-6
        # exact matches are (p, H p): the part of the noise at right angles to (dp, J dp)
        along = np.linalg.qr(np.vstack([np.eye(2), J]))[0]
        off = np.concatenate([off_a[i], off_b[i]])
        assert told[i] == pytest.approx(np.sum((off - along @ (along.T @ off)) ** 2), rel=2e-3)


def test_it_beats_the_transfer_error_where_both_images_are_noisy(rng):
    errors = {"transfer": [], "sampson": []}
    for _ in range(60):
        a, b = noisy(rng)
        for error, found in errors.items():
            found.append(corner_error_px(fit_homography(a, b, LOOSE, error=error, rng=rng).model, SLANTED))
    assert np.mean(errors["sampson"]) < 0.97 * np.mean(errors["transfer"])


@pytest.mark.slow
def test_its_covariance_is_honest(rng, seeds):
    told = []
    for _ in range(10 * len(seeds)):
        a, b = noisy(rng)
        found = fit_homography(a, b, LOOSE, error="sampson", rng=rng)
        told.append(nees(found.model.ravel() - UNIT.ravel(), found.cov))
        assert found.sigma == pytest.approx(SIGMA_PX, rel=0.3)
    values, ranks = np.array(told).T
    assert (ranks == 8).all()
    assert abs(values.mean() - 1.0) < 0.05 + 4.0 * np.sqrt(2.0 / (8 * len(values)))


def test_outliers_do_not_matter_to_it(rng):
    a, b = noisy(rng, count=600)
    wrong = rng.random(600) < 0.6
    b[wrong] = rng.uniform(0.0, 640.0, (int(wrong.sum()), 2))
    found = fit_homography(a, b, RansacSettings(threshold=2.0), error="sampson", rng=rng)
    assert np.mean(found.inliers == ~wrong) > 0.99
    assert corner_error_px(found.model, SLANTED) < 2.0


def test_another_error_is_refused(rng):
    with pytest.raises(ModelError, match="transfer, sampson; got 'algebraic'"):
        fit_homography(*noisy(rng), error="algebraic")
