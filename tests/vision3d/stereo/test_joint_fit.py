"""The joint adjustment meets differences, finds the truth, is as sure as it says, and agrees with OpenCV."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from board_pair_worlds import stereo_world
from rig_worlds import FISHEYES, SIDE_BY_SIDE, VERTICAL, rig_of

from sequential.errors import DataError, ModelError
from sequential.manifold import SE3
from vision3d.calibrate import calibrate
from vision3d.camera import Camera
from vision3d.stereo import StereoRig
from vision3d.stereo.fit import calibrate_stereo
from vision3d.stereo.joint_problem import JointProblem, JointUnknowns, linearize_jointly
from vision3d.stereo.view_pairs import ViewPair

WORLD = stereo_world()


def unknowns_of(world, warp=(2e-4, -3e-4)):
    rig = world.rig
    return JointUnknowns(
        (rig.left.lens, rig.right.lens), rig.right_T_left, rig.left.parameters, rig.right.parameters,
        np.array(warp), world.poses,
    )  # fmt: skip


def some_pairs(rng):
    """Whole pairs with some corners, one pair that the left camera saw alone, one the right camera."""
    few = np.arange(0, 54, 7)
    pairs = [ViewPair(p.name, p.left.subset(few), p.right.subset(few[1:])) for p in WORLD.pairs(rng)[:4]]
    pairs[1] = replace(pairs[1], right=None)
    pairs[2] = replace(pairs[2], left=None)
    return pairs


def test_normal_equations_meet_differences(rng):
    problem = JointProblem.of(some_pairs(rng))
    at = replace(unknowns_of(WORLD), poses=WORLD.poses[:4])
    weights = rng.uniform(0.5, 4.0, len(problem.sigma_px))
    blocks, V = linearize_jointly(problem, at, weights), 4
    q, columns = at.count, []
    for k in range(q + 6 * V):
        step = np.zeros(q + 6 * V)
        step[k] = 1e-3 if k >= 6 and k < q - 2 and (k - 6) % 9 < 4 else 1e-6
        ahead, behind = (
            linearize_jointly(
                problem, at.moved(s * step[:q], s * step[q:].reshape(V, 6)), np.ones_like(weights)
            ).residuals
            for s in (1.0, -1.0)
        )
        columns.append((behind - ahead).ravel() / (2.0 * step[k]))
    J, w = np.stack(columns, axis=1), np.repeat(weights, 2)
    normal, score = J.T @ (w[:, None] * J), J.T @ (w * blocks.residuals.ravel())
    size = 1.0 / np.sqrt(np.diag(normal)[:q] + 1e-300)

    def near(ours, theirs, left, right):
        np.testing.assert_allclose(ours * left[:, None] * right, theirs * left[:, None] * right, atol=3e-6)

    near(blocks.U.sum(axis=0), normal[:q, :q], size, size)
    np.testing.assert_allclose(blocks.a.sum(axis=0) * size, score[:q] * size, rtol=1e-5, atol=1e-3)
    for v in range(V):
        rows = slice(q + 6 * v, q + 6 * v + 6)
        own = 1.0 / np.sqrt(np.diag(normal)[rows])
        near(blocks.T[v], normal[rows, rows], own, own)
        near(blocks.W[v], normal[:q, rows], size, own)
        np.testing.assert_allclose(blocks.b[v] * own, score[rows] * own, rtol=1e-5, atol=1e-3)


@pytest.mark.parametrize("rig", [SIDE_BY_SIDE, VERTICAL, FISHEYES], ids=["side", "vertical", "fisheyes"])
def test_exact_corners_give_the_truth(rig, rng):
    world = stereo_world(rig, n=8, seed=3)
    found = calibrate_stereo(world.pairs(rng, (1e-7, 1e-7), (0.1, 0.1)), (rig.left.lens, rig.right.lens))
    assert found.rms_px < 1e-6
    np.testing.assert_allclose(SE3().local(rig.right_T_left, found.rig.right_T_left), 0.0, atol=1e-7)
    np.testing.assert_allclose(found.rig.left.parameters, rig.left.parameters, atol=2e-4)
    np.testing.assert_allclose(found.rig.right.parameters, rig.right.parameters, atol=2e-4)
    np.testing.assert_allclose(SE3().local(world.poses, found.poses), 0.0, atol=1e-6)


@pytest.mark.slow
def test_the_covariance_is_honest(seeds):
    """NEES of the pose and of all of the rig, over its degrees of freedom."""
    pose, whole, scale = [], [], []
    for seed in seeds[::2]:
        rng = np.random.default_rng(seed)
        found = calibrate_stereo(WORLD.pairs(rng, (0.1, 0.3), (0.1, 0.1)))
        eta = SE3().local(found.rig.right_T_left, WORLD.rig.right_T_left)
        error = np.concatenate(
            [
                eta,
                WORLD.rig.left.parameters - found.rig.left.parameters,
                WORLD.rig.right.parameters - found.rig.right.parameters,
            ]
        )
        pose.append(eta @ np.linalg.solve(found.rig.cov, eta) / 6.0)
        whole.append(error @ np.linalg.solve(found.rig.joint_cov, error) / len(error))
        scale.append(found.sigma_px)
    spread = np.sqrt(2.0 / (6.0 * len(pose)))
    assert abs(np.mean(pose) - 1.0) < 4.0 * spread
    assert abs(np.mean(whole) - 1.0) < 0.25
    np.testing.assert_allclose(np.mean(scale, axis=0), (0.1, 0.3), rtol=0.03)


def test_it_agrees_with_opencv(rng):
    """With one sigma for all corners, nothing left out and the same lens it is the same minimum."""
    pairs = WORLD.pairs(rng, (0.1, 0.1))
    found = calibrate_stereo(pairs, "brown5", robust=False)
    flags = cv2.CALIB_USE_INTRINSIC_GUESS
    objects = [np.float32(WORLD.points) for _ in pairs]
    a, b = (
        [np.float32(getattr(p, side).pixels).reshape(-1, 1, 2) for p in pairs] for side in ("left", "right")
    )
    K1, d1, K2, d2 = (
        value.copy() for one in (WORLD.rig.left, WORLD.rig.right) for value in (one.matrix, one.distortion)
    )
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 300, 1e-12)
    rms, K1, d1, K2, d2, R, T, *_ = cv2.stereoCalibrate(
        objects, a, b, K1, d1, K2, d2, (640, 480), flags=flags, criteria=criteria
    )
    assert abs(found.rms_px - rms) < 1e-3 * rms
    theirs = StereoRig.from_opencv(Camera.from_matrix(K1, d1), Camera.from_matrix(K2, d2), R, T)
    apart = SE3().local(found.rig.right_T_left, theirs.right_T_left)
    # OpenCV 4 stops a little early, and our cameras have a noise of their own each
    assert (np.abs(apart) < 0.5 * np.sqrt(np.diag(found.rig.cov))).all()
    assert (np.abs(found.rig.left.parameters - theirs.left.parameters) < 0.5 * found.camera_stds[0]).all()


def test_known_cameras_are_held(rng):
    pairs = WORLD.pairs(rng)
    found = calibrate_stereo(pairs[:1], cameras=(WORLD.rig.left, WORLD.rig.right))
    assert found.rig.left == WORLD.rig.left
    assert not found.camera_stds[0].any()
    error = SE3().local(found.rig.right_T_left, WORLD.rig.right_T_left)
    assert error @ np.linalg.solve(found.rig.cov, error) < 30.0
    one = calibrate_stereo(pairs, cameras=(WORLD.rig.left, None))
    assert one.rig.left == WORLD.rig.left
    assert one.camera_stds[1].all()
    assert one.alone[0] is None
    assert one.rig.cov[3, 3] < found.rig.cov[3, 3]


def test_pictures_of_one_camera_help(rng):
    """A board that only the left camera saw tells more of that camera."""
    pairs = WORLD.pairs(rng)
    few = calibrate_stereo(pairs[:5])
    more = calibrate_stereo([*pairs[:5], *(replace(pair, right=None) for pair in pairs[5:])])
    assert (more.camera_stds[0] < few.camera_stds[0]).all()
    assert len(more.whole) == 5


def test_a_pair_of_another_moment_is_found_and_parted(rng):
    pairs = list(WORLD.pairs(rng))
    pairs[3], pairs[7] = replace(pairs[3], right=pairs[7].right), replace(pairs[7], right=pairs[3].right)
    found = calibrate_stereo(pairs)
    assert [one.pair for one in found.disagreeing] == [3, 7]
    assert len(found.whole) == 10
    error = SE3().local(found.rig.right_T_left, WORLD.rig.right_T_left)
    assert error @ np.linalg.solve(found.rig.cov, error) < 30.0


def test_an_exchanged_pair_is_called_so(rng):
    pairs = list(stereo_world(rig_of(right=SIDE_BY_SIDE.left), n=10).pairs(rng))
    pairs[4] = replace(pairs[4], left=pairs[4].right, right=pairs[4].left)
    found = calibrate_stereo(pairs, cameras=(SIDE_BY_SIDE.left, SIDE_BY_SIDE.left))
    assert [(one.pair, one.exchanged) for one in found.disagreeing] == [(4, True)]
    assert "exchanged" in found.report.findings[0]


def test_swapped_sides_are_said(rng):
    pairs = [replace(pair, left=pair.right, right=pair.left) for pair in WORLD.pairs(rng)]
    found = calibrate_stereo(pairs)
    assert found.rig.is_swapped
    assert any("stands on the left of the one called left" in text for text in found.report.findings)


@pytest.mark.parametrize("turn", ["half", "quarter"])
def test_boards_counted_from_another_end_are_mended(turn, rng):
    world = stereo_world(n=10, columns=6, rows=6)
    pairs = list(world.pairs(rng))
    grid = np.arange(36).reshape(6, 6)
    order = (grid[::-1, ::-1] if turn == "half" else np.rot90(grid)).ravel()
    for v in (2, 5):
        pairs[v] = replace(pairs[v], right=replace(pairs[v].right, pixels=pairs[v].right.pixels[order]))
    found = calibrate_stereo(pairs)
    assert found.renumbered == (pairs[2].name, pairs[5].name)
    assert found.rms_px < 0.2
    assert not found.disagreeing


def test_wild_corners_are_left_out(rng):
    pairs = list(WORLD.pairs(rng))
    pixels = pairs[2].right.pixels.copy()
    pixels[17] += (4.0, -3.0)
    pairs[2] = replace(pairs[2], right=replace(pairs[2].right, pixels=pixels))
    found = calibrate_stereo(pairs)
    assert (1, 2, 17) in found.outliers
    assert len(found.outliers) < 4


def test_refusals(rng):
    pairs = WORLD.pairs(rng)
    with pytest.raises(DataError, match="at least 3 pairs whose images both show the board, got 2 of 2"):
        calibrate_stereo(pairs[:2])
    with pytest.raises(ModelError, match="no lens 'wide'"):
        calibrate_stereo(pairs, "wide")
    shifted = [replace(pair, right=pairs[(k + 1) % 12].right) for k, pair in enumerate(pairs)]
    with pytest.raises(DataError, match="the 12 pairs do not belong together"):
        calibrate_stereo(shifted, cameras=(WORLD.rig.left, WORLD.rig.right))
    small = Camera("pinhole", (300.0, 300.0, 160.0, 120.0), (), (320, 240))
    with pytest.raises(DataError, match="calibrated at 320x240"):
        calibrate_stereo(pairs, cameras=(small, None))
    assert calibrate([pair.left for pair in pairs]).rms_px < 0.2
