"""The choice of the lens and of the board's shape, on corners whose truth is known."""

import numpy as np
import pytest
from camera_photos import BOARD, TRUTH

from factorlab.camera import CameraSettings
from factorlab.camera.fitting import fitted
from sequential.manifold.quaternion import rotate
from vision3d.render import board_poses
from vision3d.views import View

SIGMA = 0.05


def seen(rng, rise_m, count=10):
    """Views of a board whose middle row stands `rise_m` behind its first and last, taken for flat."""
    y = BOARD.points[:, 1]
    points = BOARD.points.copy()
    points[:, 2] += rise_m * (1.0 - ((y - y.mean()) / np.ptp(y) * 2.0) ** 2)
    views = []
    for k, pose in enumerate(board_poses(TRUTH, BOARD, count, rng)):
        exact = TRUTH.project(rotate(pose[:4], points) + pose[4:])
        pixels = exact + SIGMA * rng.standard_normal(exact.shape)
        views.append(View(f"view{k}", TRUTH.size, BOARD.points, pixels, np.arange(BOARD.count), SIGMA))
    return tuple(views)


def told(views, **settings):
    """What is fitted, and what is said on the way."""
    said = []
    return fitted(views, CameraSettings(BOARD, **settings), said.append), said


@pytest.mark.parametrize("rise_m", [-0.0008, 0.0008])
def test_a_bend_is_found_and_taken_into_account(rng, rise_m):
    views = seen(rng, rise_m)
    found, _ = told(views, lens="brown5")
    fit = found.calibration
    assert fit.warp[1] == pytest.approx(rise_m, abs=5.0 * fit.warp_std[1])
    assert abs(fit.warp[0]) < 5.0 * fit.warp_std[0]
    flat, _ = told(views, lens="brown5", shape="flat")
    assert flat.calibration.rms_px > 1.1 * fit.rms_px
    assert found.flat_px > fit.rms_px
    assert (np.abs(fit.camera.intrinsics - TRUTH.intrinsics) < 5.0 * fit.std[:4]).all()


def test_a_flat_board_stays_flat(rng):
    found, _ = told(seen(rng, 0.0), lens="brown5")
    assert not found.calibration.warp.any()
    assert not found.calibration.warp_std.any()


def test_a_bend_can_be_asked_for(rng):
    found, _ = told(seen(rng, 0.0, 8), lens="brown2", shape="bent")
    fit = found.calibration
    assert (fit.warp_std > 0.0).all()
    assert (np.abs(fit.warp) < 5.0 * fit.warp_std).all()
    assert found.flat_px is None


def test_a_lens_is_chosen_where_none_is_asked_for(rng):
    views = seen(rng, 0.0)
    chosen, _ = told(views)
    assert chosen.choice.chosen in {"brown4", "brown5", "rational8"}
    asked, said = told(views, lens="brown4")
    assert asked.choice is None
    assert asked.calibration.camera.lens == "brown4"
    assert not said
    few, said = told(views[:3])
    assert few.calibration.camera.lens == "brown2"
    assert "too few to choose" in said[0]
