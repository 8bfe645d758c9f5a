"""Canny and Hough: OpenCV's bits, and lines that are known."""

import cv2
import numpy as np
import pytest
from image_worlds import BACKENDS, noise

from sequential.errors import DataError
from vision3d.image import canny, gaussian_blur, hough_lines

PHOTOGRAPHS = ("building.jpg", "home.jpg", "sudoku.png", "left01.jpg")
STEPS = [(1.0, np.pi / 180), (2.0, np.pi / 90), (0.7, 0.013), (1.0, 0.01)]


@pytest.fixture
def photographs(data_dir):
    folder = data_dir / "vision" / "opencv"
    return [cv2.imread(str(folder / name), cv2.IMREAD_GRAYSCALE)[:480, :640].copy() for name in PHOTOGRAPHS]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("l2", [False, True])
@pytest.mark.parametrize("limits", [(50, 150), (100.7, 200.2), (300, 20), (0, 0)])
def test_canny_is_opencv_s(backend, l2, limits, rng):
    for image in (noise(rng), gaussian_blur(noise(rng, (50, 60)), 2.0), np.full((5, 5), 9, np.uint8)):
        theirs = cv2.Canny(image, *limits, L2gradient=l2)
        np.testing.assert_array_equal(canny(image, *limits, l2=l2, backend=backend), theirs)


def test_canny_of_photographs(photographs):
    for image in photographs:
        np.testing.assert_array_equal(canny(image, 50, 150), cv2.Canny(image, 50, 150))


def their_lines(edges, rho, theta, least):
    found = cv2.HoughLinesWithAccumulator(edges, rho, theta, least)
    return np.zeros((0, 3), np.float32) if found is None else found.reshape(-1, 3)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("rho", "theta"), STEPS)
def test_hough_is_opencv_s(backend, rho, theta, photographs, rng):
    scattered = (rng.random((80, 90)) < 0.05).astype(np.uint8)
    for edges, least in ((cv2.Canny(photographs[0], 50, 150), 100), (scattered, 9), (scattered * 0, 1)):
        found = hough_lines(edges, least, rho_px=rho, theta_rad=theta, backend=backend)
        theirs = their_lines(edges, rho, theta, least)
        assert found.votes.tolist() == theirs[:, 2].tolist()
        np.testing.assert_allclose(found.rho_px, theirs[:, 0], rtol=1e-6)
        np.testing.assert_allclose(found.theta_rad, theirs[:, 1], rtol=1e-6)


@pytest.mark.parametrize("degrees", [0, 17, 45, 90, 133, 178])
def test_a_drawn_line_is_found(degrees):
    theta = np.radians(degrees)
    y, x = np.mgrid[:150, :200]
    rho = 100 * np.cos(theta) + 75 * np.sin(theta)
    edges = np.abs(x * np.cos(theta) + y * np.sin(theta) - rho) < 0.5
    found = hough_lines(edges, 60)
    # near 0 and 180° the same line may be named with its normal turned
    turned = np.cos(found.theta_rad[0] - theta)
    assert abs(turned) > np.cos(np.radians(1.01))
    assert abs(found.rho_px[0] * np.sign(turned) - rho) <= 2.0
    on_it = np.column_stack(np.nonzero(edges)[::-1])
    assert np.abs(found.distance_px(on_it)[0]).max() < 4.0


def test_bad_arguments_are_said():
    with pytest.raises(DataError, match="below zero"):
        canny(np.zeros((4, 4), np.uint8), -1, 5)
    for steps in ({"rho_px": 0.0}, {"theta_rad": 4.0}):
        with pytest.raises(DataError, match="steps"):
            hough_lines(np.zeros((4, 4)), 5, **steps)
