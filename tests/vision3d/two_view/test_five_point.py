"""The five-point solver: the truth is among its answers, every answer is essential, and PoseLib agrees."""

import numpy as np
from two_view_worlds import random_motion

from vision3d.kernels.five_point import solve_five_point
from vision3d.rigid import transform
from vision3d.two_view import essential_matrix

SAMPLE = np.arange(5)


def five(rng, depth=(1.0, 4.0), width=1.0):
    b_T_a = random_motion(rng, 0.5)
    points = np.column_stack([rng.uniform(-width, width, (5, 2)), rng.uniform(*depth, 5)])
    a, b = points, transform(b_T_a, points)
    return b_T_a, np.hstack([rows / np.linalg.norm(rows, axis=1, keepdims=True) for rows in (a, b)])


def solutions(pairs):
    out = np.empty((10, 9))
    return out[: solve_five_point(pairs, SAMPLE, out)].reshape(-1, 3, 3)


def off(E, others):
    return min((min(abs(E - one).max(), abs(E + one).max()) for one in others), default=np.inf)


def test_truth_is_among_the_solutions_of_exact_pairs(rng):
    worst = [
        off(essential_matrix(b_T_a), solutions(pairs)) for b_T_a, pairs in (five(rng) for _ in range(500))
    ]
    # near a double root a solution has half the digits
    assert np.percentile(worst, 99.0) < 1e-10
    assert max(worst) < 1e-6


def test_solutions_are_essential_and_explain_the_pairs(rng):
    for _ in range(200):
        _, pairs = five(rng)
        pairs[:, 3:] += 0.01 * rng.standard_normal((5, 3))
        for E in solutions(pairs):
            np.testing.assert_allclose(np.linalg.svd(E, compute_uv=False), [1.0, 1.0, 0.0], atol=1e-9)
            np.testing.assert_allclose(np.sum((pairs[:, :3] @ E.T) * pairs[:, 3:], axis=1), 0.0, atol=1e-9)


def test_wide_scenes_and_far_points_are_no_exception(rng):
    for depth, width in (((0.5, 100.0), 1.0), ((1.0, 1.5), 5.0)):
        worst = [
            off(essential_matrix(b_T_a), solutions(pairs))
            for b_T_a, pairs in (five(rng, depth, width) for _ in range(100))
        ]
        assert np.percentile(worst, 95.0) < 1e-8


def test_as_many_solutions_as_poselib(rng):
    import poselib

    found, theirs = 0, 0
    for _ in range(200):
        _, pairs = five(rng)
        ours = solutions(pairs)
        for one in poselib.relpose_5pt(list(pairs[:, :3]), list(pairs[:, 3:])):
            theirs += 1
            found += off(essential_matrix(np.r_[one.q, one.t]), ours) < 1e-4
    assert found >= 0.97 * theirs  # PoseLib loses digits where ours are polished


def test_fewer_equations_than_five_give_nothing(rng):
    _, pairs = five(rng)
    pairs[1:] = pairs[0]
    assert all(np.isfinite(E).all() for E in solutions(pairs))
