"""Pixels to metres on the ground, and metres that are as sure as they say."""

import numpy as np
import pytest

from sequential.errors import DataError, ShapeError, UnderConstrainedError
from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.lines import CameraMount, GroundHomography, find_line, planar_pose, plane_homography
from vision3d.lines.settings import no_line
from vision3d.render import GroundLine, render_ground
from vision3d.rigid import inverse, transform

CAMERAS = {
    "pinhole": Camera("pinhole", (533.0, 530.0, 342.0, 234.0), (), (640, 480)),
    "brown5": Camera(
        "brown5", (533.0, 533.0, 342.0, 234.0), (-0.28, 0.02, 0.0012, -0.0001, 0.16), (640, 480)
    ),
    "fisheye4": Camera("fisheye4", (330.0, 330.0, 320.0, 240.0), (0.02, -0.01, 0.003, -0.001), (640, 480)),
}
CAMERA = CAMERAS["brown5"]
MOUNT = CameraMount(0.2, 0.5, roll_rad=0.05, forward_m=0.08, left_m=-0.02, yaw_rad=0.1)
PLACES = np.array([[0.3, 0.1], [0.35, -0.12], [0.7, 0.2], [0.9, -0.25], [0.5, 0.0], [0.6, 0.15]])


def seen(camera, places, mount=MOUNT):
    world = inverse(mount.pose)
    return camera.project(transform(world, np.column_stack([places, np.zeros(len(places))])))


@pytest.mark.parametrize("lens", CAMERAS)
def test_the_camera_s_place_gives_the_ground(lens):
    camera = CAMERAS[lens]
    ground = GroundHomography.from_camera(camera, MOUNT)
    pixels = seen(camera, PLACES)
    np.testing.assert_allclose(ground.to_ground(pixels).xy, PLACES, atol=1e-9)
    np.testing.assert_allclose(ground.to_image(PLACES), pixels, atol=1e-9)


@pytest.mark.parametrize("count", [4, 6])
@pytest.mark.parametrize("lens", CAMERAS)
def test_points_give_the_ground(lens, count):
    camera = CAMERAS[lens]
    fitted = GroundHomography.from_points(seen(camera, PLACES[:count]), PLACES[:count], camera=camera)
    np.testing.assert_allclose(fitted.to_ground(seen(camera, PLACES)).xy, PLACES, atol=1e-8)
    exact = GroundHomography.from_camera(camera, MOUNT).ground_H_image
    scaled = fitted.ground_H_image * np.linalg.norm(exact) / np.linalg.norm(fitted.ground_H_image)
    np.testing.assert_allclose(scaled, exact, atol=1e-8)


def test_without_a_camera_pixels_are_taken_as_they_are():
    camera = CAMERAS["pinhole"]
    fitted = GroundHomography.from_points(seen(camera, PLACES[:4]), PLACES[:4])
    np.testing.assert_allclose(fitted.to_ground(seen(camera, PLACES)).xy, PLACES, atol=1e-9)
    np.testing.assert_allclose(fitted.to_image(PLACES), seen(camera, PLACES), atol=1e-6)


def test_derivatives_meet_central_differences():
    _, jacobian = plane_homography(MOUNT.pose)
    step = 1e-6
    for k in range(6):
        ends = [plane_homography(SE3().retract(MOUNT.pose, s * step * np.eye(6)[k]))[0] for s in (1, -1)]
        np.testing.assert_allclose(jacobian[:, k], (ends[0] - ends[1]).ravel() / (2 * step), atol=1e-8)


def spread(samples):
    return np.einsum("kni,knj->nij", samples - samples.mean(axis=0), samples - samples.mean(axis=0)) / (
        len(samples) - 1
    )


def assert_alike(told, drawn, tolerance):
    """Standard deviations along each axis, and the correlation."""
    ratio = np.sqrt(np.diagonal(told, axis1=1, axis2=2) / np.diagonal(drawn, axis1=1, axis2=2))
    assert (np.abs(ratio - 1) < tolerance).all(), ratio


def test_the_covariance_of_a_pose_reaches_the_ground(rng):
    sigma = np.diag(np.square([0.004, 0.003, 0.005, 0.001, 0.002, 0.001]))
    lens = np.diag(np.square([1.0, 1.0, 1.5, 1.5, 0.003, 0.003, 1e-4, 1e-4, 0.003]))
    pixels = seen(CAMERA, PLACES)
    told = GroundHomography.from_camera(CAMERA, MOUNT, sigma, camera_cov=lens).to_ground(pixels, 0.4)
    drawn = []
    for _ in range(1500):
        camera = CAMERA.with_parameters(rng.multivariate_normal(CAMERA.parameters, lens))
        pose = SE3().retract(MOUNT.pose, rng.multivariate_normal(np.zeros(6), sigma))
        noisy = pixels + rng.normal(0, 0.4, pixels.shape)
        drawn.append(GroundHomography.from_camera(camera, pose).to_ground(noisy).xy)
    assert_alike(told.cov, spread(np.array(drawn)), 0.1)
    assert (told.sigma_m >= np.sqrt(told.cov[:, 0, 0]) - 1e-12).all()


@pytest.mark.parametrize("count", [4, 6])
@pytest.mark.parametrize("sigma_m", [0.0, 0.004])
def test_the_covariance_of_points_reaches_the_ground(count, sigma_m, rng):
    pixels = seen(CAMERA, PLACES)
    options = {"camera": CAMERA, "sigma_px": 0.7, "sigma_m": sigma_m}
    told = GroundHomography.from_points(pixels[:count], PLACES[:count], **options)
    where = seen(CAMERA, np.array([[0.4, 0.05], [0.65, -0.1], [0.8, 0.0]]))
    drawn, rms = [], []
    for _ in range(600):
        noisy = pixels[:count] + rng.normal(0, 0.7, (count, 2))
        places = PLACES[:count] + rng.normal(0, sigma_m, (count, 2))
        fitted = GroundHomography.from_points(noisy, places, **options)
        drawn.append(fitted.to_ground(where).xy)
        rms.append(fitted.rms_px)
    assert_alike(told.to_ground(where).cov, spread(np.array(drawn)), 0.12)
    if count == 4:
        assert np.isnan(rms).all()
    elif sigma_m == 0.0:
        expected = 0.7 * np.sqrt(4 / 12)  # twelve numbers, eight fitted
        assert np.sqrt(np.mean(np.square(rms))) == pytest.approx(expected, rel=0.1)


def test_the_line_in_metres(rng):
    line = GroundLine(np.array([[-1.0, 0.0], [3.0, 0.0]]), 0.04)
    ground = GroundHomography.from_camera(CAMERA, MOUNT)
    for pose in ([0.0, -0.03, 0.1], [0.3, 0.02, -0.12]):
        reading = find_line(render_ground(CAMERA, MOUNT, line, np.array(pose), rng=rng))
        metres = ground.read(reading)
        left, heading = line.seen_from(np.array(pose), float(metres.near[0]))
        assert metres.offset_m == pytest.approx(left, abs=1e-3)
        assert metres.heading_rad == pytest.approx(heading, abs=0.01)
        assert metres.far[0] > metres.near[0]


def test_the_covariance_of_the_line_in_metres(rng):
    """Of what a pose that is off does to offset and heading: two rows err together."""
    sigma = np.diag(np.square([0.01, 0.01, 0.01, 0.002, 0.002, 0.002]))
    line = GroundLine(np.array([[-1.0, 0.0], [3.0, 0.0]]), 0.04)
    reading = find_line(render_ground(CAMERA, MOUNT, line, np.array([0.0, -0.03, 0.1])))
    told = GroundHomography.from_camera(CAMERA, MOUNT, sigma).read(reading)
    drawn = []
    for _ in range(1500):
        pose = SE3().retract(MOUNT.pose, rng.multivariate_normal(np.zeros(6), sigma))
        one = GroundHomography.from_camera(CAMERA, pose).read(reading)
        drawn.append([one.offset_m, one.heading_rad])
    np.testing.assert_allclose(np.sqrt(np.diag(told.cov)), np.std(drawn, axis=0), rtol=0.12)
    correlation = told.cov[0, 1] / np.sqrt(told.cov[0, 0] * told.cov[1, 1])
    assert correlation == pytest.approx(np.corrcoef(np.transpose(drawn))[0, 1], abs=0.1)


def test_from_above_a_line_is_straight_and_of_one_width(rng):
    line = GroundLine(np.array([[-1.0, 0.02], [3.0, 0.02]]), 0.04)
    mount = CameraMount(0.2, 0.6)
    image = render_ground(CAMERA, mount, line, np.zeros(3), rng=rng)
    above = GroundHomography.from_camera(CAMERA, mount).bird_eye(
        image, x_m=(0.2, 0.5), y_m=(-0.1, 0.1), px_per_m=500.0
    )
    assert above.shape == (150, 100)
    dark = above < 80
    np.testing.assert_allclose(dark.sum(axis=1), 20, atol=3)
    middle = (dark * np.arange(100)).sum(axis=1) / dark.sum(axis=1)
    np.testing.assert_allclose(0.1 - middle / 500.0, 0.02, atol=0.003)


def test_the_horizon_has_no_place():
    ground = GroundHomography.from_camera(CAMERA, CameraMount(0.2, 0.0))
    points = ground.to_ground(np.array([[342.0, 100.0], [342.0, 400.0]]), 0.5)
    assert np.isnan(points.xy[0]).all()
    assert np.isfinite(points.xy[1]).all()
    assert np.isinf(points.sigma_m[0])
    assert np.isnan(ground.to_image(np.array([[-1.0, 0.0]]))).all()


def test_points_that_do_not_do_are_refused():
    pixels = seen(CAMERA, PLACES)
    with pytest.raises(DataError, match="four points or more"):
        GroundHomography.from_points(pixels[:3], PLACES[:3])
    with pytest.raises(ShapeError, match="as many of each"):
        GroundHomography.from_points(pixels, PLACES[:4])
    along = np.column_stack([np.linspace(0.3, 0.9, 5), np.zeros(5)])
    with pytest.raises(UnderConstrainedError, match="one line"):
        GroundHomography.from_points(seen(CAMERA, along), along, camera=CAMERA)
    with pytest.raises(ShapeError, match=r"\(6, 6\)"):
        GroundHomography.from_camera(CAMERA, MOUNT, np.eye(3))
    with pytest.raises(ShapeError, match="camera_cov"):
        GroundHomography.from_camera(CAMERA, MOUNT, camera_cov=np.eye(3))
    with pytest.raises(DataError, match="nothing there"):
        GroundHomography.from_camera(CAMERA, MOUNT).read(no_line("nothing there"))
    assert planar_pose(1.0, 2.0, 0.0).tolist() == [1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 0.0]
