"""Features of every kind: where they are, how sure, how spread, and what there is none of."""

import cv2
import numpy as np
import pytest
from warped_photos import drawing, moved, slopes, warped

from sequential.errors import DataError, ModelError, NotFiniteError, ShapeError
from vision3d.features import KINDS, Features, detect_features, match_features, spread_levels, spread_rows

BARS = {"sift": 0.25, "orb": 0.55, "fast": 0.5, "harris": 0.45, "fast-patch": 0.5, "harris-patch": 0.45}


@pytest.fixture(scope="module")
def picture():
    return drawing(np.random.default_rng(3))


@pytest.mark.parametrize("kind", KINDS)
def test_found_again_where_the_homography_says(kind, picture, rng):
    a_image, b_image, truth = warped(picture, rng, strength=0.03, angle=0.1)
    a, b = detect_features(a_image, kind), detect_features(b_image, kind)
    matches = match_features(a, b)
    first, second = matches.points(a, b)
    error = second - moved(truth, first)
    right = np.hypot(*error.T) < 4.0
    assert len(matches) > 80
    assert right.mean() > 0.85
    assert np.median(np.abs(error[right])) / 0.6745 < BARS[kind]


@pytest.mark.parametrize("kind", ["sift", "orb", "fast", "harris"])
def test_sigma_is_that_of_the_errors(kind, picture, rng):
    """Of nineteen matches in twenty: wrong neighbours are for the robust estimator to find."""
    scale = 0.8 if kind in ("sift", "orb") else 0.97
    a_image, b_image, truth = warped(picture, rng, strength=0.05, scale=scale, angle=0.2)
    a, b = detect_features(a_image, kind), detect_features(b_image, kind)
    matches = match_features(a, b)
    first, second = matches.points(a, b)
    sigma_a, sigma_b = matches.sigma_px(a, b)
    jacobian = slopes(truth, first)
    cov = sigma_b[:, None, None] ** 2 * np.eye(2)
    cov = cov + sigma_a[:, None, None] ** 2 * jacobian @ jacobian.transpose(0, 2, 1)
    error = second - moved(truth, first)
    nees = np.einsum("ni,nij,nj->n", error, np.linalg.inv(cov), error) / 2
    within = nees[nees < 8]
    assert len(within) > 0.8 * len(nees)
    assert 0.4 < within.mean() < 1.5


@pytest.mark.parametrize("kind", ["sift", "orb"])
def test_warps_are_the_slopes_of_the_homography(kind, picture, rng):
    a_image, b_image, truth = warped(picture, rng, strength=0.02, scale=0.7, angle=0.5)
    a, b = detect_features(a_image, kind), detect_features(b_image, kind)
    matches = match_features(a, b)
    first, second = matches.points(a, b)
    right = np.hypot(*(second - moved(truth, first)).T) < 2.0
    apart = matches.warps(a, b)[right] - slopes(truth, first[right])
    assert np.median(np.abs(apart)) < 0.08


@pytest.mark.parametrize("kind", KINDS)
def test_arrays_belong_together_and_are_frozen(kind, picture, rng):
    image = warped(picture, rng)[0]
    found = detect_features(image, kind, count=150)
    height, width = image.shape
    assert len(found) == 150
    assert found.kind == kind
    assert (found.pixels > -0.5).all()
    assert (found.pixels < (width - 0.5, height - 0.5)).all()
    assert found.binary == (found.descriptors.dtype == np.uint8)
    assert (np.diff(found.response) <= 0).all()
    assert (found.sigma_px > 0).all()
    with pytest.raises(ValueError, match="read-only"):
        found.pixels[0] = 0.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (15, 15), (31, 31), (40, 62), (64, 64)])
def test_small_and_flat_images_have_none(kind, shape):
    found = detect_features(np.full(shape, 90, np.uint8), kind)
    assert len(found) == 0
    assert len(match_features(found, found)) == 0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shape", [(1, 1), (7, 40), (17, 17), (33, 33), (40, 62), (64, 63), (65, 66)])
def test_small_images_with_texture_are_no_trouble(kind, shape, rng):
    found = detect_features(rng.integers(0, 256, shape, dtype=np.uint8), kind)
    assert found.descriptors.shape[0] == len(found)


def test_colour_and_grey_give_the_same(picture):
    grey = np.rint(picture).astype(np.uint8)
    found = detect_features(grey, "orb")
    assert np.array_equal(found.pixels, detect_features(np.dstack([grey] * 3), "orb").pixels)


def test_mask_holds_features_back(picture):
    grey = np.rint(picture).astype(np.uint8)
    mask = np.zeros(grey.shape, bool)
    mask[:, :240] = True
    for kind in ("sift", "orb", "fast", "harris"):
        found = detect_features(grey, kind, mask=mask)
        assert len(found) > 20
        assert found.pixels[:, 0].max() < 242.5


def test_spreading_reaches_what_the_strongest_leave_out(rng):
    image = np.full((400, 600), 100.0)
    image[:200, :200] = rng.uniform(0, 255, (200, 200))
    image += 8.0 * cv2.GaussianBlur(rng.standard_normal(image.shape), (0, 0), 2.0) / 0.14
    image = np.clip(image, 0, 255).astype(np.uint8)

    def outside(found):
        return np.mean((found.pixels > 210).any(axis=1))

    heaped = detect_features(image, "orb", count=300, spread=False)
    spread = detect_features(image, "orb", count=300)
    assert outside(heaped) < 0.02
    assert outside(spread) > 0.15


def test_spread_rows_take_the_strongest_and_the_best_of_each_cell(rng):
    pixels, response = rng.uniform(0, 100, (5000, 2)), rng.random(5000)
    response[(pixels < 50).all(axis=1)] += 1.0
    rows = spread_rows(pixels, response, (100, 100), 200)
    assert len(set(rows.tolist())) == 200
    assert set(np.argsort(-response)[:100].tolist()) < set(rows.tolist())
    cells = {(int(x // 34), int(y // 34)) for x, y in pixels[rows]}
    assert len(cells) == 9
    assert response[rows].min() > 0.5


def test_spread_levels_give_every_level_its_share(rng):
    pixels, response = rng.uniform(0, 100, (4000, 2)), rng.random(4000)
    scale = np.repeat([1.0, 2.0, 4.0], [3000, 990, 10])
    response[scale == 1.0] += 10.0
    rows = spread_levels(pixels, response, scale, (100, 100), 140)
    assert len(set(rows.tolist())) == 140
    counts = [int((scale[rows] == one).sum()) for one in (1.0, 2.0, 4.0)]
    # of 140, 20 would be of the coarsest, which has 10; the rest falls to the others, two to one
    assert counts == [86, 44, 10]
    assert (np.diff(response[rows]) <= 0).all()
    assert np.array_equal(spread_rows(pixels[:7], response[:7], (100, 100), 20), np.argsort(-response[:7]))


def test_precise_doubling_leaves_no_quarter_pixel(rng):
    """Centres of known discs: SIFT's default lies a quarter of a pixel off."""
    centres = np.array([(40.0 + 60 * i, 40.0 + 60 * j) for i in range(6) for j in range(5)])
    centres = centres + rng.uniform(-0.5, 0.5, centres.shape)
    y, x = np.mgrid[:330, :400].astype(float)
    light = np.full(x.shape, 60.0)
    for cx, cy in centres:
        light += 75.0 * (1.0 - np.tanh(np.hypot(x - cx, y - cy) - 6.0))
    found = detect_features(np.rint(light).astype(np.uint8), "sift")
    apart = found.pixels[:, None] - centres
    near = np.hypot(apart[..., 0], apart[..., 1]).min(axis=1) < 2.0
    error = apart[near][np.arange(near.sum()), np.hypot(*apart[near].transpose(2, 0, 1)).argmin(axis=1)]
    assert len(error) >= 30
    assert np.abs(np.median(error, axis=0)).max() < 0.05


def test_says_what_cannot_be():
    image = np.zeros((40, 40), np.uint8)
    with pytest.raises(ModelError, match="no features are called 'surf'"):
        detect_features(image, "surf")
    with pytest.raises(ModelError, match="1 or more"):
        detect_features(image, count=0)
    with pytest.raises(DataError, match="8 bits"):
        detect_features(image.astype(float))
    with pytest.raises(ShapeError, match="one size"):
        detect_features(image, mask=np.ones((3, 3)))
    zero = np.zeros(1)
    with pytest.raises(NotFiniteError, match="NaN"):
        Features(np.full((1, 2), np.nan), np.zeros((1, 8), np.uint8), zero, zero, zero, zero)
    with pytest.raises(ShapeError, match="descriptors"):
        Features(np.zeros((1, 2)), np.zeros((2, 8), np.uint8), zero, zero, zero, zero)
