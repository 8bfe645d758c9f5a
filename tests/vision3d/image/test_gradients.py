"""Derivatives against OpenCV, and against images whose slope is known."""

import cv2
import numpy as np
import pytest
from image_worlds import BACKENDS, BORDERS, TYPES, noise

from sequential.errors import DataError
from vision3d.image import derivative_kernels, gradient, sobel
from vision3d.image.borders import cv2_border

DEPTHS = {"int16": cv2.CV_16S, "float32": cv2.CV_32F, "float64": cv2.CV_64F}
ORDERS = [(1, 0), (0, 1), (1, 1), (2, 0), (0, 2)]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("size", [1, 3, 5, 7, "scharr"])
def test_sobel_is_opencv_s_bit_for_bit(backend, kind, size, rng):
    image = noise(rng, kind=kind)
    for border in BORDERS:
        for dx, dy in ORDERS[:2] if size == "scharr" else ORDERS:
            found = sobel(image, dx, dy, size=size, border=border, backend=backend)
            ksize = cv2.FILTER_SCHARR if size == "scharr" else size
            theirs = cv2.Sobel(
                image, DEPTHS[found.dtype.name], dx, dy, ksize=ksize, borderType=cv2_border(border)
            )
            if kind.startswith("float"):
                np.testing.assert_allclose(found, theirs, rtol=0, atol=np.finfo(kind).eps * 80 * 2**12)
            else:
                np.testing.assert_array_equal(found, theirs)


@pytest.mark.parametrize("size", [1, 3, 5, 7])
def test_windows_are_opencv_s(size):
    for dx, dy in ORDERS:
        for ours, theirs in zip(
            derivative_kernels(dx, dy, size), cv2.getDerivKernels(dx, dy, size), strict=True
        ):
            np.testing.assert_array_equal(ours, theirs.ravel())


@pytest.mark.parametrize("backend", BACKENDS)
def test_real_photographs(data_dir, backend):
    for name in ("building.jpg", "home.jpg", "box.png"):
        image = cv2.imread(str(data_dir / "vision" / "opencv" / name), cv2.IMREAD_GRAYSCALE)
        for dx, dy in ((1, 0), (0, 1)):
            np.testing.assert_array_equal(
                sobel(image, dx, dy, backend=backend), cv2.Sobel(image, cv2.CV_16S, dx, dy)
            )


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("degrees", range(-170, 181, 25))
def test_a_ramp_s_slope_and_direction(backend, degrees):
    y, x = np.mgrid[:20, :30].astype(np.float64)
    angle = np.radians(degrees)
    ramp = 3.0 * (x * np.cos(angle) + y * np.sin(angle))
    found = gradient(ramp, backend=backend)
    inside = (slice(2, -2), slice(2, -2))
    np.testing.assert_allclose(found.magnitude[inside], 3.0 * 8, rtol=1e-5)  # the window weighs 8
    turned = np.exp(1j * (found.direction_rad[inside] - angle))
    np.testing.assert_allclose(turned, 1.0, rtol=0, atol=1e-6)


def test_length_and_direction_are_opencv_s(rng):
    found = gradient(noise(rng))
    np.testing.assert_allclose(found.magnitude, cv2.magnitude(found.dx, found.dy), rtol=1e-6)
    theirs = cv2.phase(found.dx, found.dy)  # a polynomial, good to a third of a degree
    apart = (found.direction_rad - theirs + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(apart[found.magnitude > 0]).max() < np.radians(0.4)


def test_colours_and_chosen_types(rng):
    image = noise(rng, (12, 13, 3))
    found = sobel(image, 1, 0, dtype=np.float32)
    np.testing.assert_array_equal(found, cv2.Sobel(image, cv2.CV_32F, 1, 0))


def test_what_cannot_be_asked():
    image = np.zeros((5, 5), np.uint8)
    for arguments in ((0, 0, 3), (-1, 2, 3), (1, 0, 4), (3, 0, 3), (1, 1, "scharr")):
        with pytest.raises(DataError):
            sobel(image, *arguments[:2], size=arguments[2])
