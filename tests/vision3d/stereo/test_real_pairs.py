"""The thirteen pairs of OpenCV's samples: figures that no change may worsen unseen."""

import numpy as np
import pytest

from vision3d.boards import Checkerboard
from vision3d.calibrate.detection import detect_views
from vision3d.images import read_images
from vision3d.stereo import rectify
from vision3d.stereo.deviations import deviations
from vision3d.stereo.fit import calibrate_stereo
from vision3d.stereo.held_out import leave_pairs_out
from vision3d.stereo.row_errors import measured
from vision3d.stereo.view_pairs import pairs_of_views


@pytest.fixture(scope="module")
def pairs(data_dir):
    """Views of the board in left01 … right14."""
    folder = data_dir / "vision" / "opencv"
    sides = [
        detect_views(read_images(str(folder / f"{side}.jpg")), Checkerboard(9, 6, 0.025)).views
        for side in ("left??", "right??")
    ]
    return pairs_of_views(*sides)


@pytest.mark.parametrize("lens", ["brown4", "brown5"])
def test_rows_residual_and_squares(pairs, lens):
    """OpenCV on corners of its own: 0.2151 px, 83.18 mm, rows 0.165 px apart, squares 25.009 ± 0.204 mm."""
    found = calibrate_stereo(pairs, lens)
    sizes = measured(rectify(found.rig), found.pairs)
    assert len(found.whole) == 13
    assert found.rms_all_px < 0.18
    assert sizes.row_px < 0.11
    assert abs(found.rig.baseline_m - 0.0832) < 2e-4
    assert abs(sizes.side_m - 0.025) < 1e-5
    assert sizes.side_std_m < 1.2e-4


def test_left_out_pairs_keep_their_rows(pairs):
    found = calibrate_stereo(pairs, "brown4")
    held = leave_pairs_out(found)
    assert held.row_px < 0.12
    assert held.row_px < 1.15 * held.train_row_px
    # the board of left08 and right08 was not at rest
    assert [found.pairs[v].name for v in deviations(found).moved] == ["left08.jpg + right08.jpg"]


def test_cameras_alone_and_held_are_hardly_worse(pairs):
    joint = calibrate_stereo(pairs, "brown4")
    held = calibrate_stereo(pairs, "brown4", cameras=tuple(one.camera for one in joint.alone))
    assert joint.rms_px <= held.rms_px < 1.1 * joint.rms_px
    assert np.abs(held.rig.T - joint.rig.T).max() < 1e-3
