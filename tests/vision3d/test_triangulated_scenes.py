"""From photographs to points: what features, matching and triangulation together claim is true."""

import numpy as np
import pytest
from scene_worlds import CAMERA, measured_pair

from vision3d.features import detect_features, match_features
from vision3d.render import SCENES, render_journey, turning_poses
from vision3d.triangulate import triangulate


@pytest.mark.parametrize(("name", "band"), [("wall", (0.65, 1.2)), ("desk", (0.65, 1.3))])
def test_points_of_photographs_are_as_sure_as_they_say(name, band, rng):
    measured = measured_pair(name, rng)
    assert len(measured.nees) > 500
    assert band[0] < measured.nees.mean() < band[1]
    if not measured.edge.all():
        assert measured.nees[~measured.edge].mean() < 1.2
    assert 0.5 < measured.factor < 1.3, "declared sigmas are near the residuals"
    depth_sigma = np.sqrt(measured.found.covs[measured.found.ok][:, 2, 2])
    assert np.median(depth_sigma) < 0.01, "the error is not small because everything is called uncertain"


def test_a_camera_that_only_turns_tells_no_distance(rng):
    a, b = render_journey(CAMERA, turning_poses(2, 0.08), SCENES["desk"](rng), rng=rng)
    first, second = detect_features(a.image, "orb"), detect_features(b.image, "orb")
    matches = match_features(first, second)
    poses = np.array([a.camera_T_world, b.camera_T_world])
    pixels, sigmas = np.stack(matches.points(first, second)), np.stack(matches.sigma_px(first, second))
    found = triangulate(CAMERA, poses, pixels, sigma_px=sigmas)
    assert len(matches) > 100
    assert found.at_infinity.all()
    assert not found.ok.any()
