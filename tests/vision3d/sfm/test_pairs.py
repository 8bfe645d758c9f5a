"""Which pairs of a large set are matched; and how loops and turns are judged."""

from itertools import combinations

import numpy as np
import pytest

from sequential.manifold.quaternion import (
    quaternion_exp,
    quaternion_inverse,
    quaternion_multiply,
    rotation_matrix,
)
from vision3d.sfm import ViewGraph
from vision3d.sfm.extraction import PictureFeatures
from vision3d.sfm.pairs import worth_matching
from vision3d.sfm.turning import FARTHEST_FROM_TURNING, distance_from_turning

SIZE = (640, 480)
K = np.array([[520.0, 0.0, 320.0], [0.0, 520.0, 240.0], [0.0, 0.0, 1.0]])


def along_a_street(rng, count):
    """Pictures of which each shares half of its features with the next."""
    seen = rng.integers(0, 255, (60 * (count + 1), 128)).astype(np.uint8)
    keypoints = np.tile(np.array([[0, 0, 5, 0, 0, 5]], np.float32), (120, 1))
    colors = np.zeros((120, 3), np.uint8)
    return [
        PictureFeatures(f"{k}", SIZE, f"{k}", None, "", keypoints, seen[60 * k : 60 * k + 120], colors)
        for k in range(count)
    ]


def test_small_sets_are_matched_pair_by_pair(rng):
    assert worth_matching(along_a_street(rng, 6)) == list(combinations(range(6), 2))


def test_large_sets_keep_the_pairs_that_share_something(rng):
    pairs = set(worth_matching(along_a_street(rng, 70)))
    assert {(k, k + 1) for k in range(69)} <= pairs
    assert len(pairs) < 0.7 * 70 * 69 / 2


def graph_of(turns, wrong=()):
    """Pairs of all pictures whose rotations (N, 4) are known, a few of them wrong by half a radian."""
    count = len(turns)
    pairs = list(combinations(range(count), 2))
    b_R_a = np.array([quaternion_multiply(turns[b], quaternion_inverse(turns[a])) for a, b in pairs])
    for pair in wrong:
        off = quaternion_exp(np.array([0.0, 0.5, 0.0]))
        b_R_a[pairs.index(pair)] = quaternion_multiply(off, b_R_a[pairs.index(pair)])
    many = np.full(len(pairs), 100)
    kinds = ("general",) * len(pairs)
    return ViewGraph(tuple("abcdef"[:count]), np.full(count, 1000), pairs, many, many, kinds, b_R_a)


def test_loops_close_where_pairs_agree(rng):
    turns = quaternion_exp(rng.normal(0.0, 0.5, (6, 3)))
    loops = graph_of(turns).loops()
    assert len(loops) == 20
    assert loops.errors_rad.max() < 1e-7


def test_a_wrong_pair_shows_in_its_triangles_only(rng):
    turns = quaternion_exp(rng.normal(0.0, 0.5, (6, 3)))
    loops = graph_of(turns, wrong=[(1, 4)]).loops()
    touched = [1 in triangle and 4 in triangle for triangle in loops.triangles.tolist()]
    assert sum(touched) == 4
    np.testing.assert_allclose(loops.errors_rad, np.where(touched, 0.5, 0.0), atol=1e-7)


def test_turns_are_told_from_planes_without_a_focal_length(rng):
    turns = rotation_matrix(quaternion_exp(rng.normal(0.0, 0.15, (6, 3))))
    only = [K @ turn @ np.linalg.inv(K) for turn in turns]
    distance, focal_px = distance_from_turning(only, SIZE)
    assert distance < FARTHEST_FROM_TURNING
    assert focal_px == pytest.approx(520.0, rel=0.03)
    moved = rng.normal(0.0, 0.1, (6, 3))  # over the distance of the plane
    flat = [
        K @ (turn + np.outer(step, [0.2, 0.0, 1.0])) @ np.linalg.inv(K)
        for turn, step in zip(turns, moved, strict=True)
    ]
    assert distance_from_turning(flat, SIZE)[0] > 3.0 * FARTHEST_FROM_TURNING
