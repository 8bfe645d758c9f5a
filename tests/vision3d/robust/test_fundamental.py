"""A fundamental matrix: exact on exact data, better than OpenCV's on bad ones, planes met, honest."""

import cv2
import numpy as np
import pytest
from robust_worlds import fundamental_matches, nees, off_lines_px

from sequential.errors import DataError, UnderConstrainedError
from vision3d.robust import RansacSettings, eight_point, fit_fundamental

SETTINGS = RansacSettings(threshold=2.0, inner_samples=5)


def aligned(F, truth):
    """F with the sign of the truth."""
    return F * np.sign(np.sum(F * truth))


def test_exact_matches_give_the_exact_matrix(rng):
    world = fundamental_matches(rng, 1.0, count=60, sigma_px=0.0)
    found = fit_fundamental(world.a, world.b)
    np.testing.assert_allclose(aligned(found.model, world.F), world.F, atol=1e-9)
    assert found.stopped == "all agree"
    assert abs(np.linalg.det(found.model)) < 1e-16


def test_seven_points_are_solved_as_by_opencv(rng):
    for _ in range(20):
        world = fundamental_matches(rng, 1.0, count=7, sigma_px=0.5)
        theirs = cv2.findFundamentalMat(world.a, world.b, cv2.FM_7POINT)[0].reshape(-1, 9)
        ours = seven_point_solutions(world.a, world.b)
        theirs /= np.linalg.norm(theirs, axis=1)[:, None]
        for F in ours:
            assert np.abs(theirs @ F).max() > 1.0 - 1e-9
        assert ours


def seven_point_solutions(a, b):
    """Every solution of the kernel, in px."""
    import ctypes

    from vision3d.kernels.robust_fundamental import fundamental_solve

    scale = 300.0
    rows, sample, out = np.column_stack([a, b]) / scale, np.arange(7), np.empty((3, 9))
    count = fundamental_solve.ctypes(
        rows.ctypes.data_as(ctypes.POINTER(ctypes.c_double)),
        7,
        4,
        sample.ctypes.data_as(ctypes.POINTER(ctypes.c_int64)),
        out.ctypes.data_as(ctypes.POINTER(ctypes.c_double)),
    )
    S = np.diag([1.0 / scale, 1.0 / scale, 1.0])
    found = [(S @ F.reshape(3, 3) @ S).ravel() for F in out[:count]]
    return [F / np.linalg.norm(F) for F in found]


def test_the_eight_point_algorithm_is_opencv_s(rng):
    world = fundamental_matches(rng, 1.0, count=50)
    theirs = cv2.findFundamentalMat(world.a, world.b, cv2.FM_8POINT)[0]
    ours = eight_point(world.a, world.b)
    np.testing.assert_allclose(aligned(theirs / np.linalg.norm(theirs), ours), ours, atol=1e-6)


@pytest.mark.parametrize("share", [0.9, 0.5, 0.35])
def test_better_than_opencv_s_ransac(share, rng):
    ours, theirs = [], []
    for _ in range(8):
        world = fundamental_matches(rng, share)
        ours.append(off_lines_px(fit_fundamental(world.a, world.b, SETTINGS, rng=rng).model, world))
        outside = RansacSettings(threshold=2.0, backend="opencv", max_iterations=2000)
        theirs.append(off_lines_px(fit_fundamental(world.a, world.b, outside, rng=rng).model, world))
    assert np.median(ours) < 0.5
    assert np.median(ours) < 0.7 * np.median(theirs)


@pytest.mark.slow
def test_the_covariance_is_honest(rng, seeds):
    told = []
    for _ in range(4 * len(seeds)):
        world = fundamental_matches(rng, 1.0, count=300)
        found = fit_fundamental(world.a, world.b, RansacSettings(threshold=3.0), sigma=0.7, rng=rng)
        told.append(nees(aligned(found.model, world.F).ravel() - world.F.ravel(), found.cov))
    values, ranks = np.array(told).T
    assert (ranks == 7).all()
    assert abs(values.mean() - 1.0) < 0.1 + 4.0 * np.sqrt(2.0 / (7 * len(values)))


def test_a_dominant_plane_is_met_and_told(rng):
    ours = []
    for _ in range(6):
        world = fundamental_matches(rng, 0.8, plane=0.85)
        found = fit_fundamental(world.a, world.b, SETTINGS, rng=rng)
        assert "lie on one plane" in found.note
        ours.append(off_lines_px(found.model, world))
    assert np.median(ours) < 0.4


def test_a_scene_without_a_plane_is_not_called_one(rng):
    world = fundamental_matches(rng, 0.8)
    assert not fit_fundamental(world.a, world.b, SETTINGS, rng=rng).note


@pytest.mark.parametrize(
    ("a", "b", "error", "said"),
    [
        (np.eye(6, 2), np.eye(6, 2), DataError, "takes 7 matches or more; got 6"),
        (np.ones((9, 2)), np.ones((9, 2)), UnderConstrainedError, "one and the same"),
        (np.outer(np.arange(9.0), [1, 2]), np.outer(np.arange(9.0), [2, 1]), UnderConstrainedError, "line"),
    ],
)
def test_what_determines_no_matrix_is_refused(a, b, error, said):
    with pytest.raises(error, match=said):
        fit_fundamental(a, b)
