"""The thirteen left views of OpenCV's sample: figures of the fit, and what OpenCV's own missed."""

import cv2
import numpy as np
import pytest

from vision3d.boards import Checkerboard
from vision3d.calibrate import calibrate, choose_lens, difference, leave_one_out, projection_uncertainty
from vision3d.calibrate.detection import detect_views
from vision3d.camera import Camera
from vision3d.views import View

BOARD = Checkerboard(9, 6, square_m=0.025)
MOVED = {"left02.jpg": 6, "left13.jpg": 5, "left09.jpg": 3, "left07.jpg": 1}
"""Corners that a window of 23 px moves by more than noise: it reaches over to their neighbours."""


@pytest.fixture(scope="module")
def images(data_dir):
    paths = sorted((data_dir / "vision" / "opencv").glob("left[01]?.jpg"))
    return [(path.name, cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)) for path in paths]


@pytest.fixture(scope="module")
def views(images):
    return detect_views(images, BOARD).views


def refined(images, half_width):
    """Views as a tutorial of OpenCV makes them, with a window of one size for all."""
    found = []
    for name, image in images:
        seen, corners = cv2.findChessboardCorners(image, (9, 6))
        if seen:
            criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 30, 1e-3)
            corners = cv2.cornerSubPix(image, corners, (half_width, half_width), (-1, -1), criteria)
            pixels = np.asarray(corners, np.float64).reshape(-1, 2)
            found.append(View(name, image.shape[::-1], BOARD.points, pixels, np.arange(54), 0.1))
    return tuple(found)


def test_figures_of_the_default_way(views):
    found = choose_lens(views).calibration
    left = leave_one_out(found)
    assert len(found.views) == 13
    assert found.rms_all_px <= 0.175
    assert left.rms_px <= 0.182
    assert len(found.outliers) <= 3


def test_figures_with_opencv_corners(images):
    found = calibrate(refined(images, 5))
    assert found.rms_all_px == pytest.approx(0.1954, abs=2e-4)
    assert leave_one_out(found).rms_px == pytest.approx(0.2012, abs=5e-4)
    np.testing.assert_allclose(found.camera.parameters[:4], [532.827, 532.946, 342.487, 233.856], atol=5e-3)


def test_corners_that_a_large_window_moves_are_named_and_left_out(images):
    views = refined(images, 11)
    robust, plain = calibrate(views), calibrate(views, robust=False)
    assert plain.rms_px == pytest.approx(0.408, abs=2e-3)
    named = {views[v].name: [one for one, _ in robust.outliers].count(v) for v, _ in robust.outliers}
    assert named == MOVED
    assert robust.rms_px < 0.18
    good = calibrate(refined(images, 5))
    assert difference(robust, good).sigmas < 1.5
    assert abs(plain.camera.parameters[0] - good.camera.parameters[0]) > 3.0
    assert abs(robust.camera.parameters[0] - good.camera.parameters[0]) < 1.0


def test_the_published_calibration_is_the_one_with_the_large_window(images, views):
    published = Camera(
        "brown5", [535.916, 535.916, 342.283, 235.571], [-0.2664, -0.0386, 0.0018, -0.0003, 0.2384]
    )
    plain = calibrate(refined(images, 11), robust=False)
    assert difference(plain, published).rms_px < 0.5 * difference(calibrate(views), published).rms_px


def test_halves_of_the_views_differ_as_much_as_they_say(views):
    """No truth is known here, but two calibrations from disjoint views err apart."""
    pixels = np.stack(np.meshgrid(np.linspace(40, 600, 8), np.linspace(40, 440, 6)), axis=-1).reshape(-1, 2)
    whole = calibrate(views)
    rays = whole.camera.unproject(pixels)
    stated, independent = [], []
    for seed in range(8):
        order = np.random.default_rng(seed).permutation(13)
        one, two = (calibrate([views[i] for i in half]) for half in (order[:7], order[7:]))
        off = np.sum((one.camera.project(rays) - two.camera.project(rays)) ** 2, axis=1)
        stated.append(off / sum(projection_uncertainty(half, pixels).std_px ** 2 for half in (one, two)))
        jacobian = whole.camera.project_jacobians(rays)[2]
        cov = one.cov_independent + two.cov_independent
        independent.append(off / np.einsum("nij,jk,nik->n", jacobian, cov, jacobian))
    assert whole.inflation > 1.5
    assert np.sqrt(np.median(independent)) > 1.4
    assert 0.5 < np.sqrt(np.median(stated)) < 1.3
    assert np.sqrt(np.mean(stated)) < 1.7
