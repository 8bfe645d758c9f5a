"""Refined matches of rendered scenes with depth, against where the points really are."""

import numpy as np
import pytest

from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.features import detect_features, match_features, refine_matches
from vision3d.render import corridor, desk, render_scene, transfer, wall

CAMERA = Camera("brown4", (380.0, 380.0, 199.5, 149.5), (-0.1, 0.02, 0.0, 0.0), (400, 300))
STEP = np.array([0.02, -0.05, 0.01, -0.12, 0.02, 0.03])


@pytest.mark.parametrize("room", [desk, corridor, wall])
def test_refinement_is_sharper_than_detection_and_says_so(room):
    rng = np.random.default_rng(6)
    scene, first = room(rng), SE3().identity()
    views = [
        render_scene(CAMERA, pose, scene, rng=rng, supersample=3)
        for pose in (first, SE3().retract(first, STEP))
    ]
    a, b = (detect_features(view.image, count=800) for view in views)
    matches = match_features(a, b)
    first_end, second_end = matches.points(a, b)
    truth = transfer(*views, scene, first_end)
    found, cov, ok = refine_matches(
        views[0].image, views[1].image, first_end, second_end, warps=matches.warps(a, b)
    )
    right = ok & (np.hypot(*(second_end - truth).T) < 3.0)
    before, after = (second_end - truth)[right], (found - truth)[right]
    nees = np.einsum("ni,nij,nj->n", after, np.linalg.inv(cov[right]), after) / 2
    assert right.sum() > 100
    assert np.median(np.abs(after)) < 0.5 * np.median(np.abs(before))
    # edges of near things slide over what is behind them: a few are off whatever the window
    assert (nees > 9).mean() < 0.04
    assert 0.7 < nees[nees < 9].mean() < 1.3
