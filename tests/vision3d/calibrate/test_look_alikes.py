"""Frames of a board that did not move are one piece of evidence, not many."""

import numpy as np
from calibration_worlds import SIZE, world

from vision3d.calibrate import calibrate, leave_one_out
from vision3d.calibrate.look_alikes import folds_of, groups_of
from vision3d.views import View


def repeated(scene, times, rng, common_px=0.2, own_px=0.02):
    """Every view several times: an error in common, and a little of its own."""
    views = []
    for v, pixels in enumerate(scene.exact):
        common = pixels + common_px * rng.standard_normal(pixels.shape)
        for i in range(times):
            own = common + own_px * rng.standard_normal(pixels.shape)
            views.append(View(f"{v}-{i}", SIZE, scene.points, own, np.arange(54), 0.2))
    return views


def test_views_alike_are_of_one_group():
    scene, rng = world(n=6, seed=41), np.random.default_rng(0)
    views = repeated(scene, 3, rng)
    shuffled = rng.permutation(18)
    groups = groups_of([views[i] for i in shuffled])
    of = {i // 3: groups[k] for k, i in enumerate(shuffled)}
    assert len(set(of.values())) == 6
    assert all(groups[k] == of[i // 3] for k, i in enumerate(shuffled))


def test_partly_seen_views_are_compared_by_what_they_share():
    scene, rng = world(n=2, seed=42), np.random.default_rng(1)
    left, right = np.arange(30), np.arange(20, 54)
    views = [view.subset(part) for view in repeated(scene, 1, rng) for part in (left, right)]
    assert groups_of(views).tolist() == [0, 0, 1, 1]
    apart = [views[0].subset(np.arange(10)), views[1].subset(np.arange(20, 34))]
    assert groups_of(apart).tolist() == [0, 1]


def test_folds_leave_a_group_out_as_a_whole():
    views = repeated(world(n=7, seed=43), 2, np.random.default_rng(2))
    assert folds_of(views) == [[2 * g, 2 * g + 1] for g in range(7)]
    assert len(folds_of(views, 3)) == 3
    assert folds_of(views[:4]) == [[0], [1], [2], [3]]


def test_repeating_views_does_not_make_a_calibration_surer():
    z, told, once = [], [], []
    for seed in range(6):
        scene, rng = world(n=10, seed=300 + seed), np.random.default_rng(seed)
        views = repeated(scene, 6, rng)
        many, few = calibrate(views), calibrate(views[::6])
        z.append((many.camera.parameters - scene.camera.parameters) / many.std)
        told.append(many.std[0])
        once.append(few.std[0])
    assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.4
    assert 0.6 < np.median(told) / np.median(once) < 1.5
    assert any("in only 10 places" in finding for finding in many.report.findings)
    left = leave_one_out(many)
    assert len(left.parameters) == 10
    assert len(left.view_rms) == 60
