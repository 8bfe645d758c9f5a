"""Rectified pairs: rows agree, depth comes out, and where the options agree it is OpenCV's rectification."""

import cv2
import numpy as np
import pytest
from rig_worlds import CONVERGING, EVERY_RIG, FISHEYES, SIDE_BY_SIDE, SWAPPED, VERTICAL, rig_of, seen_by_both

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.cv import stereo_rectify
from vision3d.stereo import rectify
from vision3d.stereo.rectification import METHODS

BROWN = {name: rig for name, rig in EVERY_RIG.items() if rig is not FISHEYES}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rig", EVERY_RIG.values(), ids=EVERY_RIG)
@pytest.mark.parametrize("zero_disparity", [True, False])
def test_a_point_keeps_its_row(rig, method, zero_disparity, rng):
    pair = rectify(rig, method=method, zero_disparity=zero_disparity)
    _, left, right = seen_by_both(rig, rng)
    assert len(left) > 100
    np.testing.assert_allclose(pair.row_errors(left, right), 0.0, atol=1e-8)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rig", EVERY_RIG.values(), ids=EVERY_RIG)
@pytest.mark.parametrize("zero_disparity", [True, False])
def test_disparity_gives_the_depth(rig, method, zero_disparity, rng):
    pair = rectify(rig, method=method, zero_disparity=zero_disparity)
    points, left, right = seen_by_both(rig, rng)
    a, b = pair.points(left, right)
    disparity = (a - b)[:, pair.axis]
    ahead = points @ pair.left_R_rectified
    depth = pair.focal_px * pair.baseline_m / (disparity + pair.doffs_px)
    np.testing.assert_allclose(depth, ahead[:, 2], rtol=1e-8)
    homogeneous = np.column_stack([a, disparity, np.ones(len(a))]) @ pair.Q.T
    np.testing.assert_allclose(homogeneous[:, :3] / homogeneous[:, 3:], ahead, rtol=1e-7, atol=1e-9)
    if zero_disparity:
        assert pair.doffs_px == 0.0


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rig", EVERY_RIG.values(), ids=EVERY_RIG)
def test_attitudes_are_rotations_and_parallel(rig, method):
    pair = rectify(rig, method=method)
    for R in (pair.left_R_rectified, pair.right_R_rectified):
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) > 0.0
        assert R[2, 2] > 0.7
        assert R[0, 0] > 0.7
    np.testing.assert_allclose(rig.R @ pair.left_R_rectified, pair.right_R_rectified, atol=1e-12)


@pytest.mark.parametrize("rig", BROWN.values(), ids=BROWN)
@pytest.mark.parametrize("zero_disparity", [True, False])
def test_it_is_opencvs(rig, zero_disparity):
    """Rotations, and without zoom cameras as well, are OpenCV's; its maps are ours."""
    pair = rectify(rig, alpha=None, zero_disparity=zero_disparity)
    theirs = _opencv(rig, alpha=-1, zero_disparity=zero_disparity)
    np.testing.assert_allclose(pair.left_R_rectified.T, theirs.R1, atol=1e-12)
    np.testing.assert_allclose(pair.right_R_rectified.T, theirs.R2, atol=1e-12)
    for ours, wanted in zip((*pair.projections, pair.Q), (theirs.P1, theirs.P2, theirs.Q), strict=True):
        # it ends its undistortion early, and Q divides by the baseline
        np.testing.assert_allclose(ours, wanted, atol=1e-2 / min(1.0, rig.baseline_m))
    for maps, camera, R, target in (
        (pair.maps[0], rig.left, theirs.R1, pair.left),
        (pair.maps[1], rig.right, theirs.R2, pair.right),
    ):
        wanted = cv2.initUndistortRectifyMap(
            camera.matrix, camera.distortion, R, target.matrix, pair.size, cv2.CV_32FC1
        )
        seen = maps[0] > -1e3
        assert seen.mean() > 0.9
        np.testing.assert_allclose(maps[0][seen], wanted[0][seen], atol=2e-3)
        np.testing.assert_allclose(maps[1][seen], wanted[1][seen], atol=2e-3)


@pytest.mark.parametrize("alpha", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("rig", [SIDE_BY_SIDE, VERTICAL, SWAPPED], ids=["side", "vertical", "swapped"])
def test_the_zoom_is_opencvs_within_a_pixel(rig, alpha):
    """OpenCV looks at nine points a side, where we look at 513: the difference is of the order of a pixel."""
    pair, theirs = rectify(rig, alpha=alpha), _opencv(rig, alpha=alpha, zero_disparity=True)
    assert abs(pair.focal_px - theirs.P1[0, 0]) < 2.0
    x0, y0, x1, y1 = pair.valid_left
    x, y, width, height = theirs.valid1
    np.testing.assert_allclose((x0, y0, x1, y1), (x, y, x + width - 1, y + height - 1), atol=6)


def _opencv(rig, *, alpha, zero_disparity):
    return stereo_rectify(
        rig.left.matrix, rig.left.distortion, rig.right.matrix, rig.right.distortion, rig.left.size, rig.R,
        rig.T, alpha=alpha, flags=cv2.CALIB_ZERO_DISPARITY if zero_disparity else 0,
    )  # fmt: skip


@pytest.mark.parametrize("rig", EVERY_RIG.values(), ids=EVERY_RIG)
def test_alpha_zero_shows_no_black_and_alpha_one_every_pixel(rig):
    white = np.full((480, 640), 255, dtype=np.uint8)
    for image in rectify(rig, alpha=0.0).images(white, white):
        assert image.min() == 255
    if rig is FISHEYES:
        return  # a plane cannot show all of a fisheye
    wide = rectify(rig, alpha=1.0)
    corners = np.array([[0.0, 0.0], [639.0, 0.0], [0.0, 479.0], [639.0, 479.0]])
    for moved in wide.points(corners, corners):
        assert (moved > -0.51).all()
        assert (moved < np.array(wide.size) - 0.49).all()


@pytest.mark.parametrize("rig", [SIDE_BY_SIDE, VERTICAL], ids=["side", "vertical"])
def test_the_common_region_is_all_image(rig):
    pair = rectify(rig, alpha=1.0)
    white = np.full((480, 640), 255, dtype=np.uint8)
    x0, y0, x1, y1 = pair.valid
    assert x1 - x0 > 300
    assert y1 - y0 > 250
    for image in pair.images(white, white):
        assert image[y0 : y1 + 1, x0 : x1 + 1].min() == 255


def test_another_size():
    half = rectify(SIDE_BY_SIDE, size=(320, 240))
    full = rectify(SIDE_BY_SIDE)
    assert half.size == (320, 240)
    assert abs(half.focal_px / full.focal_px - 0.5) < 0.01
    image = np.zeros((480, 640, 3), dtype=np.uint8)
    assert half.images(image, image)[0].shape == (240, 320, 3)


def test_refusals():
    with pytest.raises(ModelError, match="no method 'hartley'"):
        rectify(SIDE_BY_SIDE, method="hartley")
    with pytest.raises(ModelError, match="alpha is between 0"):
        rectify(SIDE_BY_SIDE, alpha=1.5)
    with pytest.raises(ModelError, match="looks away from the rectified image plane"):
        rectify(rig_of((0.0, 3.0, 0.0), (-0.1, 0.0, 0.0)))
    small = Camera("pinhole", (300.0, 300.0, 160.0, 120.0), (), (320, 240))
    with pytest.raises(ShapeError, match="say the size of the rectified ones"):
        rectify(rig_of(right=small))
    with pytest.raises(ShapeError, match="the right image is 320x240 px"):
        rectify(CONVERGING).images(np.zeros((480, 640), np.uint8), np.zeros((240, 320), np.uint8))
