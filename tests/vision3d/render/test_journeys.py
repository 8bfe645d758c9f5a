"""Poses look where they should, and exact points are seen exactly where the photographs show them."""

import numpy as np
import pytest

from sequential.errors import ModelError
from vision3d.camera import Camera
from vision3d.render import (
    SCENES,
    forward_poses,
    looking_at,
    observe,
    orbit_poses,
    plain,
    render_journey,
    scene_points,
    sideways_poses,
    surface_points,
    turning_poses,
)
from vision3d.rigid import compose, inverse, transform

CAMERA = Camera("brown4", (140.0, 140.5, 80.5, 59.0), (-0.2, 0.04, 0.001, 0.0), (160, 120))


def test_a_camera_that_looks_at_a_point_has_it_in_the_middle(rng):
    for _ in range(20):
        place, target = rng.normal(size=3), rng.normal(size=3)
        pose = looking_at(place, target)
        there = transform(pose, target)
        np.testing.assert_allclose(there, [0, 0, np.linalg.norm(target - place)], atol=1e-12)
        np.testing.assert_allclose(transform(pose, place), 0.0, atol=1e-12)
        assert (transform(pose, target + np.array([0, 0.1, 0])) - there)[1] >= 0, "down stays down"
    with pytest.raises(ModelError, match="upright"):
        looking_at((0, 0, 0), (0, 3, 0))


def test_journeys_go_where_their_names_say():
    middle = np.array([0.2, 0.1, 1.5])
    orbit = orbit_poses(middle, 1.2, 5, height_m=0.4)
    for pose in orbit:
        assert np.hypot(1.2, 0.4) == pytest.approx(transform(pose, middle)[2])
    np.testing.assert_allclose(inverse(sideways_poses(3, 0.1)[2])[4:], [0.2, 0.0, 0.0])
    np.testing.assert_allclose(inverse(forward_poses(4, 0.1)[3])[4:], [0.0, 0.0, 0.3])
    turned = turning_poses(3, 0.2)
    assert not turned[:, 4:].any()
    second_T_first = compose(turned[1], inverse(turned[0]))
    # the camera turned to the right: what was straight ahead is now on its left
    assert transform(second_T_first, np.array([0.0, 0.0, 1.0]))[0] == pytest.approx(-np.sin(0.2))


@pytest.mark.parametrize("name", ["desk", "ground"])
def test_exact_points_are_what_the_pixels_show(name, rng):
    scene = SCENES[name](rng, plain())
    poses = orbit_poses((0, 0.2, 1.6), 1.5, 3)
    points = scene_points(scene, 400, rng)
    pixels = observe(CAMERA, poses, scene, points)
    assert pixels.shape == (3, 400, 2)
    for pose, row in zip(poses, pixels, strict=True):
        seen = np.isfinite(row).all(axis=1)
        assert 20 < seen.sum() < 350, "some hidden, some not"
        shown, _ = surface_points(CAMERA, pose, scene, row[seen])
        np.testing.assert_allclose(shown, points[seen], atol=1e-6)


def test_points_are_spread_by_area(rng):
    scene = SCENES["corridor"](rng, plain())
    points = scene_points(scene, 4000, rng)
    areas = np.array([np.prod(shape.size_m) for shape in scene.shapes])
    floor = np.abs(points[:, 1] - 0.6) < 1e-9
    bottoms = [k for k, shape in enumerate(scene.shapes) if "bottom" in shape.name]
    share = (areas[0] + areas[bottoms].sum()) / areas.sum()
    assert floor.mean() == pytest.approx(share, abs=4 * np.sqrt(share / 4000))


def test_a_journey_is_photographed_with_noise_of_its_own(rng):
    scene = SCENES["wall"](rng, plain())
    a, b = render_journey(CAMERA, np.tile(sideways_poses(1, 0.1), (2, 1)), scene, rng=rng)
    assert (a.image != b.image).mean() > 0.5
    np.testing.assert_array_equal(a.depth, b.depth)
