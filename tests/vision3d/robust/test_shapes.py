"""Lines, planes and similarities: exact on exact data, right among outliers, honest about it."""

import cv2
import numpy as np
import pytest
from robust_worlds import nees

from sequential.errors import DataError, ModelError, ShapeError, UnderConstrainedError
from vision3d.robust import RansacSettings, fit_line, fit_plane, fit_similarity

NORMALS = {2: np.array([0.6, 0.8]), 3: np.array([2.0, -3.0, 6.0]) / 7.0}
FITS = {2: fit_line, 3: fit_plane}
OFFSET = 4.0


def on_a_flat(rng, k, count, share=1.0, sigma=0.0):
    """Points on n · x = OFFSET, and the truth of who is; the others are anywhere in a box of 20."""
    n = NORMALS[k]
    points = rng.uniform(-10.0, 10.0, (count, k))
    points += (OFFSET - points @ n + rng.normal(0.0, sigma, count))[:, None] * n
    wrong = rng.random(count) > share
    points[wrong] = rng.uniform(-10.0, 10.0, (int(wrong.sum()), k))
    return points, ~wrong


def turned(rng, k):
    """A random rotation (k, k)."""
    if k == 2:
        angle = rng.uniform(-np.pi, np.pi)
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return cv2.Rodrigues(rng.uniform(-2.0, 2.0, 3))[0]


def pairs(rng, k, count, share=1.0, sigma=0.0):
    """Matches under a random similarity, and its matrix."""
    whole = np.eye(k + 1)
    whole[:k, :k], whole[:k, k] = rng.uniform(0.3, 3.0) * turned(rng, k), rng.uniform(-9.0, 9.0, k)
    a = rng.uniform(-10.0, 10.0, (count, k)) + 3.0
    b = a @ whole[:k, :k].T + whole[:k, k] + rng.normal(0.0, sigma, (count, k))
    wrong = rng.random(count) > share
    b[wrong] = rng.uniform(-30.0, 30.0, (int(wrong.sum()), k))
    return a, b, whole


@pytest.mark.parametrize("k", [2, 3])
def test_exact_points_give_the_exact_flat(k, rng):
    points, _ = on_a_flat(rng, k, 30)
    found = FITS[k](points, RansacSettings(threshold=0.1))
    np.testing.assert_allclose(found.model, [*NORMALS[k], OFFSET], atol=1e-12)
    assert found.stopped == "all agree"


@pytest.mark.parametrize("method", ["ransac", "lmeds"])
@pytest.mark.parametrize("k", [2, 3])
def test_outliers_do_not_move_a_flat(k, method, rng):
    points, right = on_a_flat(rng, k, 500, share=0.6, sigma=0.05)
    found = FITS[k](points, RansacSettings(threshold=0.2, method=method), rng=rng)
    np.testing.assert_allclose(found.model, [*NORMALS[k], OFFSET], atol=0.03)
    assert np.mean(found.inliers == right) > 0.95
    assert found.sigma == pytest.approx(0.05, rel=0.25)


def test_a_line_is_that_of_opencv_s_least_squares(rng):
    points, _ = on_a_flat(rng, 2, 200, sigma=0.05)
    vx, vy, x, y = cv2.fitLine(points.astype(np.float32), cv2.DIST_L2, 0, 1e-9, 1e-9).ravel()
    settings = RansacSettings(threshold=5.0, refine="msac")
    found = fit_line(points, settings)
    assert abs(found.model[:2] @ [vx, vy]) < 1e-6
    assert found.model[:2] @ [x, y] == pytest.approx(found.model[2], abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("k", [2, 3])
def test_the_covariance_of_a_flat_is_honest(k, rng, seeds):
    told = []
    for _ in range(10 * len(seeds)):
        points, _ = on_a_flat(rng, k, 40, sigma=0.05)
        found = FITS[k](points, RansacSettings(threshold=0.25), sigma=0.05, rng=rng)
        told.append(nees(found.model - [*NORMALS[k], OFFSET], found.cov))
    values, ranks = np.array(told).T
    assert (ranks == k).all()
    assert abs(values.mean() - 1.0) < 4.0 * np.sqrt(2.0 / (k * len(values)))


@pytest.mark.parametrize("k", [2, 3])
def test_exact_matches_give_the_exact_similarity(k, rng):
    a, b, whole = pairs(rng, k, 20)
    found = fit_similarity(a, b, RansacSettings(threshold=0.1))
    np.testing.assert_allclose(found.model, whole, atol=1e-11)


@pytest.mark.parametrize("share", [0.7, 0.3])
@pytest.mark.parametrize("k", [2, 3])
def test_outliers_do_not_move_a_similarity(k, share, rng):
    a, b, whole = pairs(rng, k, 600, share=share, sigma=0.05)
    found = fit_similarity(a, b, RansacSettings(threshold=0.25), rng=rng)
    np.testing.assert_allclose(found.model, whole, atol=0.1)
    assert found.sigma == pytest.approx(0.05, rel=0.2)


def test_a_plane_similarity_is_as_good_as_opencv_s(rng):
    ours, theirs = [], []
    for _ in range(20):
        a, b, whole = pairs(rng, 2, 300, share=0.5, sigma=0.05)
        ours.append(np.abs(fit_similarity(a, b, RansacSettings(threshold=0.2), rng=rng).model - whole).max())
        found = cv2.estimateAffinePartial2D(a, b, ransacReprojThreshold=0.2, confidence=0.999)[0]
        theirs.append(np.abs(found - whole[:2]).max())
    assert np.median(ours) <= 1.05 * np.median(theirs)


def test_three_points_in_space_are_enough_and_a_mirror_image_is_not_taken(rng):
    a, b, whole = pairs(rng, 3, 3)
    np.testing.assert_allclose(fit_similarity(a, b, RansacSettings(threshold=0.1)).model, whole, atol=1e-9)
    a, b, _ = pairs(rng, 3, 40)
    found = fit_similarity(a, b * [1.0, 1.0, -1.0], RansacSettings(threshold=0.1))
    assert np.linalg.det(found.model[:3, :3]) > 0.0
    assert found.inlier_ratio < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("k", [2, 3])
def test_the_covariance_of_a_similarity_is_honest(k, rng, seeds):
    told = []
    for _ in range(10 * len(seeds)):
        a, b, whole = pairs(rng, k, 40, sigma=0.05)
        found = fit_similarity(a, b, RansacSettings(threshold=0.5), sigma=0.05, rng=rng)
        told.append(nees(tangent(found.model, whole), found.cov)[0])
    freedom = 4 if k == 2 else 7
    assert abs(np.mean(told) - 1.0) < 4.0 * np.sqrt(2.0 / (freedom * len(told)))


def tangent(model, truth):
    """From the model to the truth, in the tangent that the covariance names."""
    k = len(model) - 1
    scale, scale_true = (np.linalg.det(m[:k, :k]) ** (1.0 / k) for m in (model, truth))
    R, R_true = model[:k, :k] / scale, truth[:k, :k] / scale_true
    step = R.T @ R_true
    turn = [np.arctan2(step[1, 0], step[0, 0])] if k == 2 else cv2.Rodrigues(step)[0].ravel()
    return np.array([*turn, *(R.T @ (truth[:k, k] - model[:k, k])), np.log(scale_true / scale)])


@pytest.mark.parametrize(
    ("work", "error", "said"),
    [
        (lambda s: fit_line(np.zeros((1, 2)), s), DataError, "takes 2 points or more; got 1"),
        (lambda s: fit_line(np.ones((5, 2)), s), UnderConstrainedError, "one and the same"),
        (lambda s: fit_plane(np.arange(15.0).reshape(5, 3), s), UnderConstrainedError, "on one line"),
        (lambda s: fit_plane(np.zeros((5, 2)), s), ShapeError, r"\(N, 3\)"),
        (lambda s: fit_similarity(np.zeros(3), np.zeros(3), s), ShapeError, r"\(N, 2\) or \(N, 3\)"),
        (
            lambda s: fit_similarity(np.arange(15.0).reshape(5, 3), np.arange(15.0).reshape(5, 3), s),
            UnderConstrainedError,
            "on one line",
        ),
    ],
)
def test_what_determines_nothing_is_refused(work, error, said):
    with pytest.raises(error, match=said):
        work(RansacSettings(threshold=0.1))


def test_a_backend_that_has_no_such_model_says_so(rng):
    with pytest.raises(ModelError, match="opencv has no line"):
        fit_line(rng.normal(size=(9, 2)), RansacSettings(threshold=0.1, backend="opencv"))
