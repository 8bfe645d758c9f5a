"""From a rendered picture to a pose whose covariance is honest: renderer, detector and pose together."""

import numpy as np
import pytest
from lens_family import camera_of

from sequential.manifold import SE3
from vision3d.boards import CharucoBoard, Checkerboard
from vision3d.calibrate.detection.detect import detect_view
from vision3d.pose import estimate_pose
from vision3d.render import render_set
from vision3d.views import View

BOARDS = {
    "checkerboard": Checkerboard(9, 6, 0.025),
    "charuco": CharucoBoard(8, 6, 0.03, 0.022, "4x4_50"),
}
PICTURES = 12


@pytest.mark.slow
@pytest.mark.parametrize("name", BOARDS)
@pytest.mark.parametrize("lens", ["brown5", "fisheye4"])
def test_the_covariance_holds_for_corners_that_were_detected(name, lens, rng):
    camera, board = camera_of(lens), BOARDS[name]
    rendered = render_set(camera, board, PICTURES, rng)
    nees, misfit = [], []
    for image, truth in zip(rendered.images, rendered.poses, strict=True):
        view = detect_view("rendered", image, board)[0]
        assert isinstance(view, View)
        estimate = estimate_pose(camera, view.points, view.pixels, view.sigma_px)
        error = SE3().local(estimate.camera_T_object, truth)
        nees.append(error @ np.linalg.solve(estimate.cov, error))
        misfit.append(estimate.chi2 / estimate.dof)
        assert np.linalg.norm(error[3:]) < 1e-3 * np.linalg.norm(truth[4:])
    # a mean of chi-squares with 6 N degrees of freedom, and sigmas that are themselves estimates
    spread = np.sqrt(2.0 / (6 * PICTURES))
    assert np.mean(nees) / 6.0 == pytest.approx(1.0, abs=4.0 * spread + 0.1)
    assert 0.6 < np.mean(misfit) < 1.4
