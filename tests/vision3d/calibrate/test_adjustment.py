"""The compiled normal equations meet differences for every lens; eliminating poses equals solving densely."""

from dataclasses import replace

import numpy as np
import pytest
from calibration_worlds import CAMERAS, world

from sequential.manifold import SE3
from vision3d.calibrate.adjustment import Unknowns, adjust, linearize
from vision3d.calibrate.descent import schur
from vision3d.calibrate.problem import Problem


def case(lens, n=3, seed=61):
    """A problem of a few views, unknowns a little off, and uneven weights."""
    scene, rng = world(lens, n=n, seed=seed), np.random.default_rng(seed)
    views = [view.subset(np.arange(0, 54, 5)) for view in scene.views(rng)]
    problem = Problem.of(views)
    poses = SE3().retract(scene.poses, 1e-3 * rng.standard_normal((n, 6)))
    unknowns = Unknowns(lens, scene.camera.parameters, np.array([2e-4, -3e-4]), poses)
    return problem, unknowns, rng.uniform(0.5, 4.0, len(problem.points))


def moved(unknowns, step):
    p = len(unknowns.parameters)
    return replace(
        unknowns,
        parameters=unknowns.parameters + step[:p],
        warp=unknowns.warp + step[p : p + 2],
        poses=SE3().retract(unknowns.poses, step[p + 2 :].reshape(-1, 6)),
    )


def differenced(problem, unknowns, weights):
    """Jacobian (M, 2, q + 6V) of the projections by all unknowns."""
    q, ones = len(unknowns.parameters) + 2, np.ones_like(weights)
    sizes = np.r_[np.full(4, 1e-3), np.full(q - 6, 1e-6), np.full(2 + 6 * len(unknowns.poses), 1e-6)]
    columns = []
    for step in np.diag(sizes):
        ahead, behind = (linearize(problem, moved(unknowns, s * step), ones).residuals for s in (1, -1))
        columns.append((behind - ahead) / (2.0 * step.max()))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("lens", CAMERAS)
def test_blocks_meet_differences(lens):
    problem, unknowns, weights = case(lens)
    blocks, jacobian = linearize(problem, unknowns, weights), differenced(problem, unknowns, weights)
    q = len(unknowns.parameters) + 2
    for v in range(problem.count):
        rows = slice(problem.starts[v], problem.starts[v + 1])
        own = slice(q + 6 * v, q + 6 * v + 6)
        w, r = weights[rows], blocks.residuals[rows]
        A, B = jacobian[rows, :, :q], jacobian[rows, :, own]
        for block, expected in (
            (blocks.U[v], np.einsum("n,nki,nkj->ij", w, A, A)),
            (blocks.W[v], np.einsum("n,nki,nkj->ij", w, A, B)),
            (blocks.T[v], np.einsum("n,nki,nkj->ij", w, B, B)),
            (blocks.a[v], np.einsum("n,nki,nk->i", w, A, r)),
            (blocks.b[v], np.einsum("n,nki,nk->i", w, B, r)),
        ):
            np.testing.assert_allclose(block, expected, rtol=2e-6, atol=1e-6 * np.abs(expected).max())
        others = np.delete(jacobian[rows, :, q:], np.s_[6 * v : 6 * v + 6], axis=2)
        assert not others.any()


@pytest.mark.parametrize("lens", ["pinhole", "brown5", "thin12", "fisheye4"])
def test_eliminating_the_poses_equals_the_dense_system(lens):
    problem, unknowns, weights = case(lens, n=5)
    blocks = linearize(problem, unknowns, weights)
    q, V = len(unknowns.parameters) + 2, problem.count
    dense, right = np.zeros((q + 6 * V, q + 6 * V)), np.zeros(q + 6 * V)
    dense[:q, :q], right[:q] = (
        blocks.U.sum(axis=0) + np.diag(blocks.prior),
        blocks.a.sum(axis=0) + blocks.pull,
    )
    for v in range(V):
        rows = slice(q + 6 * v, q + 6 * v + 6)
        dense[:q, rows], dense[rows, :q] = blocks.W[v], blocks.W[v].T
        dense[rows, rows], right[rows] = blocks.T[v], blocks.b[v]
    sizes = 1.0 / np.sqrt(np.diag(dense))
    step = sizes * np.linalg.solve(dense * sizes * sizes[:, None], sizes * right)
    S, reduced, T_inverse, Y = schur(blocks, np.ones(q, dtype=bool))
    scale = 1.0 / np.sqrt(np.diag(S))
    camera = scale * np.linalg.solve(S * scale * scale[:, None], scale * reduced)
    poses = np.einsum("vij,vj->vi", T_inverse, blocks.b) + Y @ camera
    np.testing.assert_allclose(np.r_[camera, poses.ravel()] / sizes, step / sizes, rtol=1e-5, atol=1e-6)


def test_what_is_held_stays_and_what_is_free_settles():
    problem, unknowns, weights = case("brown5", n=6)
    free = np.array([True] * 4 + [False] * 7)
    solved = adjust(problem, unknowns, weights, free)
    assert solved.converged
    np.testing.assert_array_equal(solved.unknowns.parameters[4:], unknowns.parameters[4:])
    np.testing.assert_array_equal(solved.unknowns.warp, unknowns.warp)
    assert np.abs(solved.unknowns.parameters[:4] - unknowns.parameters[:4]).min() > 0.0
    _, score, _, _ = schur(solved.blocks, free)
    assert np.abs(score / np.sqrt(np.diag(solved.blocks.U.sum(axis=0)))[free]).max() < 1e-2


def test_a_point_behind_the_camera_is_far_off_but_no_end():
    problem, unknowns, weights = case("brown5", n=4)
    turned = unknowns.poses.copy()
    turned[1, 6] *= -1.0
    blocks = linearize(problem, replace(unknowns, poses=turned), weights)
    assert blocks.lost == problem.starts[2] - problem.starts[1]
    assert np.isnan(blocks.residuals[problem.starts[1]]).all()
    assert np.isfinite(blocks.cost(weights))
    assert blocks.cost(weights) > 1e6 * linearize(problem, unknowns, weights).cost(weights)


def test_some_of_the_views_are_the_same_problem_without_the_others():
    problem, unknowns, weights = case("brown5", n=4)
    some = problem.only([1, 3])
    part = linearize(
        some, replace(unknowns, poses=unknowns.poses[[1, 3]]), weights[np.isin(problem.owner, [1, 3])]
    )
    whole = linearize(problem, unknowns, weights)
    np.testing.assert_array_equal(part.residuals, whole.residuals[np.isin(problem.owner, [1, 3])])
    np.testing.assert_array_equal(part.T, whole.T[[1, 3]])
