"""Undistorted images: OpenCV's maps, straight lines, and what each view shows."""

import cv2
import numpy as np
import pytest
from lens_family import EVERY_CAMERA, camera_of

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.undistort import Undistorter, undistort_maps, undistorted_camera

every_camera = pytest.mark.parametrize("camera", EVERY_CAMERA, ids=lambda camera: camera.lens)
TURNS = {"straight": np.zeros(3), "turned": np.array([0.03, -0.05, 0.02])}


@every_camera
@pytest.mark.parametrize("turn", TURNS)
def test_maps_are_opencv_s(camera, turn):
    target = Camera("pinhole", (500.0, 505.0, 300.0, 250.0), (), (620, 470))
    R = cv2.Rodrigues(TURNS[turn])[0]
    columns, rows = undistort_maps(camera, target, R.T)
    init = cv2.fisheye.initUndistortRectifyMap if camera.lens == "fisheye4" else cv2.initUndistortRectifyMap
    theirs = init(camera.matrix, camera.distortion_opencv, R, target.matrix, target.size, cv2.CV_32FC1)
    seen = (np.abs(columns) < 2000) & (np.abs(rows) < 2000)
    assert seen.mean() > 0.98, "only beyond the fold is there no image"
    for ours, theirs_ in zip((columns, rows), theirs, strict=True):
        np.testing.assert_allclose(ours[seen], np.asarray(theirs_)[seen], rtol=0, atol=2e-4)


@every_camera
def test_maps_are_projections(camera):
    """Pixel by pixel what `Camera.project` gives, and nowhere what it does not see."""
    target = Camera("pinhole", (150.0, 160.0, 310.0, 245.0), (), (640, 480))
    R = cv2.Rodrigues(np.array([0.1, -0.3, 0.05]))[0]
    columns, rows = undistort_maps(camera, target, R)
    across, down = np.meshgrid(np.arange(640.0), np.arange(480.0))
    pixels = camera.project(target.unproject(np.stack([across, down], axis=-1)) @ R.T)
    near = np.isfinite(pixels).all(axis=-1) & (np.abs(pixels) < 9e3).all(axis=-1)
    np.testing.assert_allclose(columns[near], pixels[near][:, 0], rtol=2e-7, atol=1e-6)
    np.testing.assert_allclose(rows[near], pixels[near][:, 1], rtol=2e-7, atol=1e-6)
    assert (columns[np.isnan(pixels[..., 0])] == -1e4).all()


@every_camera
def test_no_rotation_is_the_identity(camera):
    target = undistorted_camera(camera)
    np.testing.assert_array_equal(target.intrinsics, camera.intrinsics)
    for one, other in zip(
        undistort_maps(camera, target), undistort_maps(camera, target, np.eye(3)), strict=True
    ):
        np.testing.assert_array_equal(one, other)


@every_camera
def test_inside_has_no_black_border(camera):
    undistorter = Undistorter.of(camera, view="inside")
    assert undistorter.seen.all()
    white = np.full((480, 640), 255, dtype=np.uint8)
    assert (undistorter(white) == 255).all()
    fx, fy = undistorter.target.intrinsics[:2]
    assert fx / fy == pytest.approx(camera.intrinsics[0] / camera.intrinsics[1])
    # as large as it can be: a little wider, and a border is seen
    wider = undistorter.target.with_parameters(undistorter.target.parameters * [0.98, 0.98, 1.0, 1.0])
    assert not Undistorter(camera, wider, *undistort_maps(camera, wider)).seen.all()


@every_camera
def test_all_shows_every_pixel(camera):
    target = undistorted_camera(camera, view="all")
    across, down = np.meshgrid(np.linspace(0, 639, 41), np.linspace(0, 479, 31))
    rays = camera.unproject(np.stack([across, down], axis=-1).reshape(-1, 2))
    pixels = target.project(rays[np.isfinite(rays[:, 0])])
    assert (pixels >= -1e-6).all()
    assert (pixels <= np.array([639.0, 479.0]) + 1e-6).all()
    margin = min(pixels[:, 0].min(), pixels[:, 1].min())
    if np.isfinite(rays).all():
        assert margin < 1.0, "no larger than it must be"


def test_a_wide_fisheye_is_cut_at_75_degrees():
    camera = Camera("fisheye4", (200.0, 200.0, 319.5, 319.5), (0.0, 0.0, 0.0, 0.0), (640, 640))
    assert np.degrees(np.arccos(camera.unproject(np.array([0.0, 319.5]))[2])) > 90.0
    for view in ("inside", "all"):
        target = undistorted_camera(camera, view=view)
        edge = np.degrees(np.arccos(target.unproject(np.array([0.0, 319.5]))[2]))
        assert 50.0 < edge <= 75.001


def test_straight_lines_become_straight():
    """A line of space, imaged by the lens, lies on a line after undistortion."""
    camera = camera_of("brown5")
    line = np.array([-0.4, -0.3, 1.0]) + np.linspace(0.0, 1.0, 4000)[:, None] * [0.75, 0.15, 0.0]
    image = np.zeros((480, 640), dtype=np.uint8)
    for x, y in np.round(camera.project(line)).astype(int):
        image[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2] = 255
    straight, target = camera.undistort(image)
    spread = [_spread_about_line(picture) for picture in (image, straight)]
    assert spread[1] < 1.3 < spread[0]
    seen = target.project(line)
    assert (straight[tuple(np.round(seen[500:3500:100, ::-1]).astype(int).T)] > 100).all()


def _spread_about_line(picture):
    """Largest distance, px, of the middle of each column's bright pixels from the line through them."""
    weights = picture.astype(float)
    columns = np.flatnonzero(weights.sum(axis=0) > 255)
    centres = (weights * np.arange(480)[:, None]).sum(axis=0)[columns] / weights.sum(axis=0)[columns]
    return np.abs(centres - np.polyval(np.polyfit(columns, centres, 1), columns)).max()


def test_colours_and_types_are_kept(rng):
    camera = camera_of("brown4")
    undistorter = Undistorter.of(camera)
    for image in (
        rng.integers(0, 256, (480, 640, 3), dtype=np.uint8),
        rng.integers(0, 65536, (480, 640), dtype=np.uint16),
        rng.random((480, 640)).astype(np.float32),
    ):
        straight = undistorter(image)
        assert (straight.shape, straight.dtype) == (image.shape, image.dtype)


def test_another_size_of_the_result():
    camera = camera_of("brown5")
    for view in ("same", "inside", "all"):
        undistorter = Undistorter.of(camera, view=view, size=(320, 240))
        assert undistorter.target.size == (320, 240)
        assert undistorter(np.zeros((480, 640), dtype=np.uint8)).shape == (240, 320)
    half = undistorted_camera(camera, size=(320, 240))
    np.testing.assert_allclose(half.intrinsics[:2], camera.intrinsics[:2] / 2)


@every_camera
def test_a_resized_camera_is_that_of_a_resized_image(camera, rng):
    points = rng.uniform((-0.3, -0.2, 1.0), (0.3, 0.2, 1.5), (50, 3))
    half = camera.resized((320, 240))
    # OpenCV's and everybody's resize keeps the corners of an image, not the centres of its corner pixels
    np.testing.assert_allclose(half.project(points) + 0.5, 0.5 * (camera.project(points) + 0.5), atol=1e-10)
    assert half.resized(camera.size).size == camera.size
    np.testing.assert_allclose(half.resized(camera.size).parameters, camera.parameters, rtol=1e-14)


def test_what_cannot_be_undistorted_is_a_sentence():
    camera = camera_of("brown5")
    with pytest.raises(ShapeError, match="the image is 320x240 px and the camera was calibrated at 640x480"):
        camera.undistort(np.zeros((240, 320), dtype=np.uint8))
    with pytest.raises(ModelError, match="no view 'most'"):
        undistorted_camera(camera, view="most")
    with pytest.raises(ModelError, match="pinhole camera, got the lens brown5"):
        undistort_maps(camera, camera)
