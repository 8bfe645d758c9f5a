"""Left-out pairs, a rig that moved, squares measured, and how sure rows and depths are: all against truth."""

from dataclasses import replace

import numpy as np
import pytest
from board_pair_worlds import stereo_world
from rig_worlds import FISHEYES, SIDE_BY_SIDE, VERTICAL, seen_by_both

from sequential.errors import ModelError
from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.rigid import compose, transform
from vision3d.stereo import StereoRig, rectify
from vision3d.stereo.calibration_error import with_calibration_error
from vision3d.stereo.depth import depth_of
from vision3d.stereo.deviations import deviations
from vision3d.stereo.fit import calibrate_stereo
from vision3d.stereo.held_out import leave_pairs_out
from vision3d.stereo.lens_pair import calibrate_with_best_lenses
from vision3d.stereo.rig_uncertainty import rig_jacobian, rig_uncertainty
from vision3d.stereo.row_errors import measured
from vision3d.stereo.view_pairs import pairs_of_views

WORLD = stereo_world(n=14)
KNOWN = (WORLD.rig.left, WORLD.rig.right)


@pytest.mark.parametrize("rig", [SIDE_BY_SIDE, VERTICAL], ids=["side", "vertical"])
def test_exact_corners_measure_the_board_exactly(rig, rng):
    world = stereo_world(rig, n=4)
    found = measured(rectify(rig), world.pairs(rng, (0.0, 0.0)))
    assert found.row_px < 1e-9
    assert found.count == 4 * (8 * 6 + 9 * 5)
    assert abs(found.side_m - 0.025) < 1e-9
    assert found.side_std_m < 1e-9


def test_corners_that_do_not_count_are_left_out(rng):
    pairs = list(WORLD.pairs(rng, (0.0, 0.0))[:2])
    pixels = pairs[0].left.pixels.copy()
    pixels[5] += 9.0
    pairs[0] = replace(pairs[0], left=replace(pairs[0].left, pixels=pixels))
    ones = np.ones(54)
    kept = ones.copy()
    kept[5] = 0.0
    assert measured(rectify(WORLD.rig), pairs).row_px > 0.5
    assert measured(rectify(WORLD.rig), pairs, [(kept, ones), (ones, ones)]).row_px < 1e-9


def test_left_out_pairs_are_predicted_worse_than_fitted_ones(rng):
    found = calibrate_stereo(WORLD.pairs(rng))
    held = leave_pairs_out(found)
    assert 1.0 < held.row_px / held.train_row_px < 1.4
    assert 1.0 < held.rms_px / held.train_rms_px < 1.3
    assert held.pair_rms.shape == (14, 2)
    assert len(held.rigs) == 14
    ratio = held.jackknife_std / found.std[:6]
    assert (ratio > 0.4).all()
    assert (ratio < 2.5).all()
    assert leave_pairs_out(calibrate_stereo(WORLD.pairs(rng)[:3])) is None


@pytest.mark.slow
def test_a_rig_that_stays_is_left_alone(seeds):
    """χ² of the pairs has its mean, and hardly any pair is called moved."""
    values, moved, steps = [], 0, 0
    for seed in seeds[::2]:
        pairs = WORLD.pairs(np.random.default_rng(seed))
        found = deviations(calibrate_stereo(pairs, cameras=KNOWN))
        values.append(found.chi2 * found.scatter**2)
        moved += len(found.moved)
        steps += found.step is not None
    # the pair itself is in the rig: a little less than six
    assert 4.8 < np.mean(values) < 6.4
    assert moved <= 1
    assert steps <= 1


def bent(pairs, chosen, step):
    """The pairs as a rig sees them that was bent by `step` in some of them."""
    rig = StereoRig(WORLD.rig.left, WORLD.rig.right, SE3().retract(WORLD.rig.right_T_left, np.array(step)))
    made = list(pairs)
    for v in chosen:
        exact = rig.right.project(transform(compose(rig.right_T_left, WORLD.poses[v]), WORLD.points))
        noise = pairs[v].right.pixels - WORLD.right[v]
        made[v] = replace(pairs[v], right=replace(pairs[v].right, pixels=exact + noise))
    return made


def test_a_pair_in_which_the_rig_was_bent_is_named(rng):
    pairs = bent(WORLD.pairs(rng), [6], (0.0, 0.004, 0.0, 0.0, 0.0, 0.0))
    found = deviations(calibrate_stereo(pairs, cameras=KNOWN))
    assert found.moved == (6,)
    assert found.step is None


def test_a_rig_that_was_knocked_is_told_from_when(rng):
    pairs = bent(WORLD.pairs(rng), range(9, 14), (0.001, -0.003, 0.0, 0.0, 0.0, 0.0))
    found = deviations(calibrate_stereo(pairs, cameras=KNOWN))
    assert (found.step.before, found.step.after) == (8, 9)
    assert 0.001 < found.step.rotation_rad < 0.006


@pytest.mark.parametrize("rig", [SIDE_BY_SIDE, VERTICAL, FISHEYES], ids=["side", "vertical", "fisheyes"])
def test_uncertainty_meets_differences(rig, rng):
    """Each number of the rig moved a little: rows and disparities move as the Jacobian says."""
    pair = rectify(rig)
    points, _, _ = seen_by_both(rig, rng, 30)
    J = rig_jacobian(pair, points)
    p = rig.left.count
    for k in range(J.shape[2]):
        step = np.zeros(J.shape[2])
        step[k] = 1e-6
        moved = []
        for s in (1.0, -1.0):
            d = s * step
            other = StereoRig(
                rig.left.with_parameters(rig.left.parameters + d[6 : 6 + p]),
                rig.right.with_parameters(rig.right.parameters + d[6 + p :]),
                SE3().retract(rig.right_T_left, d[:6]),
            )
            a, b = pair.points(*other.project(points))
            moved.append(np.stack([(b - a)[:, 1 - pair.axis], (a - b)[:, pair.axis]], axis=1))
        np.testing.assert_allclose(J[:, :, k], (moved[0] - moved[1]) / 2e-6, rtol=1e-4, atol=2e-3)


@pytest.mark.slow
def test_rows_and_depths_are_as_sure_as_they_say(seeds):
    """z scores of rows and depths of true points, over calibrations from noisy corners."""
    points, left, right = seen_by_both(WORLD.rig, np.random.default_rng(1), 60, 0.5, 2.0)
    inside = ((left > 80) & (left < (560, 400))).all(axis=1)
    points, left, right = points[inside], left[inside], right[inside]
    rows, depths = [], []
    for seed in seeds[::2]:
        found = calibrate_stereo(WORLD.pairs(np.random.default_rng(seed)))
        pair = rectify(found.rig)
        a, b = pair.points(left, right)
        depth = pair.focal_px * pair.baseline_m / ((a - b)[:, 0] + pair.doffs_px)
        sure = rig_uncertainty(pair, a, depth)
        rows.append((b - a)[:, 1] / sure.row_std_px)
        # the depth of the point where its left pixel puts it, not along another camera's axis
        true = points @ rectify(found.rig).left_R_rectified
        depths.append((depth - true[:, 2]) / sure.depth_std_m)
    assert 0.7 < np.sqrt(np.mean(np.square(rows))) < 1.3
    assert 0.7 < np.sqrt(np.mean(np.square(depths))) < 1.3


def test_a_rig_without_covariance_is_refused():
    with pytest.raises(ModelError, match="has no covariance"):
        rig_uncertainty(rectify(SIDE_BY_SIDE), np.zeros((1, 2)), 1.0)


def test_other_sizes_of_the_two_cameras(rng):
    small = Camera("pinhole", (300.0, 300.0, 160.0, 120.0), (), (320, 240))
    world = stereo_world(StereoRig(WORLD.rig.left, small, WORLD.rig.right_T_left), n=8)
    found = calibrate_stereo(world.pairs(rng), ("brown5", "pinhole"))
    assert found.rig.right.size == (320, 240)
    assert leave_pairs_out(found).row_px < 0.5
    assert len(pairs_of_views([None], [None])) == 0


def test_lenses_are_chosen_by_the_rows_of_left_out_pairs(rng):
    """A lens without the tangential terms that the right camera has is given up for that of the left one."""
    right = Camera("brown4", (536.0, 535.0, 327.0, 250.0), (-0.29, 0.06, 0.004, -0.003), (640, 480))
    pairs = stereo_world(StereoRig(WORLD.rig.left, right, WORLD.rig.right_T_left), n=10).pairs(rng)
    found, held = calibrate_with_best_lenses(pairs, ("brown5", "brown2"))
    assert (found.rig.left.lens, found.rig.right.lens) == ("brown5", "brown5")
    assert held.row_px < leave_pairs_out(calibrate_stereo(pairs, ("brown5", "brown2"))).row_px
    same, _ = calibrate_with_best_lenses(pairs[:3], ("brown2", "brown2"))
    assert same.rig.right.lens == "brown2"


def test_depth_is_as_sure_as_by_differences(rng):
    """About the axis equal to the map that moves the rig and looks how far the rays' midpoints go.

    Off it rays that pass each other by a row pull the midpoint, and not the disparity.
    """
    pair = rectify(calibrate_stereo(WORLD.pairs(rng)).rig)
    flat = np.full(pair.size[::-1], pair.focal_px * pair.baseline_m / 0.8)
    moved = with_calibration_error(depth_of(flat, pair.focal_px, pair.baseline_m), pair).systematic_m
    at = np.array([[213.0, 239.5], [319.5, 239.5], [426.0, 239.5], [319.5, 160.0]])  # nodes of the map
    x, y = at.round().astype(int).T
    np.testing.assert_allclose(rig_uncertainty(pair, at, 0.8).depth_std_m, moved[y, x], rtol=0.05)
