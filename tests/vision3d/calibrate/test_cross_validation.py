"""Leaving views out: equal to calibrating without them, and honest about what they have in common."""

import numpy as np
import pytest
from calibration_worlds import world

from vision3d.calibrate import calibrate, cross_validation
from vision3d.calibrate.cross_validation import leave_one_out
from vision3d.views import View


def test_equals_calibrating_without_the_view_and_then_posing_it():
    import cv2

    views = world(n=6, seed=4).views(np.random.default_rng(1))
    left = leave_one_out(calibrate(views, robust=False))
    for v in (0, 4):
        without = calibrate([*views[:v], *views[v + 1 :]], robust=False)
        np.testing.assert_allclose(
            left.parameters[v], without.camera.parameters, atol=2e-3 * without.std.max()
        )
        matrix, distortion = without.camera.matrix, without.camera.distortion
        _, turn, shift = cv2.solvePnP(views[v].points, views[v].pixels, matrix, distortion)
        turn, shift = cv2.solvePnPRefineLM(views[v].points, views[v].pixels, matrix, distortion, turn, shift)
        at = cv2.projectPoints(views[v].points, turn, shift, matrix, distortion)[0].reshape(-1, 2)
        theirs = np.sqrt(np.mean(np.sum((at - views[v].pixels) ** 2, axis=1)))
        assert left.view_rms[v] == pytest.approx(theirs, rel=1e-4)


def test_views_left_out_fit_a_little_worse_than_those_fitted():
    found = calibrate(world(n=8, seed=5).views(np.random.default_rng(2)))
    left = leave_one_out(found)
    assert left.train_rms_px == pytest.approx(found.rms_px)
    assert found.rms_px < left.rms_px < 1.1 * found.rms_px


def test_the_jackknife_agrees_with_the_covariance_under_independent_noise():
    ratios = [
        leave_one_out(calibrate(world(n=13, seed=60 + s).views(np.random.default_rng(s)))).ratio
        for s in range(10)
    ]
    assert 0.8 < np.median(ratios) < 1.35


def test_too_many_coefficients_for_the_views_are_found_out():
    views = world("brown1", n=4, seed=6).views(np.random.default_rng(3))
    few, many = (leave_one_out(calibrate(views, lens)) for lens in ("brown1", "thin12"))
    assert many.train_rms_px < few.train_rms_px
    assert many.rms_px > few.rms_px


def test_one_step_from_the_minimum_of_all_stands_for_the_solve(monkeypatch):
    found = calibrate(world(n=25, seed=8).views(np.random.default_rng(6)))
    solved = leave_one_out(found)
    monkeypatch.setattr(cross_validation, "MANY_FOLDS", 0)
    stepped = leave_one_out(found)
    assert stepped.rms_px == pytest.approx(solved.rms_px, rel=2e-3)
    assert np.abs((stepped.parameters - solved.parameters) / found.std).max() < 0.1


def test_a_shaken_view_does_not_decide():
    scene = world(n=9, seed=7)
    views = list(scene.views(np.random.default_rng(4)))
    noise = np.random.default_rng(5).normal(0.0, 3.0, (54, 2))
    views[2] = View("shaken", views[2].size, views[2].points, views[2].pixels + noise, views[2].ids, 0.2)
    left = leave_one_out(calibrate(views))
    assert left.view_rms[2] > 2.0
    assert left.rms_px < 0.35
