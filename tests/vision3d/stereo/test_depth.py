"""Depth from disparity, and points from depth."""

import numpy as np
import pytest
from stereo_worlds import BASELINE_M, CAMERA, room, seen

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.stereo.back_projection import back_project, cloud_of
from vision3d.stereo.depth import depth_of
from vision3d.stereo.disparity import compute_disparity

LENS = Camera("brown5", (300.0, 301.0, 160.0, 118.0), (-0.2, 0.05, 1e-3, -5e-4, 0.01), (320, 240))


def test_depth_of_exact_disparity_is_exact(rng):
    z = rng.uniform(0.5, 50.0, (20, 30))
    disparity = 700.0 * 0.2 / z - 31.0
    depth = depth_of(disparity, 700.0, 0.2, 31.0, std_px=0.1)
    np.testing.assert_allclose(depth.z_m, z, rtol=2e-4)  # disparity is held in 32 bits
    step = depth_of(disparity + 1e-2, 700.0, 0.2, 31.0).z_m - depth_of(disparity - 1e-2, 700.0, 0.2, 31.0).z_m
    near = z < 5.0
    np.testing.assert_allclose(depth.std_m[near], 0.1 * np.abs(step[near]) / 2e-2, rtol=2e-2)


def test_beyond_infinity_there_is_no_depth():
    depth = depth_of(np.array([[0.0, -40.0, np.nan, 5.0]]), 700.0, 0.2, 31.0)
    np.testing.assert_array_equal(np.isfinite(depth.z_m), [[True, False, False, True]])


@pytest.mark.parametrize("given", [(0.0, 0.2), (700.0, -0.1), (np.inf, 0.1)])
def test_a_pair_without_a_baseline(given):
    with pytest.raises(ModelError, match="positive focal length and baseline"):
        depth_of(np.ones((4, 4)), *given)


@pytest.mark.parametrize("camera", [CAMERA, LENS])
def test_points_project_onto_their_pixels(camera, rng):
    z = rng.uniform(0.5, 5.0, (240, 320))
    points = back_project(z, camera)
    pixels = camera.project(points.reshape(-1, 3)).reshape(240, 320, 2)
    columns, rows = np.meshgrid(np.arange(320), np.arange(240))
    np.testing.assert_allclose(pixels, np.stack([columns, rows], axis=-1), atol=1e-6)
    np.testing.assert_allclose(points[..., 2], z)


def test_open3d_gives_the_same_points(rng):
    z = rng.uniform(0.5, 5.0, (240, 320)).astype(np.float32)
    z[10:20] = 0.0
    ours, theirs = back_project(z, CAMERA), back_project(z, CAMERA, backend="open3d")
    np.testing.assert_allclose(theirs, ours, rtol=1e-5, atol=1e-6)


def test_units_and_gaps_of_an_rgbd_image():
    z = np.zeros((240, 320), np.uint16)
    z[100, 50] = 2000
    image = np.zeros((240, 320, 3), np.uint8)
    image[100, 50] = (1, 2, 3)
    cloud = cloud_of(z, CAMERA, image, unit_m=1e-3)
    assert len(cloud) == 1
    assert cloud.points[0, 2] == pytest.approx(2.0)
    assert cloud.colors.tolist() == [[3, 2, 1]]
    assert cloud.pixels.tolist() == [[50, 100]]
    assert len(cloud_of(z, CAMERA, unit_m=1e-3, most_m=1.5)) == 0


def test_images_of_another_size():
    with pytest.raises(ShapeError, match="10x8 px and the camera 320x240"):
        back_project(np.ones((8, 10)), CAMERA)
    with pytest.raises(ShapeError, match=r"\(h, w\)"):
        back_project(np.ones(5), CAMERA)
    with pytest.raises(ModelError, match="unit"):
        back_project(np.ones((240, 320)), CAMERA, unit_m=0.0)


def test_a_rendered_pair_gives_its_points_back():
    world = room(np.random.default_rng(11))
    disparity = compute_disparity(world.left, world.right)
    depth = depth_of(disparity, CAMERA.intrinsics[0], BASELINE_M)
    truth, _ = seen(CAMERA, world.planes)
    good = depth.measured & np.isfinite(truth)
    relative = np.abs(depth.z_m - truth)[good] / truth[good]
    assert np.median(relative) < 0.02
    cloud = cloud_of(depth, CAMERA, world.left)
    assert len(cloud) == depth.measured.sum()
    assert (cloud.std_m > 0).all()
