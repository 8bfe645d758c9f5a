"""ICP: truth, honesty, what cannot be determined, and open3d's answer on the same pairs."""

import numpy as np
import pytest

from sequential.errors import DataError, ModelError
from sequential.manifold import SE3
from vision3d.cloud import icp
from vision3d.rigid import inverse, transform

METHODS = ("point-to-plane", "point-to-point")
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
NOISE_M = 0.005


def corner_of_a_room(count, rng):
    """Points on three walls that meet, and their normals."""
    wall = rng.integers(0, 3, count)
    points = rng.uniform(size=(count, 3))
    points[np.arange(count), wall] = 0.0
    return points, np.eye(3)[wall]


def scan(rng, *, count=1500, noise=NOISE_M, spread=(0.05, 0.03)):
    """A room, its normals, some of it seen from elsewhere, and where that was."""
    room, normals = corner_of_a_room(20000, rng)
    seen, _ = corner_of_a_room(count, rng)
    step = np.concatenate([rng.normal(0.0, spread[0], 3), rng.normal(0.0, spread[1], 3)])
    truth = SE3().retract(IDENTITY, step)
    return room, normals, transform(inverse(truth), seen) + noise * rng.standard_normal(seen.shape), truth


@pytest.mark.parametrize("method", METHODS)
def test_a_cloud_finds_itself_again(rng, method):
    room, _, _, truth = scan(rng, spread=(0.02, 0.01))
    found = icp(transform(inverse(truth), room[:3000]), room, method=method, max_iterations=300)
    assert found.converged
    np.testing.assert_allclose(SE3().local(truth, found.target_T_source), 0.0, atol=2e-4)


@pytest.mark.parametrize("normals_known", [True, False])
def test_the_covariance_is_honest(seeds, normals_known):
    nees = []
    for seed in seeds:
        room, normals, seen, truth = scan(np.random.default_rng(seed))
        found = icp(seen, room, normals=normals if normals_known else None)
        off = SE3().local(found.target_T_source, truth)
        nees.append(off @ np.linalg.solve(found.cov, off) / 6.0)
    # 20 runs of 6: 95 % within 0.76-1.28, and points near a corner pair with the wrong wall
    assert 0.7 < np.mean(nees) < 1.6


def test_a_third_of_strangers_and_partial_overlap_are_borne(rng):
    room, _, seen, truth = scan(rng)
    strangers = rng.uniform(-0.5, 1.5, (700, 3))
    found = icp(np.concatenate([seen, strangers]), room[room[:, 0] < 0.7])
    off = SE3().local(found.target_T_source, truth)
    assert np.degrees(np.linalg.norm(off[:3])) < 0.5
    assert np.linalg.norm(off[3:]) < 0.003
    assert 0.3 < found.overlap < 0.9


def test_what_a_plane_leaves_free_is_named(rng):
    floor = np.column_stack([rng.uniform(-1.0, 2.0, (20000, 2)), np.zeros(20000)])
    above = np.column_stack([rng.uniform(size=(2000, 2)), np.full(2000, 0.02)])
    found = icp(above, floor)
    np.testing.assert_allclose(found.target_T_source, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.02], atol=1e-9)
    assert found.cov is None
    assert "3 of 6 directions free" in found.stopped
    # turning about z, sliding along x and y: nothing else
    np.testing.assert_allclose(found.free[:, [0, 1, 5]], 0.0, atol=1e-9)
    assert np.linalg.matrix_rank(found.free) == 3


@pytest.mark.parametrize("method", METHODS)
def test_open3d_stops_at_the_same_place(rng, method):
    room, normals, seen, truth = scan(rng)
    own, theirs = (
        icp(seen, room, normals=normals, method=method, max_distance_m=0.1, backend=backend)
        for backend in ("own", "open3d")
    )
    assert np.abs(SE3().local(own.target_T_source, theirs.target_T_source)).max() < 2e-3
    assert np.linalg.norm(SE3().local(own.target_T_source, truth)) < (
        4e-3 if method == "point-to-plane" else 1e-2
    )


def test_what_cannot_be_brought_together_is_told(rng):
    room, _, seen, _ = scan(rng)
    with pytest.raises(DataError, match="have a partner nearer than"):
        icp(seen + 50.0, room, max_distance_m=0.1)
    with pytest.raises(DataError, match="source: expected at least 6, got 5"):
        icp(seen[:5], room)
    with pytest.raises(ModelError, match="no method 'gicp'"):
        icp(seen, room, method="gicp")
    with pytest.raises(ModelError, match="open3d needs one"):
        icp(seen, room, backend="open3d")
    assert "1 iterations were not enough" in icp(seen, room, max_iterations=1).stopped
