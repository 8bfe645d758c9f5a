"""What the command warns of: a window too large, another calibration, too few views, bad poses."""

import numpy as np
import pytest
from camera_photos import BOARD, OPTIONS, TRUTH, answer, photographed, run

from vision3d.camera import Camera
from vision3d.camera_files import write_camera
from vision3d.render import board_poses


def verdict(document, metric):
    """The verdict of that metric."""
    found = [one for one in document["verdicts"] if one["metric"].startswith(metric)]
    assert len(found) == 1, [one["metric"] for one in document["verdicts"]]
    return found[0]


@pytest.fixture(scope="module")
def whole(photos, tmp_path_factory):
    """The answer compared with the truth, and with its report."""
    folder = tmp_path_factory.mktemp("compared")
    write_camera(TRUTH, folder / "truth.yml", "opencv")
    return answer(*photos.paths, *OPTIONS, "--compare", folder / "truth.yml", "-o", folder / "out"), folder


def test_the_truth_is_no_other_camera(whole):
    document, _ = whole
    assert verdict(document, "difference from truth.yml")["verdict"] == "PASS"
    assert document["difference"]["rms_px"] < 0.2
    assert document["difference"]["sigmas"] < 2.0


def test_its_own_report_is_a_camera_to_compare_with(photos, whole):
    _, folder = whole
    again = answer(*photos.paths, *OPTIONS, "--compare", folder / "out" / "report.json", "--no-next-pose")
    assert again["difference"]["max_px"] < 1e-6
    assert again["next_pose"] is None


def test_another_camera_fails_the_check(photos, tmp_path):
    wrong = Camera(TRUTH.lens, TRUTH.intrinsics * (1.01, 1.01, 1.0, 1.0), TRUTH.distortion, TRUTH.size)
    write_camera(wrong, tmp_path / "wrong.yaml", "ros")
    done = run(*photos.paths, *OPTIONS, "--lens", "brown5", "--compare", tmp_path / "wrong.yaml", "--check")
    assert done.exit_code == 3
    assert "one of them is wrong" in " ".join(done.stdout.split())


def test_a_camera_of_another_size_cannot_be_compared(photos, tmp_path):
    write_camera(Camera("pinhole", (500, 500, 160, 120), (), (320, 240)), tmp_path / "small.yml", "opencv")
    done = run(*photos.paths, *OPTIONS, "--compare", tmp_path / "small.yml")
    assert done.exit_code == 1
    assert "320x240" in done.stderr
    assert "640x480" in done.stderr


def test_the_page_has_its_figures(whole):
    _, folder = whole
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    for heading in (
        "Camera", "Lens models", "Residuals over the image", "Views", "Coverage", "How sure a projection is",
        "Difference from truth.yml", "Corners to look at", "Pictures",
    ):  # fmt: skip
        assert f"<h2>{heading}</h2>" in page
    assert page.count("<svg") == 8
    assert "data:image/png;base64" in page
    assert "nan" not in page.lower().split("<h2>")[1]


def test_the_map_is_the_least_where_corners_are(whole):
    document, _ = whole
    told = document["uncertainty"]
    std = np.array(told["std_px"])
    assert std.shape == (len(told["y_px"]), len(told["x_px"]))
    assert np.nanargmax(std) in {0, std.shape[1] - 1, std.size - std.shape[1], std.size - 1}
    assert told["worst_px"] == pytest.approx(np.nanmax(std))
    assert (np.array(told["std_freed_px"]) <= std * 1.5 + 1e-3).mean() > 0.5


def test_a_window_beyond_the_squares_is_flagged(tmp_path, rng):
    far = photographed(tmp_path, 6, poses=board_poses(TRUTH, BOARD, 6, rng, fill=(0.17, 0.19)))
    forced = answer(*far.paths, *OPTIONS, "--window", "11", "--lens", "brown2", "--no-next-pose")
    found = verdict(forced, "corner window ±11 px")
    assert found["verdict"] == "FAIL"
    assert "leave --window out" in found["action"]
    assert len(forced["detection"]["moved"]) == found["value"] > 0
    small = answer(*far.paths, *OPTIONS, "--window", "3", "--lens", "brown2", "--no-next-pose")
    assert verdict(small, "corner window ±3 px")["verdict"] == "PASS"


def test_the_window_of_opencv_s_own_result_is_flagged(data_dir):
    """11: what the tutorial takes; the published calibration of these pictures is consistent with it."""
    images = sorted((data_dir / "vision/opencv").glob("left*.jpg"))
    forced = answer(*images, *OPTIONS, "--window", "11", "--lens", "brown5", "--no-next-pose")
    assert verdict(forced, "corner window")["verdict"] == "FAIL"
    assert {"left02.jpg", "left13.jpg"} <= {one["picture"] for one in forced["detection"]["moved"]}
    assert max(one["by_px"] for one in forced["detection"]["moved"]) > 2.0


def test_few_views_all_alike_get_advice(tmp_path, rng):
    poses = board_poses(TRUTH, BOARD, 6, rng, tilt_rad=(0.15, 0.25))
    few = photographed(tmp_path, 6, poses=poses)
    found = answer(*few.paths, *OPTIONS)
    assert verdict(found, "pictures used")["verdict"] == "WARN"
    assert verdict(found, "largest tilt")["verdict"] != "PASS"
    assert "tilt" in " ".join(found["coverage"]["advice"])
    assert found["next_pose"]["gain"] > 2.0
    assert found["next_pose"]["tilt_deg"] > 20.0


def test_three_views_cannot_choose_a_lens(photos):
    found = answer(*photos.paths[:3], *OPTIONS, "--no-next-pose")
    assert found["camera"]["lens"] == "brown2"
    assert found["leave_one_out_rms_px"] is None
    assert verdict(found, "left-out pictures")["verdict"] == "WARN"
