"""Colour spaces against OpenCV's, on every colour there is."""

import cv2
import numpy as np
import pytest
from image_worlds import noise

from sequential.errors import DataError, ShapeError
from vision3d.image import grey, hsv, lab


@pytest.fixture(scope="module")
def colours():
    """Every level of two channels beside a spread of the third, in three turns: ties and extremes are in."""
    a, b = np.meshgrid(np.arange(256), np.arange(256))
    spread = np.arange(0, 256, 15)
    planes = [np.dstack([a, b, np.full_like(a, c)]) for c in spread]
    stacked = np.concatenate(planes).astype(np.uint8)
    return np.concatenate([np.roll(stacked, k, axis=2) for k in range(3)])


def test_grey_and_hue_are_opencv_s_bit_for_bit(colours):
    np.testing.assert_array_equal(grey(colours), cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY))
    np.testing.assert_array_equal(hsv(colours), cv2.cvtColor(colours, cv2.COLOR_BGR2HSV))


def test_lab_is_cie_s(colours, rng):
    some = colours[rng.integers(0, len(colours), 50)]
    found = lab(some)
    assert np.abs(found - lab(some, backend="opencv")).max() < 0.5  # OpenCV interpolates in a table
    known = {(255, 255, 255): (100, 0, 0), (0, 0, 0): (0, 0, 0), (0, 0, 255): (53.24, 80.09, 67.20),
             (0, 255, 0): (87.73, -86.18, 83.18), (255, 0, 0): (32.30, 79.19, -107.86)}  # fmt: skip
    for bgr, expected in known.items():
        np.testing.assert_allclose(lab(np.array([[bgr]], np.uint8))[0, 0], expected, atol=0.05)


def test_the_fast_path_is_the_same(rng):
    image = noise(rng, (30, 40, 3))
    for space in (grey, hsv):
        np.testing.assert_array_equal(space(image), space(image, backend="opencv"))


def test_what_has_no_colour():
    flat = np.full((4, 5), 9, np.uint8)
    np.testing.assert_array_equal(grey(flat), flat)
    np.testing.assert_array_equal(grey(flat[:, :, None]), flat)
    assert grey(np.zeros((3, 3, 4), np.uint8)).shape == (3, 3)
    with pytest.raises(ShapeError, match="blue, green, red"):
        hsv(flat)
    with pytest.raises(DataError, match="uint8"):
        lab(np.zeros((3, 3, 3)))
