"""Every lens: there and back, derivatives, and OpenCV as oracle."""

import pickle

import cv2
import numpy as np
import pytest
from lens_family import DISTORTION, EVERY_CAMERA, INTRINSICS, camera_of, points_seen

from sequential.errors import ModelError, NotFiniteError, ShapeError
from vision3d import cv
from vision3d.camera import LENS_CODE, LENSES, Camera
from vision3d.kernels import lenses

every_camera = pytest.mark.parametrize("camera", EVERY_CAMERA, ids=lambda camera: camera.lens)
PERSPECTIVE = [camera for camera in EVERY_CAMERA if camera.lens != "fisheye4"]


def opencv_project(camera, points):
    zero = np.zeros(3)
    points = points.reshape(-1, 1, 3)
    project = cv2.fisheye.projectPoints if camera.lens == "fisheye4" else cv2.projectPoints
    return project(points, zero, zero, camera.matrix, camera.distortion_opencv)[0].reshape(-1, 2)


@every_camera
def test_projects_as_opencv_does(camera, rng):
    points = points_seen(camera, rng)
    np.testing.assert_allclose(camera.project(points), opencv_project(camera, points), rtol=0, atol=1e-9)


@every_camera
def test_a_ray_comes_back_from_its_pixel(camera, rng):
    points = points_seen(camera, rng)
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    np.testing.assert_allclose(camera.unproject(camera.project(points)), rays, rtol=0, atol=1e-12)


@every_camera
def test_a_pixel_comes_back_from_its_ray(camera, rng):
    pixels = rng.uniform((0.0, 0.0), (639.0, 479.0), (300, 2))
    np.testing.assert_allclose(camera.project(camera.unproject(pixels)), pixels, rtol=0, atol=1e-8)


@every_camera
def test_jacobians_meet_central_differences(camera, rng):
    points = np.concatenate([points_seen(camera, rng, 60), [[0.0, 0.0, 1.5], [1e-12, 0.0, 0.7]]])
    pixels, d_point, d_parameters = camera.project_jacobians(points)
    np.testing.assert_array_equal(pixels, camera.project(points))
    by_point = differences(lambda d: camera.project(points + d), np.zeros(3))
    np.testing.assert_allclose(d_point, by_point, rtol=1e-7, atol=1e-5)
    by_parameters = differences(lambda p: camera.with_parameters(p).project(points), camera.parameters)
    np.testing.assert_allclose(d_parameters, by_parameters, rtol=1e-7, atol=1e-5)


def differences(function, at, step=1e-5):
    """Central differences of fourth order, along the last axis."""
    columns = []
    for move in step * np.eye(len(at)):
        near, far = (function(at + k * move) - function(at - k * move) for k in (1, 2))
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("camera", PERSPECTIVE, ids=lambda camera: camera.lens)
def test_undistorts_as_opencv_does(camera, rng):
    pixels = rng.uniform((0.0, 0.0), (639.0, 479.0), (200, 2))
    oracle = cv.undistort_points(pixels, camera.matrix, camera.distortion_opencv)
    np.testing.assert_allclose(camera.undistort_points(pixels), oracle, rtol=0, atol=1e-9)


@every_camera
def test_behind_the_camera_there_is_no_image(camera):
    assert np.isnan(camera.project(np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0]]))).all()
    assert np.isnan(camera.project_jacobians(np.array([[0.0, 0.0, -1.0]]))[2]).all()
    if camera.lens != "fisheye4":
        assert np.isnan(camera.project(np.array([[0.3, 0.2, -1.0]]))).all()


def test_a_fisheye_sees_behind_itself():
    camera = camera_of("fisheye4")
    ray = np.array([[np.sin(1.8), 0.0, np.cos(1.8)]])
    assert ray[0, 2] < 0.0
    np.testing.assert_allclose(camera.unproject(camera.project(ray)), ray, atol=1e-12)
    assert np.isnan(camera.undistort_points(camera.project(ray))).all()


def test_a_smaller_lens_is_a_larger_one_with_zeros(rng):
    points = rng.uniform((-0.4, -0.3, 0.8), (0.4, 0.3, 2.0), (50, 3))
    brown = ["pinhole", "brown1", "brown2", "brown4", "brown5", "rational8", "thin12"]
    for small in brown[:-1]:
        coefficients = DISTORTION[small]
        for large in brown[brown.index(small) + 1 :]:
            padded = (*coefficients, *[0.0] * (len(LENSES[large].distortion) - len(coefficients)))
            np.testing.assert_allclose(
                Camera(large, INTRINSICS, padded).project(points),
                camera_of(small).project(points),
                atol=1e-11,
            )


def test_leading_axes_are_kept(rng):
    points = rng.uniform((-0.3, -0.3, 1.0), (0.3, 0.3, 2.0), (4, 5, 3))
    camera = camera_of("brown5")
    pixels, d_point, d_parameters = camera.project_jacobians(points)
    assert (pixels.shape, d_point.shape, d_parameters.shape) == ((4, 5, 2), (4, 5, 2, 3), (4, 5, 2, 9))
    assert camera.unproject(pixels).shape == (4, 5, 3)
    assert camera.project(points[0, 0]).shape == (2,)
    assert camera.project(np.empty((0, 3))).shape == (0, 2)


def test_kernels_and_table_name_lenses_alike():
    names = {"pinhole": "PINHOLE", "rational8": "RATIONAL8", "thin12": "THIN12", "fisheye4": "FISHEYE4"}
    assert {name: getattr(lenses, names.get(name, name.upper())) for name in LENSES} == LENS_CODE


def test_a_camera_is_a_value():
    camera = camera_of("brown5")
    assert camera == camera_of("brown5")
    assert len({camera, camera_of("brown5"), camera_of("brown4")}) == 2
    assert camera.with_parameters(camera.parameters) == camera
    assert camera.with_parameters(camera.parameters + 1e-9) != camera
    assert pickle.loads(pickle.dumps(camera)) == camera  # noqa: S301
    assert "k3=0.163" in repr(camera)
    with pytest.raises(ValueError, match="read-only"):
        camera.intrinsics[0] = 1.0


def test_opencv_s_vector_names_the_lens():
    K = camera_of("pinhole").matrix
    for lens in ("pinhole", "brown4", "brown5", "rational8", "thin12"):
        assert Camera.from_matrix(K, np.array([DISTORTION[lens]]), (640, 480)) == camera_of(lens)
    assert Camera.from_matrix(K, (*DISTORTION["thin12"], 0.0, 0.0)) == camera_of("thin12")
    assert Camera.from_matrix(K, DISTORTION["fisheye4"], lens="fisheye4") == camera_of("fisheye4")
    assert Camera.from_matrix(K, (-0.2, 0.0, 0.0, 0.0), lens="brown1") == camera_of("brown1")
    with pytest.raises(ModelError, match="tilted"):
        Camera.from_matrix(K, (*DISTORTION["thin12"], 0.01, 0.0))
    with pytest.raises(ModelError, match="needs more"):
        Camera.from_matrix(K, DISTORTION["brown5"], lens="brown2")
    with pytest.raises(ModelError, match="skew"):
        Camera.from_matrix(K + np.eye(3, k=1))


def test_what_is_no_camera_is_a_sentence():
    with pytest.raises(ModelError, match="no lens 'brown6'; known are pinhole"):
        Camera("brown6", INTRINSICS)
    with pytest.raises(ShapeError, match=r"'brown5' is 5 numbers \(k1, k2, p1, p2, k3\), got 4"):
        Camera("brown5", INTRINSICS, (0.0, 0.0, 0.0, 0.0))
    with pytest.raises(NotFiniteError, match="cy = nan"):
        Camera("pinhole", (500.0, 500.0, 320.0, np.nan))
    with pytest.raises(ModelError, match="positive"):
        Camera("pinhole", (500.0, -500.0, 320.0, 240.0))
    with pytest.raises(ModelError, match="size"):
        Camera("pinhole", INTRINSICS, (), (0, 480))
    with pytest.raises(ShapeError, match=r"points are an array \(N, 3\), got shape \(4, 2\)"):
        camera_of("pinhole").project(np.zeros((4, 2)))
