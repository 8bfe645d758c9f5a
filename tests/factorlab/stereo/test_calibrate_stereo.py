"""`factorlab calibrate stereo` on photographs whose rig is known."""

import json
import shutil

import numpy as np
import pytest
from stereo_photos import BOARD, LEFT, OPTIONS, TRUTH, answer, calibrate, photographed_pairs, verdict

from sequential.manifold import SE3
from vision3d.calibrate.detection import detect_views
from vision3d.camera_files import write_camera
from vision3d.render.rig_set import render_board_pairs
from vision3d.render.video import write_video
from vision3d.stereo import read_rig
from vision3d.stereo.fit import calibrate_stereo
from vision3d.stereo.view_pairs import pairs_of_views


def test_the_truth_comes_out(calibrated):
    found, out = calibrated
    rig = read_rig(out / "rig.json")
    error = SE3().local(rig.right_T_left, TRUTH.right_T_left)
    assert error @ np.linalg.solve(rig.cov, error) < 30.0
    assert abs(rig.baseline_m - TRUTH.baseline_m) < 1e-4
    assert found["rms_px"] < 0.12
    assert found["rectified_row_error_px"] < 0.1
    assert abs(found["square"]["triangulated_m"] - 0.025) < 2e-5
    assert found["pairs"]["used"] == 10
    assert found["left_out_row_error_px"] < 1.5 * found["rectified_row_error_px"]
    for metric in ("pairs used", "left and right", "rig rigid", "residual", "rectified rows", "square"):
        assert verdict(found, metric)["verdict"] == "PASS", metric


def test_every_file_is_there_and_gives_the_rig(calibrated):
    found, out = calibrated
    rig = read_rig(out / "rig.json")
    for name in ("stereo_opencv.yml", "left.yaml", "right.yaml"):
        other = read_rig(out / name)
        np.testing.assert_allclose(SE3().local(rig.right_T_left, other.right_T_left), 0.0, atol=1e-9)
    assert {"report.html", "report.json", "rig.json"} <= {path.name for path in out.iterdir()}
    assert found["rig"]["format"] == "factorlab stereo rig"
    assert read_rig(out / "report.json").left == rig.left
    rows = (out / "corners.csv").read_text().splitlines()
    assert len(rows) == 1 + 10 * 2 * 54
    assert rows[0].startswith("pair,side,picture,corner,x_px")
    assert len((out / "pairs.csv").read_text().splitlines()) == 1 + 10


def test_the_page_has_every_figure(calibrated):
    page = (calibrated[1] / "report.html").read_text()
    assert page.count("<svg") == 5
    assert "A rectified pair" in page


def test_a_known_camera_is_held(pairs, tmp_path):
    path = write_camera(LEFT, tmp_path / "left.json")
    found = answer(calibrate(*pairs.patterns, *OPTIONS, "--lens", "brown5", "--left-camera", path, "--json"))
    assert found["cameras"]["left"]["held"]
    assert not found["cameras"]["right"]["held"]
    assert found["cameras"]["left"]["parameters"]["fx"] == LEFT.intrinsics[0]
    both = answer(calibrate(*pairs.patterns, *OPTIONS, "--lens", "brown5", "--intrinsics", "alone", "--json"))
    assert both["cameras"]["left"]["held"]
    assert both["rms_px"] < 0.13


def test_swapped_sides_are_said(pairs):
    left, right = pairs.patterns
    done = calibrate(right, left, *OPTIONS, "--lens", "brown4", "--json", "--check")
    assert done.exit_code == 3
    assert verdict(json.loads(done.stdout), "left and right")["verdict"] == "FAIL"


def test_pairs_missing_on_one_side_are_named(pairs, tmp_path):
    for path in (*pairs.left, *pairs.right[:7]):
        shutil.copy(path, tmp_path / path.name)
    done = calibrate(tmp_path / "left*.png", tmp_path / "right*.png", *OPTIONS, "--lens", "brown4", "--json")
    found = answer(done)
    assert found["pairs"]["used"] == 7
    assert "left09.png: there is no right picture to it" in done.stderr
    # the board that only the left camera saw still tells of it
    assert len(found["pairs"]["table"]) == 10


def test_a_pair_of_two_moments_is_named(pairs, tmp_path):
    for path in (*pairs.left, *pairs.right):
        shutil.copy(path, tmp_path / path.name)
    shutil.copy(pairs.right[1], tmp_path / "right07.png")
    shutil.copy(pairs.right[6], tmp_path / "right02.png")
    done = calibrate(tmp_path / "left*.png", tmp_path / "right*.png", *OPTIONS, "--lens", "brown4", "--json")
    found = answer(done)
    assert [one["pair"] for one in found["pairs"]["disagreeing"]] == [
        "left02.png + right02.png",
        "left07.png + right07.png",
    ]
    assert abs(found["rig"]["baseline_m"] - TRUTH.baseline_m) < 3e-4


def test_two_videos(tmp_path):
    pairs = photographed_pairs(tmp_path, 5, seed=4)
    for name, images in (("left.avi", pairs.rendered.left), ("right.avi", pairs.rendered.right)):
        write_video(tmp_path / name, [image for image in images for _ in range(3)], fps=10.0)
    found = answer(
        calibrate(
            tmp_path / "left.avi",
            tmp_path / "right.avi",
            *OPTIONS,
            "--lens",
            "brown2",
            "--frames",
            "5",
            "--json",
        )
    )
    assert found["pairs"]["how"] == "frame by frame"
    assert found["pairs"]["used"] == 5
    assert abs(found["rig"]["baseline_m"] - TRUTH.baseline_m) < 1.5e-3


@pytest.mark.slow
def test_the_pose_is_as_sure_as_it_says_detection_included(seeds):
    """z scores of right_T_left over rendered sets."""

    z = []
    for seed in range(len(seeds) // 5):
        rendered = render_board_pairs(TRUTH, BOARD, 10, np.random.default_rng(seed))
        views = [
            detect_views([(f"{side}{k}", image) for k, image in enumerate(images)], BOARD).views
            for side, images in (("l", rendered.left), ("r", rendered.right))
        ]
        found = calibrate_stereo(pairs_of_views(*views)).rig
        z.append(SE3().local(found.right_T_left, TRUTH.right_T_left) / np.sqrt(np.diag(found.cov)))
    assert 0.5 < np.sqrt(np.mean(np.square(z))) < 1.6
