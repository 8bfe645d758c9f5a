"""Erosion and dilation: equal to OpenCV's, and lawful."""

import cv2
import numpy as np
import pytest
from image_worlds import BACKENDS, BORDERS, TYPES, blobs, noise

from sequential.errors import DataError, ShapeError
from vision3d.image import closing, dilate, erode, morphological_gradient, opening, structuring_element
from vision3d.image.borders import cv2_border

SHAPES = {"rectangle": cv2.MORPH_RECT, "cross": cv2.MORPH_CROSS, "ellipse": cv2.MORPH_ELLIPSE}


@pytest.mark.parametrize("shape", SHAPES)
def test_elements_are_opencv_s(shape):
    for size in ((1, 1), (3, 3), (5, 5), (4, 4), (7, 3), (2, 9), (1, 5), (5, 1), (21, 21)):
        theirs = cv2.getStructuringElement(SHAPES[shape], size)
        np.testing.assert_array_equal(structuring_element(size, shape), theirs)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("border", BORDERS)
def test_both_are_opencv_s_bit_for_bit(backend, kind, border, rng):
    elements = [structuring_element(size, shape) for size in ((3, 3), (4, 6)) for shape in SHAPES]
    elements.append((rng.random((5, 4)) < 0.4).astype(np.uint8))
    for image in (noise(rng, kind=kind), noise(rng, (20, 21, 3), kind)):
        for element in elements:
            for times in (1, 3):
                for ours, theirs in ((erode, cv2.erode), (dilate, cv2.dilate)):
                    options = {"iterations": times, "border": border, "backend": backend}
                    np.testing.assert_array_equal(
                        ours(image, element, **options),
                        theirs(image, element, iterations=times, borderType=cv2_border(border)),
                    )


@pytest.mark.parametrize("backend", BACKENDS)
def test_compounds_and_a_constant_outside(backend, rng):
    image = noise(rng)
    element = structuring_element(5, "ellipse")
    for ours, theirs in (
        (opening, cv2.MORPH_OPEN),
        (closing, cv2.MORPH_CLOSE),
        (morphological_gradient, cv2.MORPH_GRADIENT),
    ):
        np.testing.assert_array_equal(
            ours(image, element, backend=backend), cv2.morphologyEx(image, theirs, element)
        )
    for value in (0, 100):
        theirs = cv2.erode(image, element, borderType=cv2.BORDER_CONSTANT, borderValue=value)
        np.testing.assert_array_equal(erode(image, element, value=value, backend=backend), theirs)


@pytest.mark.parametrize("backend", BACKENDS)
def test_laws_of_morphology(backend, rng):
    f = noise(rng)
    for element in (
        structuring_element(3),
        structuring_element(5, "cross"),
        structuring_element(7, "ellipse"),
    ):
        opened, closed = (work(f, element, backend=backend) for work in (opening, closing))
        assert np.all(erode(f, element, backend=backend) <= opened)
        assert np.all(opened <= f)
        assert np.all(f <= closed)
        assert np.all(closed <= dilate(f, element, backend=backend))
        np.testing.assert_array_equal(opening(opened, element, backend=backend), opened)  # once is enough
        np.testing.assert_array_equal(closing(closed, element, backend=backend), closed)
        np.testing.assert_array_equal(  # eroding what is bright is dilating what is dark
            erode(f, element, backend=backend), 255 - dilate(255 - f, element, backend=backend)
        )


def test_specks_go_and_pieces_stay(rng):
    mask = np.zeros((60, 60), np.uint8)
    mask[10:40, 15:45] = 255
    specks = rng.random(mask.shape) < 0.01
    np.testing.assert_array_equal(opening(mask, 3), mask)
    assert np.count_nonzero(opening(np.where(specks, 255, mask), 3) != mask) < 0.01 * mask.size
    assert erode(blobs(rng), 3).dtype == np.uint8  # a mask of booleans will do


def test_nothing_to_do_and_bad_elements():
    image = np.zeros((4, 4), np.uint8)
    np.testing.assert_array_equal(erode(image, iterations=0), image)
    for bad in (np.zeros((3, 3)), np.ones(3)):
        with pytest.raises(ShapeError, match="at least one"):
            erode(image, bad)
    with pytest.raises(ShapeError, match="one pixel"):
        structuring_element(0)
    with pytest.raises(DataError, match="known are"):
        structuring_element(3, "diamond")
