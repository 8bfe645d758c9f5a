"""Where a distortion folds: found exactly, respected by the camera, told in a sentence."""

import cv2
import numpy as np
import pytest
from lens_family import EVERY_CAMERA, INTRINSICS, camera_of

from vision3d.camera import LENSES, Camera
from vision3d.folding import check_monotonic, radial_limit

FOLDING = {
    "barrel k1": ("brown1", (-0.45,)),
    "k3 turns it round": ("brown5", (-0.28, 0.3, 0.0, 0.0, -0.5)),
    "rational numerator": ("rational8", (-0.6, 0.01, 0.0, 0.0, 0.0, -0.05, 0.0, 0.0)),
    "fisheye": ("fisheye4", (0.1, -0.3, 0.2, -0.1)),
}
ALMOST_CANCELLED = (18.7512, -24.975, 0.0, 0.0, 0.0, 18.85, -25.125, 0.0)
"""A pole near a zero, which calibrations with corners near the centre give (opencv#15577)."""


def radius_along(camera, t):
    """Image radius in focal lengths of the ray at x/z (fisheye: angle) t, by OpenCV, without any check."""
    if camera.lens == "fisheye4":
        k = camera.distortion
        return t * (1.0 + k[0] * t**2 + k[1] * t**4 + k[2] * t**6 + k[3] * t**8)
    rays = np.column_stack([t, np.zeros_like(t), np.ones_like(t)])
    d = camera.distortion_opencv.copy()
    d[2:4], d[8:] = 0.0, 0.0
    return cv2.projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), d)[0].reshape(-1, 2)[:, 0]


@pytest.mark.parametrize("name", FOLDING)
def test_the_limit_is_where_the_radius_ceases_to_grow(name):
    camera = Camera(FOLDING[name][0], INTRINSICS, FOLDING[name][1])
    t = np.linspace(0.0, 2.0 * camera.limit, 200001)
    falls = np.diff(radius_along(camera, t)) < 0.0
    assert t[int(np.argmax(falls))] == pytest.approx(camera.limit, abs=2.0 * (t[1] - t[0]))


@pytest.mark.parametrize("lens", [lens for lens in LENSES if lens != "pinhole"])
def test_the_limit_of_any_coefficients(lens, rng):
    """A scan finds no fall of the radius before the limit, and one right behind it."""
    for _ in range(200):
        scale = rng.choice([0.05, 0.3, 1.5])
        parameters = np.concatenate([INTRINSICS, scale * rng.standard_normal(len(LENSES[lens].distortion))])
        limit = radial_limit(lens, parameters)
        camera = Camera(lens, INTRINSICS, parameters[4:])
        before = np.linspace(0.0, min(limit, 50.0) * (1.0 - 1e-6), 4001)
        assert (np.diff(radius_along(camera, before)) > 0.0).all()
        if np.isfinite(limit) and not (lens == "fisheye4" and limit == np.pi):
            at, behind = radius_along(camera, limit * np.array([1.0 - 1e-6, 1.0 + 1e-3]))
            assert behind < at, "it falls, or has come back from beyond the pole"


@pytest.mark.parametrize("name", FOLDING)
def test_beyond_the_fold_there_is_no_image(name):
    lens, coefficients = FOLDING[name]
    camera = Camera(lens, INTRINSICS, coefficients)
    inside, outside = 0.999 * camera.limit, 1.001 * camera.limit
    if lens == "fisheye4":
        rays = np.array([[np.sin(t), 0.0, np.cos(t)] for t in (inside, outside)])
    else:
        rays = np.array([[t, 0.0, 1.0] for t in (inside, outside)])
    pixels, d_point, d_parameters = camera.project_jacobians(rays)
    assert np.isfinite(pixels[0]).all()
    assert np.isnan(pixels[1]).all()
    assert np.isnan(d_point[1]).all()
    assert np.isnan(d_parameters[1]).all()


def test_opencv_folds_a_far_ray_into_the_image():
    """Nothing but the limit tells that this pixel is none."""
    camera = Camera("brown5", INTRINSICS, (-0.28, 0.3, 0.0, 0.0, -0.5))
    far = np.array([[1.05, 0.0, 1.0]])
    K, d = camera.matrix, camera.distortion_opencv
    pixel = cv2.projectPoints(far, np.zeros(3), np.zeros(3), K, d)[0].ravel()
    assert 0.0 < pixel[0] < 640.0
    assert np.isnan(camera.project(far)).all()
    back = camera.unproject(pixel)
    assert back[0] / back[2] < camera.limit


@pytest.mark.parametrize("camera", EVERY_CAMERA, ids=lambda camera: camera.lens)
def test_plausible_cameras_are_one_to_one(camera):
    fold = camera.check_monotonic()
    assert not fold.inside
    assert fold.lost == 0.0
    assert "inside the image" not in str(fold)
    assert camera.fold_radius() == fold.radius_px


@pytest.mark.parametrize("name", ["k3 turns it round", "rational numerator"])
def test_a_fold_inside_the_image_is_told(name):
    lens, coefficients = FOLDING[name]
    camera = Camera(lens, INTRINSICS, coefficients)
    fold = check_monotonic(camera)
    assert fold.inside
    across, down = np.meshgrid(np.linspace(-0.5, 639.5, 200), np.linspace(-0.5, 479.5, 200))
    # fx and fy differ a little: the fold is an ellipse
    x, y = (across - INTRINSICS[2]) / INTRINSICS[0], (down - INTRINSICS[3]) / INTRINSICS[1]
    share = (np.hypot(x, y) * np.sqrt(INTRINSICS[0] * INTRINSICS[1]) > fold.radius_px).mean()
    assert fold.lost == pytest.approx(share, abs=0.02)
    assert f"{fold.radius_px:.0f} px" in str(fold)
    assert "fewer coefficients" in str(fold)


def test_a_pole_inside_the_image_is_told():
    camera = Camera("rational8", (530.4, 530.4, 511.6, 383.5), ALMOST_CANCELLED, (1024, 768))
    assert np.isfinite(camera.limit)
    assert camera.limit < np.hypot(511.6, 383.5) / 530.4
    fold = camera.check_monotonic()
    assert fold.inside
    assert fold.lost > 0.01
    rays = camera.unproject(np.array([[511.6, 383.5], [600.0, 400.0]]))
    np.testing.assert_allclose(camera.project(rays), [[511.6, 383.5], [600.0, 400.0]], atol=1e-8)


def test_a_pole_up_to_which_the_image_grows():
    """Every pixel has a ray, and beyond the pole there is no image."""
    camera = Camera("rational8", INTRINSICS, (0.1, 0.0, 0.0, 0.0, 0.0, -0.5, 0.0, 0.0))
    fold = camera.check_monotonic()
    assert camera.limit == pytest.approx(np.sqrt(2.0))
    assert not fold.inside
    assert np.isinf(fold.radius_px)
    assert "pole 54.7° off axis" in str(fold)
    assert np.isnan(camera.project(np.array([[1.5, 0.0, 1.0]]))).all()


def test_tangential_terms_can_fold_alone():
    camera = Camera("brown4", INTRINSICS, (0.0, 0.0, 0.4, 0.0))
    fold = camera.check_monotonic()
    assert fold.inside
    assert np.isinf(fold.radius_px)
    assert "tangential" in str(fold)


@pytest.mark.parametrize("camera", EVERY_CAMERA, ids=lambda camera: camera.lens)
def test_a_pixel_has_one_ray_at_most(camera, rng):
    """Whatever is asked, a ray that comes out is imaged at its pixel."""
    strange = rng.uniform(-3000.0, 3000.0, (500, 2))
    rays = camera.unproject(strange)
    known = np.isfinite(rays[:, 0])
    np.testing.assert_allclose(camera.project(rays[known]), strange[known], atol=1e-6)
    assert known.any()
    assert camera_of(camera.lens) == camera


def test_newton_that_would_go_to_and_fro():
    """Between the middle and a flat end, its steps lead from one to the other for ever."""
    camera = Camera("fisheye4", INTRINSICS, (0.0537366, -0.0447387, 0.5254898, -0.3770008))
    angles = np.linspace(0.0, 0.9999, 400) * camera.limit
    rays = np.column_stack([np.sin(angles), np.zeros(400), np.cos(angles)])
    np.testing.assert_allclose(camera.unproject(camera.project(rays)), rays, rtol=0, atol=1e-9)


@pytest.mark.parametrize("lens", [lens for lens in LENSES if lens != "pinhole"])
def test_every_image_of_a_radial_lens_has_its_ray(lens, rng):
    """Whatever the coefficients: up to the fold there is one ray to a pixel, and it is found."""
    for _ in range(300):
        distortion = rng.choice([0.02, 0.1, 0.4]) * rng.standard_normal(len(LENSES[lens].distortion))
        if lens != "fisheye4":
            distortion[2:4], distortion[8:] = 0.0, 0.0
        camera = Camera(lens, INTRINSICS, distortion)
        reach = min(camera.limit, 1.9 if lens == "fisheye4" else 2.0)
        t, turn = reach * rng.uniform(0.0, 0.999, 60), rng.uniform(0.0, 2.0 * np.pi, 60)
        angle = t if lens == "fisheye4" else np.arctan(t)
        rays = np.column_stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)])
        np.testing.assert_allclose(camera.unproject(camera.project(rays)), rays, rtol=0, atol=1e-6)
