"""The second pass of matching, and the company that right matches keep."""

import numpy as np
import pytest
from warped_photos import drawing, moved, warped

from sequential.errors import ModelError, ShapeError
from vision3d.features import detect_features, guided_matches, match_features, supporters
from vision3d.features.guided import distances_px


@pytest.fixture(scope="module")
def pair():
    rng = np.random.default_rng(5)
    a_image, b_image, truth = warped(drawing(rng), rng, strength=0.15, scale=0.6, angle=0.8, noise=4.0)
    return detect_features(a_image, "orb"), detect_features(b_image, "orb"), truth


def right(matches, a, b, truth):
    first, second = matches.points(a, b)
    return np.hypot(*(second - moved(truth, first)).T) < 4.0


def test_a_homography_finds_more_right_matches(pair):
    a, b, truth = pair
    blind, guided = match_features(a, b), guided_matches(a, b, truth)
    assert right(guided, a, b, truth).sum() > 1.2 * right(blind, a, b, truth).sum()
    first, second = guided.points(a, b)
    assert (np.hypot(*(second - moved(truth, first)).T) <= 5.0).all()


def test_an_epipolar_line_lets_through_what_lies_on_it(pair):
    a, b, truth = pair
    # a fundamental matrix of this homography and any epipole
    e = np.array([900.0, 50.0, 1.0])
    cross = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    guided = guided_matches(a, b, cross @ truth, "fundamental", within_px=2.0)
    first, second = guided.points(a, b)
    lines = np.column_stack([first, np.ones(len(first))]) @ (cross @ truth).T
    away = np.abs((lines[:, :2] * second).sum(axis=1) + lines[:, 2]) / np.hypot(*lines[:, :2].T)
    assert away.max() <= 2.0
    assert right(guided, a, b, truth).sum() > right(match_features(a, b), a, b, truth).sum()


def test_without_a_gate_it_is_the_first_pass(pair):
    a, b, truth = pair
    wide = guided_matches(a, b, truth, within_px=1e9, ratio=0.8)
    assert np.array_equal(wide.pairs, match_features(a, b).pairs)


def test_most_bounds_the_distance(pair):
    a, b, truth = pair
    assert guided_matches(a, b, truth, most=40.0).distance.max() <= 40.0


def test_nothing_is_near_a_model_of_elsewhere(pair):
    a, b, _ = pair
    far = np.array([[1.0, 0, 1e6], [0, 1, 0], [0, 0, 1]])
    assert len(guided_matches(a, b, far)) == 0
    assert np.isinf(distances_px(np.zeros((3, 3)), "homography", np.ones((2, 2)), np.ones((2, 2)))).all()


def test_models_that_are_none_are_refused(pair):
    a, b, truth = pair
    with pytest.raises(ShapeError, match=r"\(3, 3\)"):
        guided_matches(a, b, truth[:2])
    with pytest.raises(ModelError, match="homography or a fundamental"):
        guided_matches(a, b, truth, "affine")
    with pytest.raises(ModelError, match="within_px"):
        guided_matches(a, b, truth, within_px=0.0)


def test_company_tells_right_from_wrong(pair):
    a, b, truth = pair
    matches = match_features(a, b, ratio=0.95)
    good, company = right(matches, a, b, truth), supporters(a, b, matches)
    chosen = company >= 2
    assert good.mean() < 0.75
    assert good[chosen].mean() > 0.88
    assert good[chosen].sum() > 0.75 * good.sum()


def test_no_company_among_random_matches(pair, rng):
    a, b, _ = pair
    matches = match_features(a, b, ratio=None)
    shuffled = type(matches)(
        np.column_stack([matches.pairs[:, 0], rng.permutation(matches.pairs[:, 1])]),
        matches.distance,
        matches.ratio,
    )
    assert (supporters(a, b, shuffled) >= 2).mean() < 0.05
    assert supporters(a, b, shuffled.take([0])).tolist() == [0]
    assert supporters(a, b, shuffled.take(np.empty(0, int))).tolist() == []
