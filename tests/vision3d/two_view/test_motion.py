"""Essential matrices, their four motions and their chart: laws, and OpenCV and GTSAM for oracles."""

import cv2
import gtsam
import numpy as np
import pytest
from two_view_worlds import PINHOLE, random_motion, world

from sequential.errors import DataError, ShapeError
from sequential.manifold.quaternion import rotation_matrix
from vision3d.two_view import (
    decompose_essential,
    decompose_homography,
    essential_matrix,
    local_motion,
    plane_homography,
    recover_pose,
    retract_motion,
)
from vision3d.two_view.motion import direction_basis


def test_every_candidate_has_the_essential_matrix(rng):
    for _ in range(20):
        E = essential_matrix(random_motion(rng, 1.0))
        for one in decompose_essential(E):
            again = essential_matrix(one)
            assert min(abs(again - E).max(), abs(again + E).max()) < 1e-12


def test_chart_there_and_back(rng):
    for _ in range(50):
        b_T_a, step = random_motion(rng, 1.0), 0.5 * rng.standard_normal(5)
        np.testing.assert_allclose(local_motion(b_T_a, retract_motion(b_T_a, step)), step, atol=1e-12)


def test_chart_is_gtsams(rng):
    for _ in range(20):
        b_T_a, step = random_motion(rng, 1.0), 0.3 * rng.standard_normal(5)
        theirs = gtsam.EssentialMatrix(gtsam.Rot3(rotation_matrix(b_T_a[:4])), gtsam.Unit3(b_T_a[4:]))
        ours = retract_motion(b_T_a, step)
        moved = theirs.retract(step)
        np.testing.assert_allclose(moved.matrix(), essential_matrix(ours), atol=1e-12)
        np.testing.assert_allclose(theirs.direction().basis().T, direction_basis(b_T_a[4:]), atol=1e-12)


def test_recovered_pose_is_opencvs_and_the_truth(rng):
    for _ in range(10):
        it = world(rng, sigma_px=0.0, baseline=0.5)
        rays = PINHOLE.unproject(it.pixels_a), PINHOLE.unproject(it.pixels_b)
        E = essential_matrix(it.b_T_a)
        ours = recover_pose(-E, *rays)
        np.testing.assert_allclose(local_motion(it.b_T_a, ours.b_T_a), 0.0, atol=1e-9)
        assert ours.in_front.all()
        flat = [ray[:, :2] / ray[:, 2:] for ray in rays]
        _, R, t, _ = cv2.recoverPose(E, *flat, np.eye(3))
        np.testing.assert_allclose(rotation_matrix(ours.b_T_a[:4]), R, atol=1e-9)
        np.testing.assert_allclose(ours.b_T_a[4:], t.ravel(), atol=1e-9)


def test_homography_has_opencvs_decompositions(rng):
    for _ in range(20):
        it = world(rng, shape="plane", sigma_px=0.0, baseline=0.5)
        normal = np.array([0.25, -0.15, 1.0])
        H = plane_homography(rotation_matrix(it.b_T_a[:4]), 0.5 * it.b_T_a[4:], normal, 2.0)
        rays = PINHOLE.unproject(it.pixels_a), PINHOLE.unproject(it.pixels_b)
        ours = decompose_homography(-3.0 * H, *rays)
        assert 1 <= len(ours) <= 2
        _, Rs, ts, ns = cv2.decomposeHomographyMat(H, np.eye(3))
        for one in ours:
            match = [
                abs(R - one.R).max() + abs(t.ravel() - one.t).max() + abs(n.ravel() - one.normal).max()
                for R, t, n in zip(Rs, ts, ns, strict=True)
            ]
            assert min(match) < 1e-8
        truth = [abs(one.R - rotation_matrix(it.b_T_a[:4])).max() for one in ours]
        assert min(truth) < 1e-8


def test_a_rotation_has_one_reading(rng):
    R = rotation_matrix(random_motion(rng)[:4])
    rays = PINHOLE.unproject(rng.uniform(0, 480, (20, 2)))
    (only,) = decompose_homography(R, rays, rays @ R.T)
    assert not only.t.any()
    np.testing.assert_allclose(only.R, R, atol=1e-9)


def test_bad_input_is_told():
    with pytest.raises(DataError, match="same place"):
        essential_matrix(np.array([1.0, 0, 0, 0, 0, 0, 0]))
    with pytest.raises(ShapeError, match="essential matrix"):
        decompose_essential(np.eye(4))
