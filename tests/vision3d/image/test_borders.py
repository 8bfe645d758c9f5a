"""What lies beyond the edge, against OpenCV."""

import cv2
import numpy as np
import pytest
from image_worlds import BORDERS, TYPES, noise

from sequential.errors import DataError, ShapeError
from vision3d.image import pad
from vision3d.image.borders import border_index, cv2_border
from vision3d.image.pixels import as_bytes, as_grey, as_image, as_mask, checked_backend, saturate

ALL = (*BORDERS, "wrap")


@pytest.mark.parametrize("border", ALL)
@pytest.mark.parametrize("around", [(1, 2, 3, 4), (0, 0, 0, 0), (40, 55, 90, 120)])
@pytest.mark.parametrize("shape", [(13, 17), (1, 1), (2, 9), (9, 1), (5, 6, 3)])
def test_pad_is_opencv_s(border, around, shape, rng):
    image = noise(rng, shape)
    theirs = cv2.copyMakeBorder(image, *around, cv2_border(border), value=(7, 7, 7, 7))
    np.testing.assert_array_equal(pad(image, *around, border, 7), theirs)


@pytest.mark.parametrize("border", ALL)
def test_indices_are_opencv_s(border):
    for size in (1, 2, 5):
        beyond = np.arange(-7, 12)
        theirs = [cv2.borderInterpolate(int(k), size, cv2_border(border)) for k in beyond]
        assert border_index(beyond, size, border).tolist() == theirs


def test_saturation_is_opencv_s(rng):
    values = np.concatenate([np.arange(-40, 80) / 2.0 - 10, [254.5, 255.5, 256.5, 300.0, 32767.5, -32769.0]])
    for name, depth in (("uint8", cv2.CV_8U), ("int16", cv2.CV_16S), ("uint16", cv2.CV_16U)):
        theirs = cv2.filter2D(values[None], cv2.CV_64F, np.ones((1, 1)))
        back = np.zeros((1, len(values)), name)
        cv2.add(theirs, 0.0, back, dtype=depth)
        np.testing.assert_array_equal(saturate(values[None], name), back)


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        (np.zeros(5), ShapeError, "(height, width)"),
        (np.zeros((0, 4), np.uint8), ShapeError, "no pixel"),
        (np.zeros((4, 4, 7), np.uint8), ShapeError, "channels"),
        (np.zeros((4, 4), complex), DataError, "astype"),
        ("photo.png", ShapeError, "expected"),
        (None, ShapeError, "expected"),
    ],
)
def test_what_is_no_image_is_said(given, error, words):
    with pytest.raises(error, match=words.replace("(", r"\(").replace(")", r"\)")):
        as_image(given)


def test_masks_and_channels():
    assert as_image(np.array([[True, False]])).tolist() == [[255, 0]]
    assert as_mask(np.array([[0.0, -2.0]])).tolist() == [[0, 1]]
    assert as_grey(np.zeros((3, 4, 1))).shape == (3, 4)
    with pytest.raises(DataError, match="NaN"):
        as_mask(np.array([[np.nan]]))
    with pytest.raises(ShapeError, match="height"):
        as_mask(np.zeros(3))
    with pytest.raises(ShapeError, match=r"grey\(image\)"):
        as_grey(np.zeros((3, 4, 3), np.uint8))
    with pytest.raises(DataError, match="uint8"):
        as_bytes(np.zeros((3, 4)))


def test_unknown_names_are_said():
    with pytest.raises(DataError, match="known are"):
        pad(np.zeros((3, 3)), 1, 1, 1, 1, "mirror")
    with pytest.raises(DataError, match="known are"):
        cv2_border("mirror")
    with pytest.raises(DataError, match="backend"):
        checked_backend("gpu")
    with pytest.raises(DataError, match="below zero"):
        pad(np.zeros((3, 3)), -1, 0, 0, 0)


@pytest.mark.parametrize("kind", TYPES)
def test_the_type_is_kept(kind, rng):
    assert pad(noise(rng, (4, 5), kind), 1, 1, 1, 1).dtype == kind
