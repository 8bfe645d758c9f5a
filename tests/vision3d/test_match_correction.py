"""Corrected matches: two algorithms and OpenCV agree, and the rays through them meet at the optimal point."""

import cv2
import numpy as np
import pytest

from sequential.errors import ModelError, NotFiniteError, ShapeError
from sequential.manifold.quaternion import rotation_matrix
from vision3d.camera import Camera
from vision3d.match_correction import correct_matches
from vision3d.render import forward_poses, orbit_poses, sideways_poses
from vision3d.rigid import compose, inverse, transform
from vision3d.triangulate import triangulate

CAMERA = Camera("pinhole", (560, 565, 319.5, 239.5), (), (640, 480))
MOTIONS = {
    "orbit": orbit_poses((0, 0.1, 1.6), 1.6, 2, arc_rad=0.4),
    "sideways": sideways_poses(2, 0.2),
    "ahead": forward_poses(2, 0.4),
}


def fundamental(poses):
    b_T_a = compose(poses[1], inverse(poses[0]))
    x, y, z = b_T_a[4:]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.linalg.inv(CAMERA.matrix).T @ cross @ rotation_matrix(b_T_a[:4]) @ np.linalg.inv(CAMERA.matrix)


def matches(poses, rng, count, sigma):
    points = rng.uniform((-0.45, -0.3, 1.2), (0.45, 0.35, 2.2), (count, 3))
    exact = np.stack([CAMERA.project(transform(pose, points)) for pose in poses])
    return exact + rng.normal(0, sigma, exact.shape)


@pytest.mark.parametrize("motion", MOTIONS)
def test_both_methods_opencv_and_the_optimal_point_agree(motion, rng):
    poses = MOTIONS[motion]
    a, b = matches(poses, rng, 60, 1.0)
    quick = correct_matches(fundamental(poses), a, b)
    exact = correct_matches(fundamental(poses), a, b, method="hartley_sturm")
    theirs = cv2.correctMatches(fundamental(poses), a[None], b[None])
    found = triangulate(CAMERA, poses, np.stack([a, b]))
    for k in range(2):
        np.testing.assert_allclose(quick[k], exact[k], atol=1e-5)
        # OpenCV solves its polynomial to a hundredth of a pixel near an epipole
        np.testing.assert_allclose(exact[k], theirs[k][0], atol=0.02)
        np.testing.assert_allclose(CAMERA.project(transform(poses[k], found.points)), exact[k], atol=1e-5)


@pytest.mark.parametrize("method", ["lindstrom", "hartley_sturm"])
@pytest.mark.parametrize("sigma", [0.0, 0.5, 10.0])
def test_corrected_matches_fulfil_the_constraint(method, sigma, rng):
    matrix = fundamental(MOTIONS["orbit"])
    a, b = matches(MOTIONS["orbit"], rng, 40, sigma)
    new_a, new_b = correct_matches(matrix, a, b, method=method)
    lines = np.column_stack([new_a, np.ones(40)]) @ matrix.T
    away = np.sum(lines * np.column_stack([new_b, np.ones(40)]), axis=1) / np.hypot(*lines[:, :2].T)
    np.testing.assert_allclose(away, 0.0, atol=1e-8)
    if sigma == 0.0:
        np.testing.assert_allclose(np.stack([new_a, new_b]), np.stack([a, b]), atol=1e-6)


def test_no_pair_on_the_constraint_is_nearer(rng):
    """Against many random exact matches near the correction."""
    matrix = fundamental(MOTIONS["orbit"])
    a, b = matches(MOTIONS["orbit"], rng, 1, 3.0)
    new_a, new_b = correct_matches(matrix, a, b)
    cost = np.sum((new_a - a) ** 2) + np.sum((new_b - b) ** 2)
    tried_a = new_a + rng.normal(0, 0.5, (2000, 2))
    lines = np.column_stack([tried_a, np.ones(2000)]) @ matrix.T
    away = (lines[:, :2] @ b[0] + lines[:, 2]) / np.sum(lines[:, :2] ** 2, axis=1)
    tried_b = b - away[:, None] * lines[:, :2]
    costs = np.sum((tried_a - a) ** 2, axis=1) + np.sum((tried_b - b) ** 2, axis=1)
    assert costs.min() >= cost - 1e-9


def test_what_cannot_be_corrected_is_refused(rng):
    a, b = matches(MOTIONS["orbit"], rng, 3, 1.0)
    with pytest.raises(ModelError, match="no method"):
        correct_matches(np.eye(3), a, b, method="best")
    with pytest.raises(ShapeError, match="expected F"):
        correct_matches(np.eye(3), a, b[:2])
    with pytest.raises(NotFiniteError, match="leave out"):
        correct_matches(np.eye(3), a, np.full_like(b, np.nan))
