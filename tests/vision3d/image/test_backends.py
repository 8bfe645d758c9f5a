"""The three writings of an operation on any small image: hypothesis looks for one that parts them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vision3d import image as im
from vision3d.image import Border, Image, structuring_element

SHAPES = st.tuples(st.integers(1, 12), st.integers(1, 12))
BYTES = SHAPES.flatmap(lambda shape: arrays(np.uint8, shape))
BORDERS = st.sampled_from(("constant", "replicate", "reflect", "reflect101", "wrap"))
TAPS = st.tuples(st.integers(1, 5), st.integers(1, 5)).flatmap(
    lambda shape: arrays(np.int8, shape, elements=st.integers(-20, 20))
)


def agree(work, *backends):
    """The same pixels of the same type from each."""
    first = work("compiled")
    for backend in backends or ("numpy", "opencv"):
        np.testing.assert_array_equal(work(backend), first)
        assert np.asarray(work(backend)).dtype == np.asarray(first).dtype


@given(BYTES, TAPS, BORDERS)
def test_correlation(image: Image, taps, border: Border):
    agree(lambda by: im.correlate(image, taps, dtype=np.int16, border=border, backend=by))
    agree(lambda by: im.convolve(image, taps, border=border, backend=by))


@given(BYTES, st.sampled_from((3, 5, 7, "scharr")), st.booleans(), BORDERS)
def test_sobel(image, size, upright, border):
    agree(lambda by: im.sobel(image, int(upright), int(not upright), size=size, border=border, backend=by))


@given(BYTES, st.sampled_from((3, 5, 9)), BORDERS)
def test_smoothing(image, size, border):
    agree(lambda by: im.gaussian_blur(image, 1.1, size=size, border=border, backend=by))
    agree(lambda by: im.box_blur(image, size, border=border, backend=by))


@given(BYTES)
def test_levels(image):
    agree(lambda by: im.histogram(image, backend=by))
    agree(lambda by: im.otsu(image, backend=by))
    agree(lambda by: im.equalise(image, backend=by))
    agree(lambda by: im.adaptive_threshold(image, 5, 2.0, backend=by))


@given(BYTES, arrays(np.bool_, st.tuples(st.integers(1, 4), st.integers(1, 4))), BORDERS)
def test_morphology(image, element, border):
    element[0, 0] |= not element.any()
    agree(lambda by: im.erode(image, element, border=border, backend=by))
    agree(lambda by: im.dilate(image, element, iterations=2, border=border, backend=by))


@given(SHAPES.flatmap(lambda shape: arrays(np.bool_, shape)), st.sampled_from((4, 8)))
def test_components(mask, connectivity):
    found = [
        im.connected_components(mask, connectivity=connectivity, **way)
        for way in ({}, {"method": "breadth-first"}, {"backend": "opencv"})
    ]
    for other in found[1:]:
        for name, value in vars(found[0]).items():
            np.testing.assert_allclose(getattr(other, name), value, rtol=0, atol=1e-9)


@given(BYTES, st.integers(0, 400), st.integers(0, 400))
def test_edges(image, low, high):
    agree(lambda by: im.canny(image, low, high, backend=by))
    agree(lambda by: im.hough_lines(im.canny(image, low, high), 1, backend=by).votes)


EVERY = {
    im.adaptive_threshold: (5,),
    im.box_blur: (3,),
    im.canny: (50, 100),
    im.connected_components: (),
    im.convolve: (np.ones((3, 3)),),
    im.corners: (),
    im.dilate: (structuring_element(3, "cross"),),
    im.equalise: (),
    im.erode: (),
    im.gaussian_blur: (1.0,),
    im.gradient: (),
    im.harris: (),
    im.histogram: (),
    im.hough_lines: (5,),
    im.opening: (),
    im.otsu: (),
    im.sobel: (1, 0),
}


@pytest.mark.parametrize("work", EVERY, ids=lambda work: work.__name__)
@pytest.mark.parametrize("backend", ["compiled", "numpy", "opencv"])
def test_the_image_given_is_left_as_it_was(work, backend, rng):
    image = rng.integers(0, 256, (20, 30), dtype=np.uint8)
    before = image.copy()
    image.setflags(write=False)  # read-only arrays are taken
    work(image, *EVERY[work], backend=backend)
    np.testing.assert_array_equal(image, before)
    mask = image > 200
    mask.setflags(write=False)
    if work in (im.connected_components, im.hough_lines, im.erode):
        work(mask, *EVERY[work], backend=backend)


def test_views_and_slices_are_taken(rng):
    whole = rng.integers(0, 256, (40, 60, 3), dtype=np.uint8)
    for view in (whole[::2, ::3, 1], whole[5:20, 7:30, 0].T, np.flip(whole[:, :, 2])):
        for backend in ("compiled", "numpy", "opencv"):
            np.testing.assert_array_equal(
                im.sobel(view, 1, 0, backend=backend), im.sobel(view.copy(), 1, 0, backend="numpy")
            )
