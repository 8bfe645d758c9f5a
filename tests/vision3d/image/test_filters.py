"""Convolution, box and Gaussian: three backends, one answer, and that is OpenCV's."""

import cv2
import numpy as np
import pytest
from image_worlds import BACKENDS, BORDERS, TYPES, noise
from scipy import ndimage, signal

from sequential.errors import DataError, FactorlabError, NotFiniteError, ShapeError
from vision3d.image import box_blur, box_sums, convolve, correlate, gaussian_blur, gaussian_kernel
from vision3d.image.borders import cv2_border
from vision3d.image.smoothing import fixed_point

DEPTHS = {"int16": cv2.CV_16S, "float32": cv2.CV_32F, "float64": cv2.CV_64F}


def windows(rng):
    return {
        "whole numbers": rng.integers(-9, 10, (3, 3)).astype(float),
        "even": rng.integers(-9, 10, (4, 2)).astype(float),
        "heavy": rng.integers(-300, 300, (5, 7)).astype(float),
        "fractions": rng.standard_normal((5, 3)),
        "a row": rng.standard_normal((1, 7)),
        "one": np.array([[2.0]]),
    }


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("backend", BACKENDS)
def test_correlation_is_opencv_s(backend, kind, border, rng):
    image = noise(rng, kind=kind)
    for taps in windows(rng).values():
        theirs = cv2.filter2D(image, -1, taps, borderType=cv2_border(border))
        found = correlate(image, taps, border=border, backend=backend)
        assert found.dtype == theirs.dtype
        if kind == "uint8" and np.array_equal(taps, np.rint(taps)):
            np.testing.assert_array_equal(found, theirs)
        elif kind.startswith("float"):  # OpenCV fuses products and sums where the processor can
            most = np.abs(taps).sum() * np.abs(image).max()
            np.testing.assert_allclose(found, theirs, rtol=0, atol=8 * np.finfo(kind).eps * most)
        else:  # so a half may be rounded the other way
            apart = np.abs(found.astype(int) - theirs)
            assert apart.max() <= 1
            assert np.mean(apart > 0) < 0.01


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("result", DEPTHS)
def test_results_of_another_type_too(backend, result, rng):
    image = noise(rng)
    for taps in windows(rng).values():
        theirs = cv2.filter2D(image, DEPTHS[result], taps)
        found = correlate(image, taps, dtype=result, backend=backend)
        if np.array_equal(taps, np.rint(taps)):
            np.testing.assert_array_equal(found, theirs)
        else:
            step = 1 if result == "int16" else 8 * np.finfo(result).eps * np.abs(taps).sum() * 255
            np.testing.assert_allclose(found.astype(float), theirs, rtol=0, atol=step)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("border", [*BORDERS, "wrap"])
def test_convolution_is_scipy_s(backend, border, rng):
    image = noise(rng, (20, 23), "float64")
    modes = {"constant": "constant", "replicate": "nearest", "reflect": "reflect", "reflect101": "mirror"}
    for taps in windows(rng).values():
        if min(taps.shape) > 1 and 0 in (taps.shape[0] % 2, taps.shape[1] % 2):
            continue  # the middle of an even window is a matter of convention
        theirs = ndimage.convolve(image, taps, mode=modes.get(border, "wrap"))
        found = convolve(image, taps, border=border, backend=backend)
        np.testing.assert_allclose(found, theirs, rtol=0, atol=1e-9)


@pytest.mark.parametrize("backend", BACKENDS)
def test_laws_of_convolution(backend, rng):
    f = noise(rng, (24, 24), "float64")
    g, h = rng.standard_normal((3, 5)), rng.standard_normal((5, 3))

    def by(image, taps):
        return convolve(image, taps, border="wrap", backend=backend)

    np.testing.assert_allclose(by(by(f, g), h), by(by(f, h), g), atol=1e-9)  # commutes
    np.testing.assert_allclose(by(by(f, g), h), by(f, signal.convolve2d(g, h)), atol=1e-9)  # associates
    np.testing.assert_allclose(by(f, g) + by(f, g[::-1]), by(f, g + g[::-1]), atol=1e-9)  # is linear
    impulse = np.zeros((7, 7))
    impulse[3, 3] = 1.0
    np.testing.assert_array_equal(by(impulse, g)[2:5, 1:6], g)  # an impulse shows the window as written


@pytest.mark.parametrize("backend", BACKENDS)
def test_constants_channels_anchors_and_whole_numbers(backend, rng):
    image = noise(rng, (14, 15, 3))
    taps = rng.integers(-2, 3, (3, 3)).astype(float)
    around = np.pad(image, ((1, 1), (1, 1), (0, 0)), constant_values=9)
    theirs = cv2.filter2D(around, -1, taps)[1:-1, 1:-1]
    found = correlate(image, taps, border="constant", value=9, backend=backend)
    np.testing.assert_array_equal(found, theirs)
    corner = correlate(image, taps, anchor=(0, 2), backend=backend)
    np.testing.assert_array_equal(corner, cv2.filter2D(image, -1, taps, anchor=(2, 0)))
    whole = noise(rng, (9, 9), "int32")
    np.testing.assert_array_equal(correlate(whole, np.ones((1, 1)), backend=backend), whole)


@pytest.mark.parametrize("size", [1, 3, 5, 7, 9, 11, 21])
@pytest.mark.parametrize("sigma", [0.0, 0.5, 1.0, 2.3, 7.0])
def test_the_gaussian_s_taps_are_opencv_s(size, sigma):
    theirs = cv2.getGaussianKernel(size, sigma).ravel()
    taps = gaussian_kernel(size, sigma)
    np.testing.assert_allclose(taps, theirs, rtol=0, atol=1e-15)
    assert fixed_point(taps).sum() == 256


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize(
    ("sigma", "size"), [(1.5, 0), (0.0, 5), (0.0, 9), (1.2, 9), (0.0, 15), (3.0, 3), (2.0, 1)]
)
def test_gaussian_blur_is_opencv_s(backend, kind, sigma, size, rng):
    image = np.abs(noise(rng, kind=kind)) if kind.startswith("int") else noise(rng, kind=kind)
    for border in BORDERS:
        theirs = cv2.GaussianBlur(image, (size, size), sigma, borderType=cv2_border(border))
        found = gaussian_blur(image, sigma, size=size, border=border, backend=backend)
        assert found.dtype == image.dtype
        if kind.startswith("uint"):
            np.testing.assert_array_equal(found, theirs)
        else:  # sums of fractions in another order; 1 where a half is rounded the other way
            step = {"int16": 1.0, "float32": 1e-4, "float64": 1e-11}[kind]
            np.testing.assert_allclose(found.astype(float), theirs, rtol=0, atol=step)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("size", [1, 3, 5, 15])
def test_box_is_opencv_s(backend, size, rng):
    for border in BORDERS:
        image = noise(rng)
        theirs = cv2.blur(image, (size, size), borderType=cv2_border(border))
        np.testing.assert_array_equal(box_blur(image, size, border=border, backend=backend), theirs)
        wide = noise(rng, kind="float64")
        total = cv2.boxFilter(wide, -1, (size, size), normalize=False, borderType=cv2_border(border))
        np.testing.assert_allclose(box_sums(wide, size, border=border, backend=backend), total, atol=1e-9)
    around = box_sums(noise(rng, (8, 9, 3), "int16"), size, border="wrap", backend=backend)
    assert np.ptp(around.sum(axis=(0, 1)) / size**2 % 1) == 0


@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda im: correlate(im, [1, 2, 1]), ShapeError),
        (lambda im: correlate(im, [[np.nan]]), NotFiniteError),
        (lambda im: correlate(im, np.ones((3, 3)), anchor=(3, 0)), ShapeError),
        (lambda im: correlate(im, np.ones((3, 3)), backend="fast"), DataError),
        (gaussian_blur, DataError),
        (lambda im: gaussian_blur(im, -1.0), DataError),
        (lambda im: gaussian_blur(im, 1.0, size=4), ShapeError),
        (lambda _: gaussian_kernel(0), ShapeError),
        (lambda im: box_sums(im, 0), ShapeError),
        (lambda im: box_sums(im, 5000), ShapeError),
    ],
)
def test_bad_arguments_are_said(call, error):
    with pytest.raises(error) as caught:
        call(np.zeros((5, 5), np.uint8))
    assert isinstance(caught.value, FactorlabError)
    assert (
        "expected" in str(caught.value)
        or "NaN" in str(caught.value)
        or "known" in str(caught.value)
        or ("lies outside" in str(caught.value))
    )
