"""Pictures of clouds: what is nearer hides what is farther, and a viewpoint shows the cloud."""

import numpy as np
import pytest

from sequential.errors import ModelError, ShapeError
from vision3d.camera import Camera
from vision3d.cloud import poisson_mesh, splat, viewpoint
from vision3d.rigid import transform

CAMERA = Camera("pinhole", (100.0, 100.0, 31.5, 23.5), (), (64, 48))
HERE = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
RED, BLUE = (255, 0, 0), (0, 0, 255)


def wall(z):
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 400), np.linspace(-1.0, 1.0, 400))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)])


@pytest.mark.parametrize("turned", [False, True])
def test_the_nearest_point_is_seen_whatever_the_order(turned):
    order = slice(None, None, -1 if turned else 1)
    points = np.concatenate([wall(2.0), wall(3.0)])[order]
    colors = np.repeat([RED, BLUE], [len(wall(2.0))] * 2, axis=0)[order]
    picture = splat(points, colors, CAMERA, HERE, shading=0.0)
    assert (picture == RED).all()


def test_every_pixel_is_where_the_camera_sees_the_point():
    points = np.array([[0.0, 0.0, 2.0], [0.4, 0.2, 2.0], [0.0, 0.0, -2.0], [9.0, 0.0, 2.0]])
    picture = splat(points, None, CAMERA, HERE, radius_px=0.4, shading=0.0)
    drawn = np.argwhere((picture != 255).any(axis=2))[:, ::-1]
    np.testing.assert_array_equal(drawn, np.rint(CAMERA.project(points[:2])))


def test_edges_are_darker_than_faces():
    points = np.concatenate([wall(3.0), 0.3 * wall(2.0) + [0.0, 0.0, 1.4]])
    lit = splat(points, None, CAMERA, HERE, radius_px=1.5)
    flat = splat(points, None, CAMERA, HERE, radius_px=1.5, shading=0.0)
    darker = (lit.astype(int) < flat).any(axis=2)
    assert 0.01 < darker.mean() < 0.3


def test_a_viewpoint_has_the_cloud_in_its_picture(rng):
    points = rng.standard_normal((3000, 3)) * [3.0, 1.0, 2.0] + [5.0, -2.0, 30.0]
    camera, camera_T_world = viewpoint(points, size=(320, 240))
    pixels = camera.project(transform(camera_T_world, points))
    inside = ((pixels > 0.0) & (pixels < [319.0, 239.0])).all(axis=1)
    assert inside.mean() > 0.93
    np.testing.assert_allclose(np.median(pixels, axis=0), [160.0, 120.0], atol=20.0)
    down = transform(camera_T_world, np.array([[0.0, 1.0, 0.0]])) - transform(
        camera_T_world, np.zeros((1, 3))
    )
    assert down[0, 1] > 0.7
    assert abs(down[0, 0]) < 1e-9


def test_wrong_input_is_told():
    with pytest.raises(ShapeError, match="to go with the points"):
        splat(wall(1.0), np.zeros((2, 3)), CAMERA, HERE)
    with pytest.raises(ModelError, match="point the same way"):
        viewpoint(wall(1.0), forward=(0.0, 2.0, 0.0))


def test_a_poisson_surface_goes_through_the_points(rng):
    away = rng.standard_normal((3000, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    mesh = poisson_mesh(2.0 * away, away, depth=5)
    np.testing.assert_allclose(np.linalg.norm(mesh.points, axis=1), 2.0, atol=0.05)
    corners = mesh.points[mesh.faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", outward, corners.mean(axis=1)) > 0.0).all()
    assert np.linalg.norm(outward, axis=1).sum() / 2.0 == pytest.approx(16.0 * np.pi, rel=0.03)
    half = mesh.trimmed(0.5)
    assert 0.3 * len(mesh.points) < len(half.points) < 0.6 * len(mesh.points)
    assert half.faces.max() < len(half.points)
    with pytest.raises(ModelError, match="expected 1 to 14"):
        poisson_mesh(away, away, depth=40)
