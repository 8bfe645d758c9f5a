"""Planes of a cloud: found, honest, the largest first, and as open3d finds them."""

import numpy as np
import pytest

from sequential.errors import ModelError
from vision3d.cloud import fit_cloud_plane, segment_planes

NOISE_M = 0.004


@pytest.fixture
def room(rng):
    """Floor, wall and clutter: 3000, 1500 and 800 points; y is down, the origin is inside."""
    floor = np.column_stack([rng.uniform(-2, 2, 3000), np.full(3000, 1.2), rng.uniform(1, 5, 3000)])
    wall = np.column_stack([np.full(1500, 2.0), rng.uniform(-1, 1.2, 1500), rng.uniform(1, 5, 1500)])
    clutter = rng.uniform([-2.0, -1.0, 1.0], [2.0, 1.2, 5.0], (800, 3))
    return np.concatenate([floor, wall, clutter]) + NOISE_M * rng.standard_normal((5300, 3))


@pytest.mark.parametrize("backend", ["own", "open3d"])
def test_floor_and_wall_are_found_the_largest_first(room, backend):
    floor, wall = segment_planes(room, 3.0 * NOISE_M, most=5, backend=backend)[:2]
    np.testing.assert_allclose(floor.normal, [0.0, -1.0, 0.0], atol=2e-3)
    np.testing.assert_allclose(wall.normal, [-1.0, 0.0, 0.0], atol=2e-3)
    assert floor.offset_m == pytest.approx(1.2, abs=3e-3)
    assert wall.offset_m == pytest.approx(2.0, abs=3e-3)
    assert floor.rms_m == pytest.approx(NOISE_M, rel=0.15)
    assert (np.abs(floor.distance(room[:3000])) < 4.0 * NOISE_M).mean() > 0.99
    assert not np.intersect1d(floor.inliers, wall.inliers).size


def test_the_tilt_is_as_sure_as_it_says(seeds):
    off, told = [], []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        points = np.column_stack([rng.uniform(0, 3, 400), rng.uniform(0, 1, 400), np.full(400, 2.0)])
        points += 0.01 * rng.standard_normal(points.shape)
        plane = fit_cloud_plane(points, np.arange(400))
        off.append(plane.normal[1] ** 2)  # about the long side, the worse axis
        told.append(plane.tilt_std_rad**2)
    assert 0.5 < np.mean(off) / np.mean(told) < 1.8  # 20 runs: 95 % within 0.48-1.71


def test_a_cloud_without_planes_has_none(rng):
    ball = rng.standard_normal((2000, 3))
    assert segment_planes(ball, 0.005, fewest_points=100) == ()
    assert segment_planes(ball[:2], 0.01) == ()
    with pytest.raises(ModelError, match="distance_m"):
        segment_planes(ball, 0.0)
