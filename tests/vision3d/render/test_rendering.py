"""The compiled renderer against a plain one: every pixel is the mean of many points, evaluated with NumPy."""

from functools import cache

import numpy as np
import pytest

from sequential.errors import ModelError, ShapeError
from sequential.manifold import SE3
from sequential.manifold.quaternion import rotation_matrix
from vision3d.boards import Checkerboard, CircleGrid
from vision3d.camera import Camera
from vision3d.render import (
    Plane,
    board_texture,
    cells,
    distance_field,
    marker_texture,
    picture,
    render_planes,
)
from vision3d.render.scene import radiance_of

SIZE = (72, 54)
LENSES = {
    "pinhole": (),
    "brown5": (-0.28, 0.02, 0.0012, -0.0001, 0.16),
    "rational8": (0.2, -0.1, 0.001, 0.001, 0.01, 0.4, -0.05, 0.01),
    "fisheye4": (0.02, -0.01, 0.003, -0.001),
}
POSE = SE3().retract(np.array([1.0, 0, 0, 0, -0.08, -0.05, 0.33]), np.array([0.3, -0.4, 0.2, 0.0, 0.0, 0.0]))
BACK = 0.35


def camera(lens="pinhole", focal=60.0):
    return Camera(lens, (focal, focal, 36.2, 26.1), LENSES[lens], SIZE)


def wave(x, y):
    return 0.5 + 0.3 * np.sin(40.0 * x) * np.cos(30.0 * y)


def smooth_picture():
    x = np.linspace(-0.1, 0.3, 401)
    image = wave(*np.meshgrid(x, np.linspace(-0.1, 0.3, 401)))
    return picture(image, 0.4, centre=(0.1, 0.1))


def strip():
    x, y = np.linspace(-0.1, 0.3, 81), np.linspace(-0.1, 0.3, 81)
    return distance_field(x, y, np.broadcast_to(np.abs(x - 0.1) - 0.031, (81, 81)), within=0.1, without=0.8)


TEXTURES = {
    "checkerboard": board_texture(Checkerboard(9, 6, 0.02)),
    "marker": marker_texture("4x4_50", 3, 0.12),
    "circles": board_texture(CircleGrid(5, 4, 0.03)),
    "strip": strip(),
    "picture": smooth_picture(),
}


def evaluate(texture, x, y):
    """What a texture shows at points, NaN outside."""
    inside = (x >= texture.x_edges[0]) & (x < texture.x_edges[-1])
    inside &= (y >= texture.y_edges[0]) & (y < texture.y_edges[-1])
    if texture.kind == 2:
        return np.where(inside, wave(x, y), np.nan)
    if texture.kind == 1:
        return np.where(inside, np.where(np.abs(x - 0.1) < 0.031, 0.1, 0.8), np.nan)
    j = np.clip(np.searchsorted(texture.x_edges, x, side="right") - 1, 0, texture.values.shape[1] - 1)
    i = np.clip(np.searchsorted(texture.y_edges, y, side="right") - 1, 0, texture.values.shape[0] - 1)
    ex = 0.5 * (texture.x_edges[j] + texture.x_edges[j + 1])
    ey = 0.5 * (texture.y_edges[i] + texture.y_edges[i + 1])
    disc = np.hypot(x - ex, y - ey) < texture.radii[i, j]
    return np.where(inside, np.where(disc, texture.inner[i, j], texture.values[i, j]), np.nan)


@cache
def dense_rays(one, n):
    u, v = (((np.arange(side * n) + 0.5) / n - 0.5) for side in one.size)
    return one.unproject(np.stack(np.meshgrid(u, v), axis=-1))


def plain(one, pose, texture, n=16):
    """The mean of n by n points a pixel."""
    width, height = one.size
    rays = dense_rays(one, n)
    rotation = rotation_matrix(pose[:4])
    normal = rotation[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = (normal @ pose[4:]) / (rays @ normal)
        hits = (rays * depth[..., None] - pose[4:]) @ rotation
        shown = evaluate(texture, hits[..., 0], hits[..., 1])
        seen = (depth > 0) & np.isfinite(shown)
    return np.where(seen, shown, BACK).reshape(height, n, width, n).mean(axis=(1, 3))


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("what", TEXTURES)
def test_a_pixel_is_the_mean_over_its_area(lens, what):
    one = camera(lens)
    shown = radiance_of(one, [Plane(POSE, TEXTURES[what])], background=BACK)
    truth = plain(one, POSE, TEXTURES[what])
    error = shown - truth
    assert np.abs(error).max() < 0.06, "16 points a pixel are what the plain renderer takes"
    assert np.sqrt(np.mean(error**2)) < 0.003
    assert abs(error.mean()) < 2e-4


def test_straight_edges_are_exact():
    # facing, 2 px a cell, shifted by a share of a pixel: each pixel's value is known by hand
    one = Camera("pinhole", (100.0, 100.0, 0.0, 0.0), (), (4, 4))
    pose = np.array([1.0, 0, 0, 0, 0, 0, 1.0])
    texture = cells([-0.005, 0.0121, 0.1], [-0.005, 0.1], [[0.0, 1.0]])
    shown = radiance_of(one, [Plane(pose, texture)])
    np.testing.assert_allclose(shown, np.broadcast_to([0.0, 0.29, 1.0, 1.0], (4, 4)), atol=1e-6)


def test_a_texture_narrower_than_a_pixel_keeps_its_weight():
    one = Camera("pinhole", (100.0, 100.0, 0.0, 0.0), (), (5, 5))
    pose = np.array([1.0, 0, 0, 0, 0, 0, 1.0])
    shown = radiance_of(one, [Plane(pose, cells([0.018, 0.022], [-1.0, 1.0], [[1.0]]))], background=0.0)
    np.testing.assert_allclose(shown, np.broadcast_to([0, 0, 0.4, 0, 0], (5, 5)), atol=1e-6)


def test_later_planes_hide_earlier_ones_and_holes_do_not():
    one = camera()
    wall = cells([-1.0, 1.0], [-1.0, 1.0], [[0.2]])
    window = cells([-1.0, 0.0, 1.0], [-1.0, 1.0], [[-1.0, 0.7]])
    far, near = np.array([1.0, 0, 0, 0, 0, 0, 0.5]), np.array([1.0, 0, 0, 0, 0, 0, 0.4])
    shown = radiance_of(one, [Plane(far, wall), Plane(near, window)])
    assert shown[20, 5] == pytest.approx(0.2)
    assert shown[20, 60] == pytest.approx(0.7)
    assert radiance_of(one, [Plane(near, window), Plane(far, wall)])[20, 60] == pytest.approx(0.2)


def test_behind_the_camera_and_edge_on_there_is_nothing():
    for pose in ([1.0, 0, 0, 0, 0, 0, -0.5], [np.sqrt(0.5), np.sqrt(0.5), 0, 0, 0, 0, 0.5]):
        shown = radiance_of(camera(), [Plane(np.array(pose), TEXTURES["checkerboard"])])
        np.testing.assert_array_equal(shown, np.float32(BACK))


def test_where_the_lens_has_no_ray_there_is_the_background():
    folded = Camera("brown1", (60.0, 60.0, 36.2, 26.1), (-0.9,), SIZE)
    rays = folded.unproject(np.stack(np.meshgrid(np.arange(72.0), np.arange(54.0)), axis=-1))
    nowhere = np.isnan(rays[..., 0])
    assert 0.05 < nowhere.mean() < 0.9
    wall = cells([-20.0, 0.05, 20.0], [-20.0, 20.0], [[0.9, 0.1]])
    shown = radiance_of(folded, [Plane(np.array([1.0, 0, 0, 0, 0, 0, 0.3]), wall)], background=BACK)
    np.testing.assert_array_equal(shown[nowhere], np.float32(BACK))
    assert (shown[~nowhere] == np.float32(BACK)).mean() < 0.2, "but for the pixels on the border"
    assert np.isfinite(shown).all()


def test_noise_grows_with_the_signal(rng):
    one = Camera("pinhole", (200.0, 200.0, 99.5, 99.5), (), (200, 200))
    for reflectance in (0.1, 0.8):
        image = render_planes(one, [], rng=rng, background=reflectance, noise=4.0, vignetting=0.0)
        expected = np.sqrt(16.0 * (0.25 + reflectance) + 1 / 12)
        assert image.std() == pytest.approx(expected, rel=0.02)
        assert image.mean() == pytest.approx(235.0 * reflectance, abs=0.1)


def test_corners_of_the_image_are_darker():
    image = render_planes(camera(), [], background=0.8, vignetting=0.5)
    assert float(image[27, 36]) == pytest.approx(188, abs=1)
    assert image[0, 0] == image[-1, -1]
    assert float(image[0, 0]) == pytest.approx(94, abs=3)


def test_motion_blurs_along_itself():
    one = camera(focal=200.0)
    pose = np.array([1.0, 0, 0, 0, 0, 0, 1.0])
    edge = cells([-1.0, 0.0, 1.0], [-1.0, 1.0], [[0.0, 1.0]])
    moving = Plane(pose, edge, motion=np.array([0, 0, 0, 0.03, 0, 0]))  # 6 px
    row = radiance_of(one, [moving])[20]
    ramp = np.clip((np.arange(72) - 36.2) / 6.0 + 0.5, 0, 1)
    assert np.abs(row - ramp).max() < 0.1
    assert np.abs(radiance_of(one, [Plane(pose, edge)])[20] - ramp).max() > 0.3


def test_settings_that_mean_nothing_are_refused():
    with pytest.raises(ModelError, match="supersample"):
        render_planes(camera(), [], supersample=0)
    with pytest.raises(ShapeError, match=r"\(54, 72\)"):
        render_planes(camera(), [], background=np.zeros((3, 3)))
    with pytest.raises(ShapeError, match="camera_T_plane"):
        Plane(np.zeros(6), TEXTURES["strip"])
    with pytest.raises(ModelError, match="increase"):
        cells([0.0, 0.0], [0.0, 1.0], [[1.0]])
    with pytest.raises(ShapeError, match="rows by columns"):
        cells([0.0, 1.0], [0.0, 1.0], [[1.0, 2.0]])
    with pytest.raises(ModelError, match="equal steps"):
        distance_field([0.0, 1.0, 3.0], [0.0, 1.0], np.zeros((2, 3)))
