"""Laws of clouds that are thinned, cleaned and given normals, and open3d as the other opinion."""

import numpy as np
import pytest

from sequential.errors import DataError, ModelError, ShapeError
from vision3d.cloud import estimate_normals, outliers_by_radius, remove_outliers, voxel_downsample

BACKENDS = ("own", "open3d")


@pytest.fixture
def sphere(rng):
    """Points on a unit sphere, 1 mm of noise."""
    away = rng.standard_normal((4000, 3))
    return away / np.linalg.norm(away, axis=1, keepdims=True) + 1e-3 * rng.standard_normal((4000, 3))


def test_voxels_hold_every_point_once_and_keep_means(sphere, rng):
    thin = voxel_downsample(sphere, 0.1)
    assert thin.counts.sum() == len(sphere)
    assert len(thin.points) < len(sphere) / 3
    np.testing.assert_allclose(thin.counts @ thin.points, sphere.sum(axis=0), atol=1e-9)
    assert np.abs(sphere - thin.points[thin.voxel_of]).max() < 0.1
    values = rng.standard_normal((len(sphere), 2))
    np.testing.assert_allclose(thin.counts @ thin.mean(values), values.sum(axis=0), atol=1e-9)
    np.testing.assert_allclose(thin.mean(values[:, 0]), thin.mean(values)[:, 0])


def test_a_thin_cloud_stays_as_it_is_and_the_order_of_points_does_not_matter(sphere, rng):
    thin = voxel_downsample(sphere, 1e-5)
    assert len(thin.points) == len(sphere)
    order = rng.permutation(len(sphere))
    np.testing.assert_allclose(
        voxel_downsample(sphere[order], 0.2).points, voxel_downsample(sphere, 0.2).points
    )


def test_voxels_are_open3ds(sphere):
    own, theirs = (voxel_downsample(sphere, 0.15, backend=backend) for backend in BACKENDS)
    orders = [np.lexsort(thin.points.round(9).T) for thin in (own, theirs)]
    np.testing.assert_allclose(own.points[orders[0]], theirs.points[orders[1]], atol=1e-9)
    np.testing.assert_array_equal(own.counts[orders[0]], theirs.counts[orders[1]])


@pytest.mark.parametrize("backend", BACKENDS)
def test_normals_of_a_sphere_are_its_radii(sphere, backend):
    found = estimate_normals(sphere, neighbours=30, towards=(0.0, 0.0, 0.0), backend=backend)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0)
    off = np.degrees(np.arccos(np.clip(-np.einsum("ij,ij->i", found.normals, sphere), -1.0, 1.0)))
    assert np.median(off) < 2.0
    assert np.median(found.flatness) > 0.95


def test_flatness_tells_a_plane_from_a_ball(rng):
    plane = np.column_stack([rng.uniform(size=(500, 2)), np.zeros(500)])
    ball = rng.standard_normal((500, 3))
    assert estimate_normals(plane).flatness.min() > 0.999
    assert np.median(estimate_normals(ball).flatness) < 0.8
    np.testing.assert_allclose(np.abs(estimate_normals(plane).normals[:, 2]), 1.0)


@pytest.mark.parametrize("backend", BACKENDS)
def test_stragglers_are_removed_and_little_else(sphere, rng, backend):
    far = rng.uniform(-3.0, 3.0, (200, 3))
    far = far[np.abs(np.linalg.norm(far, axis=1) - 1.0) > 0.5]
    cloud = np.concatenate([sphere, far])
    for kept in (
        remove_outliers(cloud, deviations=1.0, backend=backend),
        outliers_by_radius(cloud, 0.15, at_least=5, backend=backend),
    ):
        assert kept[: len(sphere)].mean() > 0.99
        assert kept[len(sphere) :].mean() < 0.05


def test_outliers_are_open3ds(sphere, rng):
    cloud = np.concatenate([sphere, rng.uniform(-2.0, 2.0, (100, 3))])
    np.testing.assert_array_equal(*(remove_outliers(cloud, backend=backend) for backend in BACKENDS))
    np.testing.assert_array_equal(
        *(outliers_by_radius(cloud, 0.2, at_least=6, backend=backend) for backend in BACKENDS)
    )


def test_small_clouds_are_met(rng):
    nothing = np.empty((0, 3))
    assert voxel_downsample(nothing, 0.1).points.shape == (0, 3)
    assert remove_outliers(nothing).shape == (0,)
    assert remove_outliers(rng.standard_normal((2, 3))).all()
    assert not outliers_by_radius(rng.standard_normal((3, 3)), 1.0).any()
    with pytest.raises(DataError, match="at least 3, got 2"):
        estimate_normals(rng.standard_normal((2, 3)))


def test_wrong_input_is_told(sphere):
    with pytest.raises(ShapeError, match=r"expected \(N, 3\), got \(5, 2\)"):
        voxel_downsample(np.zeros((5, 2)), 0.1)
    with pytest.raises(DataError, match="are not finite, the first is number 1"):
        remove_outliers([[0.0, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    with pytest.raises(ModelError, match="expected a number above zero, got -1"):
        voxel_downsample(sphere, -1.0)
    with pytest.raises(DataError, match="take larger cubes"):
        voxel_downsample(sphere, 1e-9)
    with pytest.raises(ModelError, match="no backend 'pcl'"):
        voxel_downsample(sphere, 0.1, backend="pcl")
    with pytest.raises(ShapeError, match="to go with the points"):
        voxel_downsample(sphere, 0.1).mean(np.zeros(3))
