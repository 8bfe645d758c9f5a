"""What docs/conventions.md says of images and cameras, sentence by sentence."""

import cv2
import numpy as np
import pytest

from vision3d.boards import board_from_text
from vision3d.camera import LENSES, Camera
from vision3d.render import Plane, cells, marker_corners, render_planes

CAMERA = Camera("pinhole", (500.0, 500.0, 319.5, 239.5), (), (640, 480))


def test_a_camera_looks_along_z_with_x_right_and_y_down():
    pixels = CAMERA.project(np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [0.0, 0.1, 1.0]]))
    np.testing.assert_allclose(pixels, [[319.5, 239.5], [369.5, 239.5], [319.5, 289.5]], atol=1e-12)


def test_what_is_behind_a_camera_has_no_pixel():
    assert np.isnan(CAMERA.project(np.array([[0.1, 0.1, -1.0], [0.1, 0.1, 0.0]]))).all()


def test_the_centre_of_the_top_left_pixel_is_the_origin():
    """An edge of the world that falls on x = 99.5 lies between pixels 99 and 100."""
    edge_m = (99.5 - 319.5) / 500.0
    halves = cells(np.array([-1.0, edge_m, 1.0]), np.array([-1.0, 1.0]), np.array([[0.0, 1.0]]))
    plane = Plane(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), halves)
    image = render_planes(
        CAMERA, [plane], rng=np.random.default_rng(1), blur_px=0.0, noise=0.0, vignetting=0.0
    )
    row = image[240].astype(int)
    assert row[100] - row[99] > 100
    assert abs(row[101] - row[100]) < 3
    assert abs(row[99] - row[98]) < 3


@pytest.mark.parametrize("lens", ["brown4", "brown5", "rational8", "thin12"])
def test_lenses_are_opencv_s_parameter_by_parameter(lens, rng):
    distortion = rng.normal(scale=0.01, size=len(LENSES[lens].distortion))
    camera = Camera(lens, (500.0, 510.0, 320.0, 240.0), distortion, (640, 480))
    points = rng.uniform([-0.4, -0.3, 0.9], [0.4, 0.3, 1.2], size=(20, 3))
    theirs, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, distortion)
    np.testing.assert_allclose(camera.project(points), theirs.reshape(-1, 2), atol=1e-9)
    assert camera.names == ("fx", "fy", "cx", "cy", *LENSES[lens].distortion)


def test_a_board_is_counted_as_opencv_counts_it():
    checkerboard = board_from_text("9x6", kind="checkerboard", square="25mm")
    assert checkerboard.count == 9 * 6
    assert np.ptp(checkerboard.points[:, 0]) == pytest.approx(8 * 0.025)
    charuco = board_from_text("5x7", kind="charuco", square="40mm", marker="20mm", dictionary="6x6_250")
    assert charuco.count == 4 * 6


def test_the_corners_of_a_marker_go_clockwise_from_the_top_left():
    corners = marker_corners(0.1)
    np.testing.assert_allclose(
        corners, [[-0.05, -0.05, 0.0], [0.05, -0.05, 0.0], [0.05, 0.05, 0.0], [-0.05, 0.05, 0.0]]
    )
