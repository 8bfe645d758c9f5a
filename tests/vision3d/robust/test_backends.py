"""OpenCV and PoseLib behind the same call, and all of them in one table."""

import builtins

import cv2
import numpy as np
import pytest
from robust_worlds import corner_error_px, fundamental_matches, matches, off_lines_px

from sequential.errors import ModelError, ToolMissingError
from vision3d.robust import RansacSettings, compare_backends, fit_fundamental, fit_homography, table_of
from vision3d.robust.settings import OPENCV_METHODS


@pytest.mark.parametrize("method", [name for name in OPENCV_METHODS if name != "USAC_FM_8PTS"])
def test_every_method_of_opencv_finds_a_homography(method, rng):
    a, b, _ = matches(rng, 0.7)
    found = fit_homography(a, b, RansacSettings(backend="opencv", opencv_method=method), rng=rng)
    assert corner_error_px(found.model) < 3.0
    assert found.backend == f"opencv {method}"
    assert found.iterations == -1


def test_opencv_s_model_is_handed_on_as_it_is(rng):
    a, b, _ = matches(rng, 0.6)
    cv2.setRNGSeed(0)
    theirs, mask = cv2.findHomography(a, b, cv2.RANSAC, 3.0, maxIters=500, confidence=0.99)
    found = fit_homography(a, b, RansacSettings(backend="opencv", max_iterations=500, confidence=0.99))
    np.testing.assert_allclose(found.model, theirs / np.linalg.norm(theirs), atol=1e-12)
    assert np.mean(found.inliers == mask.ravel().astype(bool)) > 0.98


def test_poselib_finds_both_models(rng):
    a, b, _ = matches(rng, 0.6)
    settings = RansacSettings(backend="poselib", max_iterations=2000)
    found = fit_homography(a, b, settings)
    assert corner_error_px(found.model) < 0.6
    assert found.iterations > 0
    world = fundamental_matches(rng, 0.6)
    assert off_lines_px(fit_fundamental(world.a, world.b, settings).model, world) < 1.0


@pytest.mark.parametrize("method", ["RHO", "USAC_PROSAC"])
def test_methods_that_trust_the_order_are_given_none_that_was_not_claimed(method, rng):
    a, b, right = matches(rng, 0.7, count=200)
    order = np.argsort(right, kind="stable")
    settings = RansacSettings(backend="opencv", opencv_method=method)
    found = fit_homography(a[order], b[order], settings, rng=rng)
    assert found.inlier_ratio > 0.5


def test_lmeds_and_prosac_choose_opencv_s_own(rng):
    a, b, _ = matches(rng, 0.8)
    assert fit_homography(a, b, RansacSettings(backend="opencv", method="lmeds")).backend == "opencv LMEDS"
    sorted_first = RansacSettings(backend="opencv", order="prosac")
    assert fit_homography(a, b, sorted_first).backend == "opencv USAC_PROSAC"


def test_a_missing_poselib_is_told(rng, monkeypatch):
    real = builtins.__import__

    def without(name, *rest, **options):
        if name == "poselib":
            raise ImportError(name)
        return real(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    a, b, _ = matches(rng, 0.8)
    with pytest.raises(ToolMissingError, match=r"factorlab\[poselib\]"):
        fit_homography(a, b, RansacSettings(backend="poselib"))


def test_rho_knows_no_fundamental_matrix(rng):
    world = fundamental_matches(rng, 0.8)
    with pytest.raises(ModelError, match="RHO knows homographies only"):
        fit_fundamental(world.a, world.b, RansacSettings(backend="opencv", opencv_method="RHO"))


def test_all_backends_in_one_table(rng):
    a, b, _ = matches(rng, 0.7)
    settings = RansacSettings(max_iterations=1000)
    rows = compare_backends(lambda s, g: fit_homography(a, b, s, rng=g), settings, runs=1)
    assert {"own", "own LMedS", "opencv RANSAC", "poselib"} <= {row.name for row in rows}
    assert all(row.fit is not None and row.seconds > 0.0 for row in rows)
    text = table_of(rows, lambda found: corner_error_px(found.model))
    assert len(text.splitlines()) == 1 + len(rows)
    assert "own LMedS" in text


def test_a_backend_that_cannot_is_a_row_with_its_reason(rng):
    world = fundamental_matches(rng, 0.8)
    settings = RansacSettings(threshold=2.0, max_iterations=1000)
    rows = compare_backends(lambda s, g: fit_fundamental(world.a, world.b, s, rng=g), settings, runs=1)
    refused = next(row for row in rows if row.name == "opencv RHO")
    assert refused.fit is None
    assert "homographies only" in table_of([refused])
