"""Histogram, equalisation and thresholds, against OpenCV and against their definitions."""

import cv2
import numpy as np
import pytest
from image_worlds import BACKENDS, grey_family, noise

from sequential.errors import DataError, ShapeError
from vision3d.image import adaptive_threshold, equalise, histogram, otsu, threshold

FAMILY = tuple(grey_family(np.random.default_rng(0)))
RULES = {"binary": 0, "binary_inv": 1, "truncate": 2, "to_zero": 3, "to_zero_inv": 4}
PHOTOGRAPHS = ("building.jpg", "home.jpg", "sudoku.png", "notes.png", "smarties.png", "left01.jpg")


@pytest.fixture(params=FAMILY)
def image(request, rng):
    return grey_family(rng)[request.param]


@pytest.fixture
def photographs(data_dir):
    folder = data_dir / "vision" / "opencv"
    return [cv2.imread(str(folder / name), cv2.IMREAD_GRAYSCALE) for name in PHOTOGRAPHS]


def their_otsu(image):
    return int(cv2.threshold(image, 0, 255, cv2.THRESH_OTSU)[0])


@pytest.mark.parametrize("backend", BACKENDS)
def test_levels_are_opencv_s(backend, image):
    np.testing.assert_array_equal(
        histogram(image, backend=backend), np.bincount(image.ravel(), minlength=256)
    )
    np.testing.assert_array_equal(equalise(image, backend=backend), cv2.equalizeHist(image))
    assert otsu(image, backend=backend) == their_otsu(image)


@pytest.mark.parametrize("backend", BACKENDS)
def test_photographs(backend, photographs):
    for image in photographs:
        assert otsu(image, backend=backend) == their_otsu(image)
        np.testing.assert_array_equal(equalise(image, backend=backend), cv2.equalizeHist(image))


def test_otsu_parts_best(rng):
    image = grey_family(rng)["two hills"]

    def between(level):
        low, high = image[image <= level], image[image > level]
        return len(low) * len(high) * (low.mean() - high.mean()) ** 2 if len(low) and len(high) else 0.0

    spread = [between(level) for level in range(256)]
    assert spread[otsu(image)] == pytest.approx(max(spread), rel=1e-9)


def test_equalised_levels_are_nearly_even(rng):
    dark = np.clip(rng.normal(60, 12, (200, 200)), 0, 255).astype(np.uint8)

    def unevenness(image):
        return np.abs(np.histogram(image, bins=8, range=(0, 256))[0] / image.size - 1 / 8).max()

    assert unevenness(equalise(dark)) < 0.05
    assert unevenness(dark) > 0.3


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("level", [0, 100, 100.7, 254.2, 255, -3])
def test_threshold_is_opencv_s(rule, level, rng):
    for kind in ("uint8", "int16", "float32"):
        image = noise(rng, kind=kind)
        theirs = cv2.threshold(image, level, 200, RULES[rule])[1]
        np.testing.assert_array_equal(threshold(image, level, rule=rule, high=200), theirs)


def test_a_threshold_found(rng):
    image = grey_family(rng)["two hills"]
    np.testing.assert_array_equal(
        threshold(image, "otsu"), cv2.threshold(image, 0, 255, cv2.THRESH_OTSU | cv2.THRESH_BINARY)[1]
    )


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("size", [3, 15, 51])
@pytest.mark.parametrize("offset", [0, 3, -2.5, 7.3])
@pytest.mark.parametrize("inverted", [False, True])
def test_adaptive_threshold_is_opencv_s(backend, size, offset, inverted, image):
    options = {"inverted": inverted, "backend": backend}
    for weights, method in (
        ("mean", cv2.ADAPTIVE_THRESH_MEAN_C),
        ("gaussian", cv2.ADAPTIVE_THRESH_GAUSSIAN_C),
    ):
        theirs = cv2.adaptiveThreshold(image, 255, method, int(inverted), size, offset)
        found = adaptive_threshold(image, size, offset, weights=weights, **options)
        # a Gaussian mean that falls on a half may be rounded either way
        allowed = 0 if weights == "mean" else max(1, image.size // 1000)
        assert np.count_nonzero(found != theirs) <= allowed


def test_adaptive_threshold_of_photographs(photographs):
    for image in photographs:
        theirs = cv2.adaptiveThreshold(image, 255, cv2.ADAPTIVE_THRESH_MEAN_C, 0, 31, 5)
        np.testing.assert_array_equal(adaptive_threshold(image, 31, 5), theirs)


def test_slow_light_does_not_matter_to_it():
    y, x = np.mgrid[:120, :160]
    line = np.abs(x - 80 - 0.1 * y) < 6
    image = (60 + x + np.where(line, -30, 0)).astype(np.uint8)  # darker line, light from the right
    assert np.mean(adaptive_threshold(image, 41, 8, inverted=True).astype(bool) == line) > 0.99
    assert np.mean((threshold(image, "otsu", rule="binary_inv") > 0) == line) < 0.7


@pytest.mark.parametrize(
    "call",
    [
        lambda im: adaptive_threshold(im, 4),
        lambda im: adaptive_threshold(im, 1),
        lambda im: adaptive_threshold(im, 5, weights="median"),
        lambda im: threshold(im, 5, rule="above"),
        lambda im: otsu(im.astype(float)),
        lambda im: otsu(np.dstack([im] * 3)),
        lambda im: histogram(im, backend="gpu"),
    ],
)
def test_bad_arguments_are_said(call):
    with pytest.raises((DataError, ShapeError), match=r"expected|known are"):
        call(np.zeros((5, 5), np.uint8))
