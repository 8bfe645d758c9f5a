"""A homography from matches: exact on exact data, as good as the oracle on bad ones, and honest."""

import cv2
import numpy as np
import pytest
from robust_worlds import HOMOGRAPHY, carried, corner_error_px, matches, nees

from sequential.errors import DataError, NotFiniteError, ShapeError, UnderConstrainedError
from vision3d.robust import RansacSettings, fit_homography, transfer, transfer_cov

UNIT = HOMOGRAPHY / np.linalg.norm(HOMOGRAPHY)


def test_exact_matches_give_the_exact_homography(rng):
    a = rng.uniform(0.0, 640.0, (40, 2))
    found = fit_homography(a, carried(HOMOGRAPHY, a))
    np.testing.assert_allclose(found.model, UNIT, atol=1e-12)
    assert found.stopped == "all agree"
    assert found.inliers.all()


def test_four_matches_are_enough(rng):
    a = np.array([[0.0, 0.0], [600.0, 10.0], [590.0, 400.0], [20.0, 420.0]])
    found = fit_homography(a, carried(HOMOGRAPHY, a))
    np.testing.assert_allclose(found.model, UNIT, atol=1e-10)
    assert np.isnan(found.sigma)


@pytest.mark.parametrize("share", [1.0, 0.8, 0.5, 0.3, 0.15])
def test_as_good_as_least_squares_on_the_true_inliers(share, rng):
    ours, oracle = [], []
    for _ in range(10):
        a, b, right = matches(rng, share)
        found = fit_homography(a, b, rng=rng)
        ours.append(corner_error_px(found.model))
        oracle.append(corner_error_px(cv2.findHomography(a[right], b[right], 0)[0]))
        assert np.count_nonzero(found.inliers != right) <= 4
        assert found.sigma == pytest.approx(0.7, rel=0.15)
    assert np.median(ours) <= 1.15 * np.median(oracle)


@pytest.mark.parametrize("score", ["msac", "count"])
@pytest.mark.parametrize("refine", ["msac", "mixture"])
@pytest.mark.parametrize("inner", [0, 5])
def test_every_way_of_searching_finds_it(score, refine, inner, rng):
    a, b, _ = matches(rng, 0.4)
    found = fit_homography(a, b, RansacSettings(score=score, refine=refine, inner_samples=inner), rng=rng)
    assert corner_error_px(found.model) < 0.6
    assert found.stopped == "confidence reached"


@pytest.mark.slow
@pytest.mark.parametrize("share", [1.0, 0.5])
def test_the_covariance_is_honest(share, rng, seeds):
    told = []
    for _ in range(5 * len(seeds)):
        a, b, _ = matches(rng, share, count=200)
        found = fit_homography(a, b, rng=rng)
        told.append(nees(found.model.ravel() - UNIT.ravel(), found.cov))
    values, ranks = np.array(told).T
    assert (ranks == 8).all()
    assert 1.0 - 0.5 / np.sqrt(len(seeds)) < values.mean() < 1.0 + 0.7 / np.sqrt(len(seeds))


def test_sigmas_of_single_matches_are_used(rng):
    sigma = np.where(np.arange(400) % 2, 0.2, 2.0)
    weighted, plain, told = [], [], []
    for _ in range(10):
        a = rng.uniform(0.0, 640.0, (400, 2))
        b = carried(HOMOGRAPHY, a) + sigma[:, None] * rng.normal(size=(400, 2))
        settings = RansacSettings(threshold=4.0)
        found = fit_homography(a, b, settings, sigma=sigma, rng=rng)
        weighted.append(corner_error_px(found.model))
        plain.append(corner_error_px(fit_homography(a, b, settings, rng=rng).model))
        told.append(nees(found.model.ravel() - UNIT.ravel(), found.cov)[0])
    assert np.mean(weighted) < np.mean(plain)
    assert 0.5 < np.mean(told) < 1.7


def test_the_unit_of_the_points_does_not_matter(rng):
    a, b, _ = matches(rng, 0.5)
    near = fit_homography(a, b).model
    far = fit_homography(1e-3 * a, 1e-3 * b, RansacSettings(threshold=3e-3)).model
    np.testing.assert_allclose(transfer(far, 1e-3 * a[:9]), 1e-3 * transfer(near, a[:9]), rtol=1e-8)


def test_the_same_seed_gives_the_same_answer(rng):
    a, b, _ = matches(rng, 0.2)
    first, second = (fit_homography(a, b, rng=np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(first.model, second.model)
    assert first.iterations == second.iterations


def test_points_carried_over_are_as_uncertain_as_they_scatter(rng):
    place = np.array([[30.0, 600.0]])
    seen, told = [], []
    for _ in range(60):
        a, b, _ = matches(rng, 0.7, count=150)
        found = fit_homography(a, b, rng=rng)
        seen.append((transfer(found.model, place) - transfer(HOMOGRAPHY, place))[0])
        told.append(transfer_cov(found.model, found.cov, place)[0])
    spread = np.sum(np.var(seen, axis=0)) / np.trace(np.mean(told, axis=0))
    assert 0.6 < spread < 1.6


def test_mirrored_images_match_too(rng):
    a = rng.uniform(0.0, 640.0, (50, 2))
    b = a * [-1.0, 1.0] + [640.0, 0.0]
    np.testing.assert_allclose(transfer(fit_homography(a, b).model, a), b, atol=1e-9)


@pytest.mark.parametrize(
    ("a", "b", "error", "said"),
    [
        (np.eye(3, 2), np.eye(3, 2), DataError, "takes 4 matches or more; got 3"),
        (np.ones((9, 2)), np.ones((9, 2)), UnderConstrainedError, "one and the same"),
        (
            np.arange(18.0).reshape(9, 2),
            np.arange(18.0).reshape(9, 2),
            UnderConstrainedError,
            "on one line",
        ),
        (np.zeros((9, 3)), np.zeros((9, 2)), ShapeError, r"points \(N, 2\)"),
        (np.zeros((9, 2)), np.zeros((8, 2)), ShapeError, "9 in a and 8 in b"),
        (np.full((9, 2), np.nan), np.zeros((9, 2)), NotFiniteError, r"a\[0\] is not finite"),
    ],
)
def test_what_determines_no_homography_is_refused(a, b, error, said):
    with pytest.raises(error, match=said):
        fit_homography(a, b)


@pytest.mark.parametrize(
    "wrong", [{"threshold": 0.0}, {"confidence": 1.0}, {"max_iterations": 0}, {"score": "best"}]
)
def test_settings_that_cannot_be_meant_are_refused(wrong):
    with pytest.raises(Exception, match=next(iter(wrong))):
        RansacSettings(**wrong)


@pytest.mark.slow
def test_heavy_tails_do_not_spoil_the_fit_nor_its_covariance(rng, seeds):
    ours, plain, told = [], [], []
    for _ in range(5 * len(seeds)):
        a = rng.uniform(0.0, 640.0, (200, 2))
        b = carried(HOMOGRAPHY, a) + 0.4 * rng.standard_t(3, (200, 2))
        found = fit_homography(a, b, rng=rng)
        ours.append(corner_error_px(found.model))
        plain.append(corner_error_px(fit_homography(a, b, RansacSettings(refine="msac"), rng=rng).model))
        told.append(nees(found.model.ravel() - UNIT.ravel(), found.cov)[0])
    assert np.mean(ours) < 0.95 * np.mean(plain)
    assert 0.8 < np.mean(told) < 1.3
