"""Two calibrations side by side: a turn is no difference, chance is told from error."""

import numpy as np
import pytest
from calibration_worlds import SIZE, world

from sequential.errors import DataError
from vision3d.calibrate import calibrate, difference
from vision3d.camera import Camera


def test_a_camera_does_not_differ_from_itself():
    found = calibrate(world(seed=3).views(np.random.default_rng(0)))
    same = difference(found, found)
    assert same.rms_px < 1e-9
    assert np.linalg.norm(same.turn_rad) < 1e-12
    assert same.map_px.shape == (18, 24)


def test_a_turn_is_no_difference_and_is_given():
    """A camera whose principal point is moved is turned, nearly: what is left is small."""
    camera = Camera("pinhole", (800.0, 800.0, 320.0, 240.0), (), SIZE)
    moved = Camera("pinhole", (800.0, 800.0, 322.0, 240.0), (), SIZE)
    held, freed = difference(camera, moved, freed_rotation=False), difference(camera, moved)
    assert held.rms_px == pytest.approx(2.0)
    assert freed.rms_px < 0.3
    # 2 px to the right is a turn about +y by 2 / 800, plus what the image's width makes of it
    assert freed.turn_rad[1] == pytest.approx(-2.0 / 800.0, rel=0.15)
    assert np.abs(freed.turn_rad[[0, 2]]).max() < 1e-5


def test_the_turn_leaves_the_least_that_any_turn_leaves():
    from sequential.manifold.quaternion import quaternion_exp, rotate

    a, b = world(seed=3).camera, Camera("brown2", (540.0, 538.0, 338.0, 238.0), (-0.27, 0.08), SIZE)
    found = difference(a, b)
    rays = a.unproject(found.pixels)
    for step in 1e-4 * np.vstack([np.eye(3), -np.eye(3)]):
        moved = b.project(rotate(quaternion_exp(found.turn_rad + step), rays)) - found.pixels
        assert np.sqrt(np.mean(np.sum(moved**2, axis=1))) > found.rms_px


def test_calibrations_of_one_camera_differ_as_much_as_they_say():
    scene, rng = world(seed=4, n=16), np.random.default_rng(1)
    sigmas = [difference(calibrate(scene.views(rng)), calibrate(scene.views(rng))).sigmas for _ in range(8)]
    assert 0.75 < np.sqrt(np.mean(np.square(sigmas))) < 1.25


def test_another_camera_is_found_out():
    scene = world(seed=5)
    found = calibrate(scene.views(np.random.default_rng(2)))
    other = Camera("brown5", [545.0, 543.0, 342.0, 234.0], scene.camera.distortion, SIZE)
    told = difference(found, other)
    assert told.sigmas > 4.0
    assert "one of them is wrong" in told.words
    assert "so they agree" in difference(found, scene.camera).words


def test_cameras_alone_say_nothing_of_chance():
    told = difference(world(seed=5).camera, Camera("pinhole", (530.0, 530.0, 320.0, 240.0), (), SIZE))
    assert np.isnan(told.sigmas)
    assert np.isnan(told.expected_px).all()
    assert "uncertainties" not in told.words


def test_images_of_two_sizes():
    with pytest.raises(DataError, match=r"one image size, got 640×480 and 800×600"):
        difference(world().camera, Camera("pinhole", (530.0, 530.0, 320.0, 240.0), (), (800, 600)))
