"""Planes and the ground of depth images."""

import numpy as np
import pytest
from stereo_worlds import BASELINE_M, CAMERA, facing, room, rough_texture, seen

from sequential.errors import ModelError
from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Camera
from vision3d.render import desk, ground, render_stereo
from vision3d.stereo import back_project, compute_disparity, depth_of
from vision3d.stereo.planes import find_ground, find_planes


@pytest.fixture(scope="module")
def world():
    return room(np.random.default_rng(1))


@pytest.fixture(scope="module")
def depth(world):
    return depth_of(compute_disparity(world.left, world.right), CAMERA.intrinsics[0], BASELINE_M)


def truth_of(world):
    """Normal and distance of every plane of a world."""
    for one in world.planes:
        normal = rotation_matrix(one.camera_T_plane[:4])[:, 2]
        distance = float(normal @ one.camera_T_plane[4:])
        yield (-normal, distance) if distance > 0 else (normal, -distance)


def test_every_plane_of_a_room_is_found(world, depth):
    found = find_planes(depth, CAMERA)
    for normal, distance in truth_of(world):
        nearest = max(found, key=lambda one: one.normal @ normal - abs(one.distance_m / distance - 1.0))
        assert np.degrees(np.arccos(np.clip(nearest.normal @ normal, -1, 1))) < 3.0
        assert nearest.distance_m == pytest.approx(distance, rel=0.03)
    assert [one.share for one in found] == sorted((one.share for one in found), reverse=True)


def test_the_ground_is_the_level_one(depth):
    ground = find_ground(depth, CAMERA)
    assert ground.distance_m == pytest.approx(0.8, abs=0.02)
    assert np.degrees(ground.tilt_rad()) < 1.0
    points = back_project(depth, CAMERA)[ground.inliers]
    assert np.abs(ground.height_of(points)).max() < 0.3
    assert np.sqrt(np.mean(ground.height_of(points) ** 2)) == pytest.approx(ground.rms_m, rel=1e-6)


def test_exact_depth_gives_the_exact_plane():
    planes = [facing((0.0, 0.4, 3.0), 20.0, rough_texture(np.random.default_rng(0)), (-70.0, 10.0))]
    z, _ = seen(CAMERA, planes)
    (found,) = find_planes(z, CAMERA, most=1)
    normal = -rotation_matrix(planes[0].camera_T_plane[:4])[:, 2]
    normal = normal if normal @ planes[0].camera_T_plane[4:] < 0 else -normal
    np.testing.assert_allclose(found.normal, normal, atol=1e-6)
    assert found.distance_m == pytest.approx(-normal @ planes[0].camera_T_plane[4:], rel=1e-6)
    assert found.share > 0.99


def test_a_distorted_rgbd_camera(rng):
    lens = Camera("brown5", (280.0, 281.0, 160.0, 118.0), (-0.2, 0.05, 1e-3, -5e-4, 0.01), (320, 240))
    planes = [facing((0.0, 0.7, 3.0), 30.0, rough_texture(rng), (-90.0, 0.0))]
    z, _ = seen(lens, planes)
    z *= 1.0 + 0.01 * rng.standard_normal(z.shape)
    z[rng.random(z.shape) < 0.2] = np.nan
    ground = find_ground(z, lens)
    assert ground.distance_m == pytest.approx(0.7, abs=5e-3)


def test_a_wall_is_no_ground():
    z = np.full((240, 320), 2.0)
    assert len(find_planes(z, CAMERA)) == 1
    assert find_ground(z, CAMERA) is None
    assert find_ground(z, CAMERA, up=(0.0, 0.0, -1.0)) is not None


def test_a_table_is_not_the_floor():
    rng = np.random.default_rng(4)
    planes = [
        facing((0.0, 1.2, 5.0), 16.0, rough_texture(rng, 1024), (-90.0, 0.0)),
        facing((0.0, 0.5, 2.4), 1.6, rough_texture(rng), (-90.0, 0.0)),
    ]
    z, front = seen(CAMERA, planes)
    levels = find_planes(z, CAMERA)
    assert sorted(round(one.distance_m, 2) for one in levels) == [0.5, 1.2]
    assert find_ground(z, CAMERA).distance_m == pytest.approx(1.2, abs=1e-3)
    assert (front == 1).mean() > 0.05


def test_nothing_to_fit():
    assert find_planes(np.full((240, 320), np.nan), CAMERA) == ()
    assert find_ground(np.full((240, 320), np.nan), CAMERA) is None
    with pytest.raises(ModelError, match="least_share"):
        find_planes(np.ones((240, 320)), CAMERA, least_share=2.0)


@pytest.mark.parametrize(("make", "height_m"), [(ground, 1.2), (desk, 0.45)])
def test_its_uncertainty_covers_the_truth(make, height_m, rng):
    apart = np.array([1.0, 0.0, 0.0, 0.0, -BASELINE_M, 0.0, 0.0])
    view = render_stereo(CAMERA, CAMERA, apart, make(rng), rng=rng)
    depth = depth_of(compute_disparity(view.left.image, view.right.image), CAMERA.intrinsics[0], BASELINE_M)
    found = find_ground(depth, CAMERA)
    assert abs(found.distance_m - height_m) < 3.0 * found.distance_std_m < 0.06 * height_m
    assert found.tilt_rad() < 3.0 * found.normal_std_rad
