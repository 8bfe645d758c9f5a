"""`factorlab markers`: pictures, folders, videos; with and without a camera; what is refused."""

import csv
import json

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from marker_worlds import SIZE_M, tilted

from factorlab.cli import main
from sequential.manifold import SE3
from vision3d.camera import Camera
from vision3d.camera_files import write_camera
from vision3d.render import Plane, marker_texture, moving_markers, render_planes, write_video

CAMERA = Camera("brown5", (530, 531, 322, 240), (-0.28, 0.08, 1e-3, -2e-4, 0.02), (640, 480))
SE = SE3()


def run(*arguments):
    return CliRunner().invoke(main, ["markers", *map(str, arguments)], catch_exceptions=False)


@pytest.fixture
def camera_file(tmp_path):
    return write_camera(CAMERA, tmp_path / "camera.json") or tmp_path / "camera.json"


@pytest.fixture
def picture(tmp_path, rng):
    """Two markers and where they are."""
    truth = {3: tilted(80, 35, rng, CAMERA, at=(-0.2, 0.0)), 11: tilted(60, 50, rng, CAMERA, at=(0.25, 0.1))}
    planes = [Plane(pose, marker_texture("6x6_50", number, SIZE_M)) for number, pose in truth.items()]
    path = tmp_path / "two.png"
    cv2.imwrite(str(path), render_planes(CAMERA, planes, rng=rng))
    return path, truth


def test_a_picture_gives_numbers_and_dictionary_without_a_camera(picture):
    done = run(picture[0], "--json")
    told = json.loads(done.stdout)
    assert done.exit_code == 0
    assert told["ids"] == [3, 11]
    assert told["dictionary"] == "6x6_50"
    assert all(one["pose"] is None for one in told["markers"])


def test_poses_are_where_the_markers_are(picture, camera_file, tmp_path):
    path, truth = picture
    out = tmp_path / "out"
    done = run(
        path, "--camera", camera_file, "--size", "100mm", "--dictionary", "6X6_50", "--json", "-o", out
    )
    told = json.loads(done.stdout)
    assert done.exit_code == 0
    for one in told["markers"]:
        best = one["pose"]["modes"][0]
        step = SE.local(np.array(best["camera_T_marker"]), truth[one["id"]])
        assert step @ np.linalg.solve(np.array(best["cov"]), step) / 6.0 < 4.0
        assert one["pose"]["certain"]
    rows = list(csv.DictReader((out / "markers.csv").read_text().splitlines()))
    assert {row["id"] for row in rows} == {"3", "11"}
    assert {row["mode"] for row in rows} <= {"0", "1"}
    assert cv2.imread(str(out / "overlay.png")).shape == (480, 640, 3)
    assert "camera_T_marker" in (out / "report.html").read_text()


def test_a_video_is_followed(camera_file, tmp_path, rng):
    frames = list(moving_markers(CAMERA, [1, 4], 0.05, rng=rng, seconds=0.6, dictionary="apriltag_36h11"))
    path, out = tmp_path / "moving.avi", tmp_path / "out"
    write_video(path, [one.image for one in frames])
    done = run(path, "--camera", camera_file, "--size", "5cm", "--json", "-o", out)
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["ids"] == [1, 4]
    assert told["dictionary"] == "apriltag_36h11"
    assert told["frames"] == len(frames)
    rows = [row for row in csv.DictReader((out / "poses.csv").read_text().splitlines()) if row["id"] == "4"]
    assert len(rows) == len(frames)
    for row, frame in zip(rows, frames, strict=True):
        place = np.array([float(row[name]) for name in ("px_m", "py_m", "pz_m")])
        assert np.linalg.norm(place - frame.poses[4][4:]) < 0.02


def test_a_folder_is_read_picture_by_picture(picture, tmp_path):
    folder = tmp_path / "many"
    folder.mkdir()
    for k in range(3):
        (folder / f"{k}.png").write_bytes(picture[0].read_bytes())
    (folder / "broken.png").write_bytes(b"no picture")
    told = json.loads(run(folder, "--json").stdout)
    assert len(told["markers"]) == 6
    assert len(told["left_out"]) == 1


def test_nothing_found_is_a_warning_and_no_error(tmp_path):
    path = tmp_path / "grey.png"
    cv2.imwrite(str(path), np.full((120, 160), 128, np.uint8))
    done = run(path)
    assert done.exit_code == 0
    assert "no marker was read" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--size", "50mm"], 2, "--size goes with --camera"),
        (["--camera", "CAMERA"], 2, "--camera goes with --size"),
        (["--camera", "CAMERA", "--size", "50"], 2, "did you mean 50mm"),
        (["--dictionary", "9x9"], 2, "no marker dictionary"),
        (["--camera", "none.yaml", "--size", "50mm"], 1, "there is no file"),
    ],
)
def test_what_cannot_be_is_said_in_a_sentence(picture, camera_file, arguments, code, said):
    done = run(picture[0], *[str(camera_file) if one == "CAMERA" else one for one in arguments])
    assert done.exit_code == code
    assert said in " ".join(done.stderr.replace("│", " ").split())


def test_sources_that_are_none(tmp_path, picture, camera_file):
    assert "no file" in run(tmp_path / "none.png").stderr
    assert "factorlab live camera 0" in run("0").stderr
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), np.full((120, 160), 128, np.uint8))
    done = run(small, "--camera", camera_file, "--size", "50mm")
    assert done.exit_code == 1
    assert "640x480" in done.stderr


def test_the_markers_of_the_tutorial(data_dir):
    told = json.loads(run(data_dir / "vision/aruco/singlemarkersoriginal.jpg", "--json").stdout)
    assert told["ids"] == [23, 40, 62, 98, 124, 203]
    assert told["dictionary"] == "6x6_250"
