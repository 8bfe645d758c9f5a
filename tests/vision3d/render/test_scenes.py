"""Photographs of scenes agree with their truth: depth, occlusion, disparity, and where the texture lies."""

import cv2
import numpy as np
import pytest

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.render import (
    SCENES,
    Scene,
    box,
    is_seen,
    leaves,
    photograph,
    picture,
    plain,
    rectangle,
    render_planes,
    render_scene,
    render_stereo,
    sphere,
    surface_points,
    transfer,
)
from vision3d.render.scene import Plane
from vision3d.rigid import compose, inverse, transform

PINHOLE = Camera("pinhole", (280.0, 280.0, 159.5, 119.5), (), (320, 240))
BENT = Camera("brown4", (280.0, 281.0, 161.0, 118.0), (-0.25, 0.06, 0.001, -0.001), (320, 240))
WIDE = Camera("fisheye4", (150.0, 150.0, 160.0, 120.0), (0.02, -0.01, 0.002, 0.0), (320, 240))
HOME = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
ASIDE = np.array([1.0, 0.0, 0.0, 0.0, -0.1, 0.0, 0.0])
TURNED = np.array([0.995, 0.03, -0.08, 0.02, -0.1, 0.03, 0.05])
TURNED[:4] /= np.linalg.norm(TURNED[:4])


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("camera", [PINHOLE, BENT, WIDE], ids=lambda camera: camera.lens)
def test_depth_is_where_the_ray_ends(name, camera, rng):
    scene = SCENES[name](rng, **({} if name == "repeated wall" else {"material": plain()}))
    view = render_scene(camera, TURNED, scene)
    shown = np.isfinite(view.depth)
    assert (shown == (view.shape_id >= 0)).all()
    assert shown.mean() > 0.3
    v, u = np.nonzero(shown)
    there = transform(TURNED, view.points[shown])
    np.testing.assert_allclose(there[:, 2], view.depth[shown], rtol=1e-12)
    np.testing.assert_allclose(camera.project(there), np.column_stack([u, v]), atol=1e-6)
    for k, shape in enumerate(scene.shapes):
        own = transform(inverse(shape.world_T_shape), view.points[view.shape_id == k])
        if shape.kind == "sphere":
            np.testing.assert_allclose(np.linalg.norm(own, axis=1), 0.5 * shape.size_m[0], rtol=1e-9)
        else:
            np.testing.assert_allclose(own[:, 2], 0.0, atol=1e-9)
            assert (np.abs(own[:, :2]) <= 0.5 * np.array(shape.size_m) + 1e-9).all()


def test_nothing_stands_before_what_is_seen(rng):
    scene = SCENES["desk"](rng, plain())
    view = render_scene(PINHOLE, TURNED, scene)
    shown = np.isfinite(view.depth)
    assert is_seen(PINHOLE, TURNED, scene, view.points[shown]).all()
    behind = view.points[shown] + 0.0
    home = inverse(TURNED)[4:]
    behind += 0.01 * (behind - home)
    assert not is_seen(PINHOLE, TURNED, scene, behind).any()


@pytest.mark.parametrize("size", [(64, 64), (100, 37)])
def test_a_picture_lies_where_the_plane_renderer_puts_it(rng, size):
    """Two renderers that share no line: a smooth picture, seen obliquely through a lens."""
    small = rng.uniform(0.1, 0.9, (size[1] // 6, size[0] // 6)).astype(np.float32)
    grey = cv2.resize(small, size, interpolation=cv2.INTER_CUBIC).clip(0.0, 1.0)
    pose = compose(TURNED, np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]))
    step = 0.6 / (size[0] - 1)
    flat = render_planes(BENT, [Plane(pose, picture(grey, 0.6))], vignetting=0.0, blur_px=0.5)
    # the picture ends in the middle of its last pixels there, and at their outer edges here
    shape = rectangle(np.array([1.0, 0, 0, 0, 0, 0, 1.0]), (step * size[0], step * size[1]), photograph(grey))
    view = render_scene(BENT, TURNED, Scene((shape,), ambient=1.0), vignetting=0.0, blur_px=0.5)
    inside = cv2.erode((view.shape_id == 0).astype(np.uint8), np.ones((13, 13), np.uint8)).astype(bool)
    error = flat.astype(float)[inside] - view.image.astype(float)[inside]
    assert inside.sum() > 3000
    assert np.abs(error).max() <= 2.0


def test_a_pixel_far_away_is_a_mean():
    """Stripes finer than a pixel become grey, not random."""
    stripes = np.tile(np.array([0.0, 1.0], np.float32), (512, 256))
    shape = rectangle((1, 0, 0, 0, 0, 0, 9.0), (2.0, 2.0), photograph(stripes))
    view = render_scene(PINHOLE, HOME, Scene((shape,), ambient=1.0), vignetting=0.0, blur_px=0.0)
    grey = view.image[95:145, 135:185].astype(float)
    assert abs(grey.mean() - 117.5) < 1.5
    assert grey.std() < 3.0


@pytest.mark.parametrize(("pose", "camera"), [(ASIDE, PINHOLE), (TURNED, BENT)], ids=["rectified", "turned"])
def test_matches_of_a_pair_show_the_same(pose, camera, rng):
    """What the truth calls the same point looks the same in both photographs."""
    scene = SCENES["desk"](rng)
    pair = render_stereo(PINHOLE, camera, pose, scene, vignetting=0.0)
    x, y = np.moveaxis(pair.right_pixels, 2, 0).astype(np.float32)
    carried = cv2.remap(pair.right.image, x, y, cv2.INTER_CUBIC).astype(float)
    error = np.abs(carried - pair.left.image)
    seen = cv2.erode((~pair.occluded).astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
    assert 0.6 < seen.mean() < 0.95
    assert np.median(error[seen]) < 4.0
    assert np.median(error[pair.occluded & np.isfinite(x)]) > 12.0
    if pose is ASIDE:
        np.testing.assert_allclose(pair.disparity[seen], 280.0 * 0.1 / pair.left.depth[seen], rtol=1e-9)
    again = transfer(pair.left, pair.right, scene, np.array([[100.0, 100.0], [31.5, 200.25]]))
    np.testing.assert_allclose(again[0], pair.right_pixels[100, 100], atol=1e-9)


def test_what_is_occluded_is_hidden_in_the_right_image(rng):
    """A ball before a wall: what it hides is as wide as similar triangles say."""
    cover = leaves(rng, 256, count=1500)
    scene = Scene((rectangle((1, 0, 0, 0, 0, 0, 2.0), (4.0, 3.0), cover), sphere((0, 0, 1.0), 0.2, cover)))
    pair = render_stereo(PINHOLE, PINHOLE, ASIDE, scene)
    row = pair.occluded[119] & (pair.left.shape_id[119] == 0) & (np.arange(320) > 60)
    near = 280.0 * 0.1 / np.sqrt(1.0 - 0.2**2)  # the ray that touches the ball has about this disparity
    assert row.sum() == pytest.approx(near - 280.0 * 0.1 / 2.0, abs=2.0)
    assert np.flatnonzero(row).max() < 160, "left of the ball"


def test_noise_is_reproducible_and_belongs_to_each_image():
    scene = Scene((rectangle((1, 0, 0, 0, 0, 0, 1.0), (3.0, 3.0), plain()),))
    once, again = (
        render_stereo(PINHOLE, PINHOLE, HOME, scene, rng=np.random.default_rng(5)) for _ in range(2)
    )
    assert (once.left.image == again.left.image).all()
    assert (once.left.image != once.right.image).any()


def test_a_box_is_closed_and_its_faces_look_outwards():
    pose = compose(inverse(TURNED), np.array([1.0, 0, 0, 0, 0, 0, 2.0]))
    shapes = box(pose, (0.3, 0.4, 0.5), plain())
    for shape in shapes:
        middle = shapes[0].world_T_shape[4:] + shapes[1].world_T_shape[4:]
        outwards = transform(shape.world_T_shape, np.array([[0.0, 0.0, -1.0]]))[0] - shape.world_T_shape[4:]
        assert outwards @ (shape.world_T_shape[4:] - 0.5 * middle) > 0.1
    corners = np.concatenate([transform(s.world_T_shape, _corners(s.size_m)) for s in shapes]).round(9)
    assert len(np.unique(corners, axis=0)) == 8, "each corner belongs to three faces"


def _corners(size):
    x, y = 0.5 * np.array(size)
    return np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])


def test_colour_is_grey_in_its_tint():
    shape = rectangle((1, 0, 0, 0, 0, 0, 1.0), (3.0, 3.0), plain(0.5), tint=(0.2, 0.6, 1.0))
    image = render_scene(PINHOLE, HOME, Scene((shape,), ambient=1.0), vignetting=0.0, colour=True).image
    assert image[120, 160].tolist() == pytest.approx([24, 71, 118], abs=1)


def test_scenes_that_mean_nothing_are_refused(rng):
    with pytest.raises(ModelError, match="one shape at least"):
        Scene(())
    with pytest.raises(ModelError, match="positive"):
        sphere((0, 0, 1), -1.0, plain())
    with pytest.raises(ShapeError, match="seven finite numbers"):
        rectangle((0, 0, 1), (1, 1), plain())
    scene = Scene((sphere((0, 0, 1), 0.1, plain()),))
    with pytest.raises(ShapeError, match="camera_T_world"):
        render_scene(PINHOLE, np.zeros(6), scene)
    with pytest.raises(ModelError, match="supersample"):
        render_scene(PINHOLE, HOME, scene, supersample=0)
    points, found = surface_points(PINHOLE, HOME, scene, np.array([[0.0, 0.0], [159.5, 119.5]]))
    assert found.tolist() == [-1, 0]
    np.testing.assert_allclose(points[1], [0.0, 0.0, 0.9])
