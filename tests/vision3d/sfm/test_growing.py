"""Our own mapper: from matches to the truth, through outliers, with and without a known focal length."""

from types import SimpleNamespace

import numpy as np
import pytest
from bundle_worlds import bundle_world, seen_from

from sequential.errors import ShapeError
from vision3d.camera import Camera
from vision3d.render import desk, orbit_poses, render_journey
from vision3d.rigid import inverse, transform
from vision3d.sfm.adjustment import adjust
from vision3d.sfm.bundle_problem import bundle_problem, resettled
from vision3d.sfm.focal_sweep import sweep_focal
from vision3d.sfm.growing import grow
from vision3d.sfm.growth import GrowthSettings, Scene
from vision3d.sfm.matched import match_images
from vision3d.sfm.seeding import seeds, verified_pairs


def apart(found, world):
    """Distance of camera centres from the truth after the best similarity, as a share of their spread."""
    known = world.centres[[world.names.index(name) for name in found.names]]
    a, b = found.centres - found.centres.mean(axis=0), known - known.mean(axis=0)
    U, _, Vt = np.linalg.svd(b.T @ a)
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    scale = np.sum(b * (a @ R.T)) / np.sum(a * a)
    return np.sqrt(np.mean(np.sum((b - scale * a @ R.T) ** 2, axis=1)) / np.mean(np.sum(b * b, axis=1)))


@pytest.mark.parametrize(
    ("lens", "wrong"), [("brown2", 0.0), ("brown2", 0.2), ("fisheye4", 0.1), ("pinhole", 0.3)]
)
def test_a_known_camera_gives_the_truth(lens, wrong, rng):
    world = bundle_world(rng, views=6, points=150, lens=lens, sigma_px=0.3)
    scene, matches = seen_from(world, rng, wrong=wrong)
    found = grow(scene, verified_pairs(scene, matches))
    assert found.names == world.names
    assert apart(found, world) < 0.01
    assert found.rms_px < 0.6
    assert len(found.points) > 0.8 * len(world.points)
    np.testing.assert_array_equal(found.cameras[0].parameters, world.cameras[0].parameters)
    assert (found.colors[:, :2] == [200, 100]).all()


def test_an_unknown_focal_length_is_found(rng):
    world = bundle_world(rng, views=6, points=200, lens="pinhole", sigma_px=0.3)
    guess = world.cameras[0].with_parameters([768.0, 768.0, *world.cameras[0].intrinsics[2:]])
    scene, matches = seen_from(world.replaced(cameras=(guess,)), rng, wrong=0.1, calibrate=True)
    swept = sweep_focal(scene, matches, np.array([True]))
    assert swept[0].intrinsics[0] == pytest.approx(520.0, rel=0.15)
    # cameras whose focal length is known stay
    assert sweep_focal(scene, matches, np.array([False])) is scene.cameras
    scene = Scene(scene.names, swept, scene.camera_of, scene.pixels)
    found = grow(scene, verified_pairs(scene, matches))
    assert found.cameras[0].intrinsics[0] == pytest.approx(520.0, rel=0.01)
    assert apart(found, world) < 0.02


def test_the_adjustment_is_passed_in(rng):
    world = bundle_world(rng, views=5, points=100)
    scene, matches = seen_from(world, rng, calibrate=True)
    calls = []

    def own(found, refine):
        calls.append((len(found.names), refine))
        problem, start = bundle_problem(found, refine=refine)
        return resettled(found, problem, adjust(problem, start).state)

    heard = []
    found = grow(scene, verified_pairs(scene, matches), adjust=own, placed=heard.append)
    assert len(found.names) == 5
    assert heard == [3, 4, 5]
    assert calls[0] == (2, False)
    assert calls[-1] == (5, True)


def test_a_focal_length_that_runs_away_is_held(rng):
    world = bundle_world(rng, views=4, points=60)
    scene, matches = seen_from(world, rng, calibrate=True)

    def runaway(found, refine):
        problem, start = bundle_problem(found, refine=False)
        moved = resettled(found, problem, adjust(problem, start).state)
        wild = tuple(camera.with_parameters(camera.parameters * 50.0) for camera in moved.cameras)
        return moved.replaced(cameras=wild) if refine else moved

    found = grow(scene, verified_pairs(scene, matches), adjust=runaway)
    assert found.names == world.names
    assert found.cameras == world.cameras


def test_an_image_of_something_else_is_left_out(rng):
    world = bundle_world(rng, views=4, points=60)
    pixels = np.array(world.pixels)
    stranger = world.image_index == 3
    pixels[stranger] = rng.uniform([0, 0], [640, 480], (stranger.sum(), 2))
    scene, matches = seen_from(world.replaced(pixels=pixels), rng)
    found = grow(scene, verified_pairs(scene, matches))
    assert found.names == tuple(name for k, name in enumerate(world.names) if k != 3)
    assert apart(found, world) < 0.02


def test_wrong_observations_do_not_cost_their_track(rng):
    world = bundle_world(rng, views=6, points=150, sigma_px=0.3)
    pixels = np.array(world.pixels)
    bad = rng.random(len(pixels)) < 0.05
    # along the epipolar lines of most pairs, so that two views cannot tell
    pixels[bad, 0] += rng.choice([-1, 1], bad.sum()) * rng.uniform(8, 20, bad.sum())
    scene, matches = seen_from(world.replaced(pixels=pixels), rng)
    found = grow(scene, verified_pairs(scene, matches))
    assert found.names == world.names
    assert apart(found, world) < 0.02
    assert found.errors_px().max() <= 4.0
    assert len(found.points) > 0.85 * len(world.points)


def test_a_camera_that_only_turns_begins_nothing(rng):
    world = bundle_world(rng, views=4, points=150, lens="pinhole")
    poses = np.array(world.cameras_T_world)
    poses[:, 4:] = 0.0
    camera = world.cameras[0]
    pixels = np.array([camera.project(transform(pose, world.points)) for pose in poses])
    inside = ((pixels > 0) & (pixels < (640, 480))).all(axis=2)
    images, points = np.nonzero(inside)
    turned = world.replaced(
        cameras_T_world=poses, image_index=images, point_index=points,
        pixels=pixels[inside] + 0.3 * rng.standard_normal((inside.sum(), 2)),
    )  # fmt: skip
    scene, matches = seen_from(turned, rng)
    pairs = verified_pairs(scene, matches)
    told = [pair.view.verdict for pair in pairs]
    # one pair or another may look as if it had moved, by less than its noise
    assert told.count("pure rotation") >= 3
    assert len(seeds(pairs, GrowthSettings())) == len(told) - told.count("pure rotation")
    assert grow(scene, pairs) is None
    assert grow(scene, []) is None


def test_rendered_pictures_give_the_truth(rng):
    """From pixels to metres with nothing from outside: render, detect, match, grow."""
    camera = Camera("brown1", (290.0, 290.0, 119.5, 89.5), (-0.08,), (240, 180))
    poses = orbit_poses([0.0, 0.0, 2.0], 2.0, 4, arc_rad=0.6)
    views = render_journey(camera, poses, desk(rng), rng=rng)
    pictures = {f"{k}.png": view.image for k, view in enumerate(views)}
    scene, matches = match_images(pictures, camera, count=600, calibrate=True)
    found = grow(scene, verified_pairs(scene, matches))
    assert found.names == tuple(pictures)
    assert found.cameras[0].intrinsics[0] == pytest.approx(290.0, rel=0.02)
    centres = inverse(poses)[:, 4:]
    assert apart(found, SimpleNamespace(names=list(pictures), centres=centres)) < 0.02
    assert len(found.points) > 100
    assert np.std(found.colors) > 10.0


def test_images_and_cameras_go_together(rng):
    picture = rng.integers(0, 255, (120, 160), dtype=np.uint8)
    camera = Camera("pinhole", (150, 150, 79.5, 59.5), (), (160, 120))
    with pytest.raises(ShapeError, match="names one of 2 cameras for each of 3 images"):
        match_images({"a": picture, "b": picture, "c": picture}, (camera, camera), (0, 1))
    scene, _ = match_images({"a": picture, "b": picture}, (camera, camera), (0, 1), count=50)
    assert scene.camera(1) is camera
    assert scene.colors[0].shape == (len(scene.pixels[0]), 3)
