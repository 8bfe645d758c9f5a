"""Refinements beside SciPy, derivatives beside differences, covariances beside what estimates do."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from two_view_worlds import PINHOLE, distorted, random_motion, world

from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Camera
from vision3d.ray_pairs import pairs_of_points, pairs_of_rays, ray_pairs
from vision3d.two_view import essential_matrix, estimate_two_view, local_motion, retract_motion
from vision3d.two_view.noise import fit_noise
from vision3d.two_view.refinement import (
    homography_distances,
    refine_motion,
    refine_plane,
    refine_rotation,
    sampson_distances,
)

FISHEYE = Camera("fisheye4", (250.0, 251.0, 320.0, 240.0), (0.02, -0.01, 0.003, 0.0), (640, 480))


def rows_of(it, sigma_px=1.0):
    return ray_pairs(it.camera, it.camera, it.pixels_a, it.pixels_b, sigma_px)[0]


def test_sampson_distance_is_to_first_order_that_of_the_fundamental_matrix(rng):
    it = world(rng)
    K = np.linalg.inv(PINHOLE.matrix)
    F = K.T @ essential_matrix(it.b_T_a) @ K
    a, b = (np.column_stack([pixels, np.ones(len(pixels))]) for pixels in (it.pixels_a, it.pixels_b))
    la, lb = b @ F, a @ F.T
    plain = np.sum(b * lb, axis=1) ** 2 / (la[:, 0] ** 2 + la[:, 1] ** 2 + lb[:, 0] ** 2 + lb[:, 1] ** 2)
    np.testing.assert_allclose(sampson_distances(rows_of(it), it.b_T_a), plain, rtol=1e-3)


@pytest.mark.parametrize("camera", [PINHOLE, distorted, FISHEYE], ids=lambda camera: camera.lens)
def test_sampson_distance_is_one_sigma_of_noise_through_any_lens(rng, camera):
    it = world(rng, count=4000, sigma_px=0.2, camera=camera)
    assert np.mean(sampson_distances(rows_of(it, 0.2), it.b_T_a)) == pytest.approx(1.0, abs=0.1)


def test_refined_motion_is_scipys(rng):
    it = world(rng, count=60, baseline=0.5)
    rows = rows_of(it)

    def residuals(step):
        moved = retract_motion(it.b_T_a, step)
        E = essential_matrix(moved)
        sign = np.sign(np.sum((rows[:, :3] @ E.T) * rows[:, 3:6], axis=1))
        return sign * np.sqrt(sampson_distances(rows, moved))

    theirs = least_squares(residuals, np.zeros(5), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    ours = refine_motion(rows, it.b_T_a)
    assert ours.cost == pytest.approx(2.0 * theirs.cost, rel=1e-9)
    assert np.linalg.norm(local_motion(ours.parameters, retract_motion(it.b_T_a, theirs.x))) < 1e-5
    # the same normal equations, so analytic derivatives equal differences
    there = refine_motion(rows, retract_motion(it.b_T_a, theirs.x), iterations=0).information
    J = differences(lambda step: residuals_at(rows, ours.parameters, step))
    np.testing.assert_allclose(there, J.T @ J, rtol=1e-3, atol=1e-5 * np.trace(there))


def residuals_at(rows, b_T_a, step):
    moved = retract_motion(b_T_a, step)
    E = essential_matrix(moved)
    sign = np.sign(np.sum((rows[:, :3] @ E.T) * rows[:, 3:6], axis=1))
    return sign * np.sqrt(sampson_distances(rows, moved))


def differences(function, step=1e-6):
    return np.column_stack([(function(move) - function(-move)) / (2.0 * step) for move in step * np.eye(5)])


@pytest.mark.parametrize(("loss", "scale"), [("huber", 1.0), ("cauchy", 0.5), ("truncated", 2.0)])
def test_every_loss_comes_down_and_keeps_wrong_pairs_off(rng, loss, scale):
    it = world(rng, wrong=0.1, baseline=0.5)
    rows = rows_of(it)
    start = retract_motion(it.b_T_a, 0.01 * rng.standard_normal(5))
    refined = refine_motion(rows, start, loss=loss, scale=scale)
    assert refined.cost < refine_motion(rows, start, loss=loss, scale=scale, iterations=0).cost
    assert np.linalg.norm(local_motion(refined.parameters, it.b_T_a)) < 0.05


def test_plane_and_rotation_find_back(rng):
    it = world(rng, shape="plane", sigma_px=0.0, baseline=0.5)
    R, n = rotation_matrix(it.b_T_a[:4]), np.array([0.25, -0.15, 1.0]) / 2.0 * 0.5
    near = retract_motion(it.b_T_a, 0.01 * rng.standard_normal(5))
    found = refine_plane(rows_of(it), rotation_matrix(near[:4]), near[4:], 1.02 * n)
    np.testing.assert_allclose(found.parameters, [*R.ravel(), *it.b_T_a[4:], *n], atol=1e-6)
    turn = world(rng, shape="turn", sigma_px=0.0)
    start = rotation_matrix(retract_motion(np.r_[turn.b_T_a[:4], 0, 0, 1], 0.02 * np.ones(5))[:4])
    found = refine_rotation(rows_of(turn), start)
    np.testing.assert_allclose(found.parameters.reshape(3, 3), rotation_matrix(turn.b_T_a[:4]), atol=1e-8)
    assert homography_distances(rows_of(turn), found.parameters).max() < 1e-10


def test_rays_and_points_say_the_same(rng):
    b_T_a = random_motion(rng)
    a = np.column_stack([0.02 * rng.standard_normal((50, 2)), np.ones(50)])
    b = np.column_stack([0.02 * rng.standard_normal((50, 2)), np.ones(50)])
    by_rays = sampson_distances(pairs_of_rays(a, b), b_T_a)
    np.testing.assert_allclose(
        by_rays, sampson_distances(pairs_of_points(a[:, :2], b[:, :2]), b_T_a), rtol=5e-3
    )


def test_noise_is_told_from_its_tails(rng):
    gaussian = fit_noise((0.3 * rng.standard_normal(3000)) ** 2)
    assert gaussian.freedom >= 10.0
    assert gaussian.scale == pytest.approx(0.3, rel=0.06)
    heavy = fit_noise((0.3 * rng.standard_t(3.0, 3000)) ** 2)
    assert 2.0 <= heavy.freedom <= 4.0
    assert heavy.scale == pytest.approx(0.3, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "lens", "known"),
    [
        ("space", PINHOLE, False),
        ("space", distorted, True),
        ("plane", PINHOLE, False),
        ("turn", PINHOLE, False),
    ],
)
def test_covariance_is_honest(seeds, shape, lens, known):
    nees = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        it = world(rng, shape=shape, wrong=0.2, camera=lens, baseline=0.4, sigma_px=0.2)
        view = estimate_two_view(lens, lens, it.pixels_a, it.pixels_b, sigma_px=0.2 if known else None)
        d = 3 if shape == "turn" else 5
        readings = [view.b_T_a, *view.rivals] if shape != "turn" else [np.r_[view.b_T_a[:4], 0, 0, 1]]
        truth = it.b_T_a if shape != "turn" else np.r_[it.b_T_a[:4], 0, 0, 1]
        errors = [local_motion(one, truth)[:d] for one in readings]
        if shape == "plane" and np.argmin([np.linalg.norm(error) for error in errors]) > 0:
            continue  # the other reading was put first; the covariance is of the first
        nees.append(errors[0] @ np.linalg.solve(view.cov[:d, :d], errors[0]) / d)
    # 20 seeds: a mean of chi² of d over d has the standard deviation sqrt(2 / (d n))
    wide = 4.0 * np.sqrt(2.0 / (5.0 * len(nees)))
    assert 0.9 - wide < np.mean(nees) < 1.1 + wide
