"""Covariances of a bundle adjustment: equal to a dense inverse in every gauge, and honest by Monte Carlo."""

import numpy as np
import pytest
from bundle_worlds import bundle_world, disturbed

from sequential.errors import ModelError, UnderConstrainedError
from sequential.manifold import SE3
from vision3d.rigid import inverse
from vision3d.sfm.adjustment import adjust
from vision3d.sfm.bundle_covariance import bundle_covariances
from vision3d.sfm.bundle_problem import bundle_problem
from vision3d.sfm.gauge import GAUGES, check_gauge, constraints, directions, restore


def dense_information(problem, state):
    """The whole normal matrix of views and points."""
    linear, n, N = problem.linearize(state), problem.size, len(state.points)
    J = np.zeros((len(problem.images), 2, n + 3 * N))
    for k, (i, j) in enumerate(zip(problem.images, problem.tracks, strict=True)):
        for m, place in enumerate(problem.columns[i]):
            if place >= 0:
                J[k, :, place] += linear.by_view[k, :, m]
        J[k, :, n + 3 * j : n + 3 * j + 3] = linear.by_point[k]
    return np.einsum("kra,krb->ab", J, J)


def stacked(columns):
    return np.concatenate([columns.views, columns.points.reshape(-1, columns.count)])


@pytest.mark.parametrize("gauge", GAUGES)
@pytest.mark.parametrize("fixed", [(), (1,), (0, 3)])
def test_every_gauge_meets_the_dense_inverse(gauge, fixed, rng):
    problem, state = bundle_problem(bundle_world(rng, views=5, points=30), fixed=fixed)
    told = bundle_covariances(problem, state, gauge=gauge, sigma_px=1.0)
    G = directions(problem, state)
    information = dense_information(problem, state)
    if G.count:
        D = stacked(constraints(problem, state, gauge, G))
        P = np.eye(len(information)) - stacked(G) @ np.linalg.solve(D.T @ stacked(G), D.T)
        held = D / np.linalg.norm(D, axis=0) * np.sqrt(np.median(np.diag(information)))
        covariance = P @ np.linalg.inv(information + held @ held.T) @ P.T
    else:
        covariance = np.linalg.inv(information)
    n = problem.size
    size = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(told.views, covariance[:n, :n], atol=1e-6 * np.outer(size, size)[:n, :n].max())
    for j, own in enumerate(told.points):
        part = slice(n + 3 * j, n + 3 * j + 3)
        np.testing.assert_allclose(own, covariance[part, part], atol=1e-7 * np.trace(covariance[part, part]))


def test_the_gauge_is_what_is_said(rng):
    problem, state = bundle_problem(bundle_world(rng))
    first = bundle_covariances(problem, state, sigma_px=0.5)
    assert np.abs(first.centres[0]).max() < 1e-16
    by_points = bundle_covariances(problem, state, gauge="points", sigma_px=0.5)
    by_centres = bundle_covariances(problem, state, gauge="centres", sigma_px=0.5)

    def total(covs):
        return np.trace(covs, axis1=1, axis2=2).sum()

    assert total(by_points.points) < min(total(first.points), total(by_centres.points))
    assert total(by_centres.centres[:, 3:, 3:]) < min(
        total(first.centres[:, 3:, 3:]), total(by_points.centres[:, 3:, 3:])
    )
    # what the gauge does not touch is the same in all
    np.testing.assert_allclose(by_points.intrinsics[0], first.intrinsics[0], rtol=1e-6)
    np.testing.assert_allclose(by_centres.intrinsics[0], first.intrinsics[0], rtol=1e-6)


def test_poses_and_their_inverses_have_the_same_covariance_in_other_charts(rng):
    truth = bundle_world(rng)
    problem, state = bundle_problem(truth)
    told, h = bundle_covariances(problem, state, gauge="centres", sigma_px=1.0), 1e-6
    for i in (1, 4):
        pose, there = state.poses[i], inverse(state.poses[i])
        J = np.array([SE3().local(pose, inverse(SE3().retract(there, h * e))) / h for e in np.eye(6)]).T
        np.testing.assert_allclose(told.poses[i], J @ told.centres[i] @ J.T, rtol=1e-4, atol=1e-12)


def aligned(problem, state, truth, gauge):
    """Where the estimate differs from the truth, in a gauge: what its constraints say moved is taken out."""
    eta = SE3().local(inverse(truth.poses), inverse(state.poses))
    step = np.zeros(problem.size)
    places = problem.columns[:, :6]
    step[places[places >= 0]] = eta[places >= 0]
    for c, place in enumerate(problem.camera_columns):
        free = problem.basis[c][:, : len(problem.free[c])]
        step[place] = np.linalg.lstsq(free, state.parameters[c] - truth.parameters[c], rcond=None)[0]
    moved = state.points - truth.points
    G = directions(problem, truth)
    D = constraints(problem, truth, gauge, G)
    back = np.linalg.solve(D.dot(G), D.views.T @ step + np.einsum("nxg,nx->g", D.points, moved))
    return step - G.views @ back, moved - G.points @ back


@pytest.mark.slow
@pytest.mark.parametrize("gauge", GAUGES)
def test_errors_are_as_large_as_the_covariance_says(gauge, seeds):
    by_view, by_point, by_intrinsics = [], [], []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        truth = bundle_world(rng, views=6, points=80)
        problem, at = bundle_problem(truth)
        start = bundle_problem(disturbed(truth, rng, share=0.3))[1]
        state = restore(adjust(problem, start).state, at)
        told = bundle_covariances(problem, state, gauge=gauge, sigma_px=0.5)
        step, moved = aligned(problem, state, at, gauge)
        by_point.append(np.einsum("nx,nxy,ny->n", moved, np.linalg.inv(told.points), moved).mean() / 3)
        for i in range(2, 6):
            own = problem.columns[i, :6]
            by_view.append(step[own] @ np.linalg.pinv(told.centres[i], rcond=1e-9) @ step[own] / 6)
        own = problem.camera_columns[0]
        by_intrinsics.append(step[own] @ np.linalg.solve(told.intrinsics[0], step[own]) / 3)
    spread = 4.0 / np.sqrt(len(seeds))
    assert np.mean(by_point) == pytest.approx(1.0, abs=0.5 * spread)
    assert np.mean(by_view) == pytest.approx(1.0, abs=0.5 * spread)
    assert np.mean(by_intrinsics) == pytest.approx(1.0, abs=spread)


@pytest.mark.parametrize(
    ("loss", "allowed"), [("none", 0.06), ("huber", 0.06), ("soft_l1", 0.06), ("cauchy", 0.07)]
)
def test_noise_is_found_whatever_the_loss(loss, allowed, rng):
    truth = bundle_world(rng, views=8, points=300, sigma_px=0.4)
    problem, start = bundle_problem(truth)
    state = adjust(problem, start, loss=loss).state
    told = bundle_covariances(problem, state, loss=loss)
    # a robust loss pays for its robustness with a little efficiency
    assert told.sigma_px == pytest.approx(0.4, rel=allowed)


def test_outliers_do_not_inflate_the_noise_of_a_robust_fit(rng):
    truth = bundle_world(rng, views=8, points=300, sigma_px=0.4)
    pixels = np.array(truth.pixels)
    bad = rng.random(len(pixels)) < 0.05
    pixels[bad] += rng.uniform(-80, 80, (bad.sum(), 2))
    problem, start = bundle_problem(truth.replaced(pixels=pixels))
    told = {
        loss: bundle_covariances(problem, adjust(problem, start, loss=loss).state, loss=loss).sigma_px
        for loss in ("none", "cauchy")
    }
    assert told["none"] > 5.0
    assert told["cauchy"] == pytest.approx(0.4, rel=0.25)


def test_what_is_free_is_named(rng):
    truth = bundle_world(rng, views=2, points=6)
    problem, state = bundle_problem(truth, refine=("fx", "fy", "cx", "cy", "k1", "k2"))
    with pytest.raises(UnderConstrainedError, match=r"leave \w+ of camera 0 free.*refine fewer intrinsics"):
        bundle_covariances(problem, state)
    apart = bundle_world(rng, views=4)
    # two cameras in one place see no depth
    poses = np.array(apart.cameras_T_world)
    poses[:, 4:] = 0.0
    problem, state = bundle_problem(apart.replaced(cameras_T_world=poses), refine=False)
    with pytest.raises(UnderConstrainedError, match=r"points are left free.*different places"):
        bundle_covariances(problem, state)
    line = bundle_world(rng, views=4)
    centres = np.c_[np.arange(4.0), np.zeros((4, 2))]
    poses = np.concatenate([np.tile([1.0, 0, 0, 0], (4, 1)), -centres], axis=1)
    problem, state = bundle_problem(line.replaced(cameras_T_world=poses), refine=False)
    with pytest.raises(UnderConstrainedError, match=r"'centres' does not hold.*one line; use 'points'"):
        bundle_covariances(problem, state, gauge="centres")
    with pytest.raises(ModelError, match="no gauge 'free'; known are 'first pose and scale'"):
        check_gauge("free")
