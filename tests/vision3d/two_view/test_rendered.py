"""Photographs of rendered scenes, features and all: the verdict, and the motion that is known."""

import numpy as np
import pytest
from scene_worlds import CAMERA

from vision3d.features import detect_features, match_features
from vision3d.render import SCENES, orbit_poses, render_journey, turning_poses
from vision3d.rigid import compose, inverse
from vision3d.two_view import estimate_two_view, local_motion
from vision3d.two_view.motion import motion, rotation_matrix

ORBIT = orbit_poses((0, 0.1, 1.6), 1.6, 2, arc_rad=0.2)


def photographed(rng, scene, poses):
    a, b = render_journey(CAMERA, poses, SCENES[scene](rng), rng=rng)
    first, second = detect_features(a.image), detect_features(b.image)
    pairs = match_features(first, second).pairs
    b_T_a = compose(poses[1], inverse(poses[0]))
    pixels = first.pixels[pairs[:, 0]], second.pixels[pairs[:, 1]]
    return estimate_two_view(CAMERA, CAMERA, *pixels, best_first=True, rng=rng), b_T_a


def off_deg(b_T_a, truth):
    return np.degrees(np.abs(local_motion(b_T_a, motion(rotation_matrix(truth[:4]), truth[4:]))).max())


def test_a_desk_is_a_scene_in_space(rng):
    view, truth = photographed(rng, "desk", ORBIT)
    assert view.verdict == "general"
    assert off_deg(view.b_T_a, truth) < 1.0
    assert view.sigma_px < 0.5


def test_a_wall_is_a_plane_whose_readings_hold_the_truth(rng):
    view, truth = photographed(rng, "wall", ORBIT)
    assert view.verdict == "planar"
    assert min(off_deg(one, truth) for one in (view.b_T_a, *view.rivals)) < 2.0


def test_a_camera_that_turns_is_told(rng):
    view, truth = photographed(rng, "desk", turning_poses(2, 0.15))
    assert view.verdict == "pure rotation"
    turned = rotation_matrix(view.b_T_a[:4]).T @ rotation_matrix(truth[:4])
    assert np.degrees(np.arccos((np.trace(turned) - 1.0) / 2.0)) < 0.1
    assert not view.b_T_a[4:].any()


def test_results_are_read_only(rng):
    view, _ = photographed(rng, "desk", ORBIT)
    with pytest.raises(ValueError, match="read-only"):
        view.b_T_a[0] = 2.0
