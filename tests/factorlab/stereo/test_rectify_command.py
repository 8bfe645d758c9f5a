"""`factorlab stereo rectify`: rows agree in what it writes, and a rig that does not fit is told."""

import json

import cv2
import numpy as np
import pytest
from rig_worlds import rig_of
from stereo_photos import LEFT, RIGHT, TRUTH, answer, rectify, verdict

from vision3d.render import desk, render_stereo
from vision3d.stereo import read_rig, write_rig
from vision3d.stereo import rectify as rectification_of
from vision3d.stereo.rectify_files import anaglyph, side_by_side
from vision3d.stereo.row_check import check_rows, row_check_of


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A rendered pair of a desk, as files, in a folder with the rig that took it."""
    folder = tmp_path_factory.mktemp("scene")
    rng = np.random.default_rng(3)
    view = render_stereo(LEFT, RIGHT, TRUTH.right_T_left, desk(rng), rng=rng)
    left, right = (np.asarray(one) for one in _images(view))
    cv2.imwrite(str(folder / "left.png"), left)
    cv2.imwrite(str(folder / "right.png"), right)
    write_rig(folder / "rig.json", TRUTH)
    return folder


def _images(view):
    return view.left.image, view.right.image


def test_rows_of_a_scene_agree(scene, tmp_path):
    done = rectify(
        scene / "left.png",
        scene / "right.png",
        "--calib",
        scene / "rig.json",
        "-o",
        tmp_path / "out",
        "--json",
    )
    found = answer(done)
    rows = verdict(found, "rows of features apart")
    assert rows["verdict"] == "PASS"
    assert rows["value"] < 0.6
    assert abs(found["pairs"][0]["rows"]["offset_px"]) < 0.15
    for part in ("left", "right", "rows"):
        image = cv2.imread(str(tmp_path / "out" / part / "left.png"))
        assert image.shape == (480, 1280 if part == "rows" else 640, 3)
    rectified = read_rig(tmp_path / "out")
    assert rectified.left.lens == "pinhole"
    assert abs(rectified.baseline_m - TRUTH.baseline_m) < 1e-9
    assert read_rig(tmp_path / "out" / "calib.txt").left == rectified.left
    listed = json.loads((tmp_path / "out" / "report.json").read_text())["files"]
    assert {"left/left.png", "right/left.png", "rows/left.png", "calib.txt"} <= set(listed)


def test_a_rig_that_was_bent_is_told(scene, tmp_path):
    bent = write_rig(tmp_path / "bent.json", rig_of((0.018, 0.02, -0.006), TRUTH.T, LEFT, RIGHT))
    done = rectify(
        scene / "left.png", scene / "right.png", "--calib", bent, "-o", tmp_path / "out", "--check"
    )
    assert done.exit_code == 3
    assert "the rig was bent" in done.stdout


def test_exchanged_pictures_are_told(scene, tmp_path):
    straight = rectification_of(TRUTH)
    images = [cv2.imread(str(scene / name), cv2.IMREAD_GRAYSCALE) for name in ("left.png", "right.png")]
    left, right = straight.images(*images)
    assert check_rows(left, right).disparity_px[0] > 0.0
    assert check_rows(right, left).disparity_px[1] < 0.0


def test_options_change_the_images(scene, tmp_path):
    out = tmp_path / "out"
    done = rectify(
        scene / "left.png", scene / "right.png", "--calib", scene / "rig.json", "-o", out, "--json",
        "--size", "320x240", "--alpha", "1", "--method", "fusiello", "--own-centres", "--anaglyph",
    )  # fmt: skip
    found = answer(done)
    assert found["rectified"]["left"]["size"] == [320, 240]
    assert found["doffs_px"] != 0.0
    assert cv2.imread(str(out / "anaglyph" / "left.png")).shape == (240, 320, 3)


def test_pictures_at_half_the_size_have_a_scaled_rig(scene, tmp_path):
    for name in ("left.png", "right.png"):
        image = cv2.imread(str(scene / name), cv2.IMREAD_GRAYSCALE)
        cv2.imwrite(str(tmp_path / name), cv2.resize(image, (320, 240), interpolation=cv2.INTER_AREA))
    done = rectify(
        tmp_path / "left.png",
        tmp_path / "right.png",
        "--calib",
        scene / "rig.json",
        "-o",
        tmp_path / "out",
        "--json",
    )
    assert abs(answer(done)["pairs"][0]["rows"]["offset_px"]) < 0.15
    assert "it is scaled" in done.stderr


def test_too_little_texture_is_said(tmp_path):
    for k, name in enumerate(("left.png", "right.png")):
        cv2.imwrite(str(tmp_path / name), np.full((480, 640), 100 + k, np.uint8))
    rig = write_rig(tmp_path / "rig.json", TRUTH)
    found = answer(
        rectify(
            tmp_path / "left.png", tmp_path / "right.png", "--calib", rig, "-o", tmp_path / "out", "--json"
        )
    )
    assert "too few features" in verdict(found, "rows of features apart")["meaning"]


def test_row_check_finds_offset_and_turn(rng):
    left = rng.uniform(0.0, 600.0, (300, 2))
    turned = left - (30.0, 0.0) + np.column_stack([np.zeros(300), 1.5 + 0.004 * (left[:, 0] - 300.0)])
    turned += 0.2 * rng.standard_normal(turned.shape)
    turned[:60] = rng.uniform(0.0, 600.0, (60, 2))
    found = row_check_of(left, turned)
    assert abs(found.offset_px - 1.5) < 0.2
    assert abs(found.tilt[0] - 0.004) < 5e-4
    assert abs(found.tilt[1]) < 5e-4
    assert 200 < found.count < 260
    assert not row_check_of(left[:5], turned[:5]).is_known
    np.testing.assert_allclose(
        row_check_of(left[:, ::-1], turned[:, ::-1], axis=1).offset_px, found.offset_px
    )


def test_pictures_to_look_at():
    left, right = np.full((40, 60), 10, np.uint8), np.full((40, 60), 200, np.uint8)
    both = anaglyph(left, right)
    assert both.shape == (40, 60, 3)
    assert both[0, 0].tolist() == [200, 200, 10]
    assert side_by_side(left, right).shape == (40, 120, 3)
    assert side_by_side(left, right, axis=1).shape == (80, 60, 3)
