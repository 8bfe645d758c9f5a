"""What `factorlab undistort` writes, prints and returns."""

import json

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from lens_family import camera_of

from factorlab.cli import main
from vision3d.camera import Camera
from vision3d.camera_files import FORMATS, read_camera, write_camera
from vision3d.undistort import Undistorter


def run(*arguments):
    return CliRunner().invoke(main, ["undistort", *map(str, arguments)])


@pytest.fixture
def folder(tmp_path, rng):
    """Three pictures, one in colour, and the camera that took them."""
    (tmp_path / "in").mkdir()
    for i in range(3):
        coarse = rng.integers(0, 256, (12, 16, 3) if i == 2 else (12, 16), dtype=np.uint8)
        cv2.imwrite(str(tmp_path / "in" / f"view{i}.png"), cv2.resize(coarse, (640, 480)))
    write_camera(camera_of("brown5"), tmp_path / "camera.yml")
    return tmp_path


def test_pictures_and_their_camera(folder):
    done = run(folder / "in", "--camera", folder / "camera.yml", "-o", folder / "out")
    assert done.exit_code == 0, done.stderr
    assert "undistorted 3 files (brown5)" in done.stdout
    undistorter = Undistorter.of(camera_of("brown5"), view="inside")
    for i in range(3):
        original = cv2.imread(str(folder / "in" / f"view{i}.png"), cv2.IMREAD_UNCHANGED)
        written = cv2.imread(str(folder / "out" / f"view{i}.png"), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(written, undistorter(original))
    for one in FORMATS.values():
        camera = read_camera(folder / "out" / one.file_name)
        assert camera.lens == "pinhole"
        np.testing.assert_allclose(camera.intrinsics, undistorter.target.intrinsics, rtol=1e-14)


def test_the_document(folder):
    out = folder / "out"
    done = run(folder / "in", "--camera", folder / "camera.yml", "-o", out, "--view", "all", "--json")
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document == json.loads((out / "report.json").read_text())
    assert document["view"] == "all"
    assert document["camera"]["lens"] == "brown5"
    assert document["undistorted_camera"]["lens"] == "pinhole"
    assert 0.7 < document["seen"] < 1.0
    assert not document["fold"]["inside"]
    assert [image["file"] for image in document["images"]] == ["view0.png", "view1.png", "view2.png"]
    assert {path.name for path in out.iterdir()} == {*document["files"], "report.json"}


def test_what_cannot_be_undistorted_is_left_out(folder):
    (folder / "in" / "bad.png").write_bytes(b"nothing")
    cv2.imwrite(str(folder / "in" / "small.png"), np.zeros((240, 320), dtype=np.uint8))
    done = run(folder / "in", "--camera", folder / "camera.yml", "-o", folder / "out", "--json")
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert len(document["images"]) == 3
    reasons = {one["source"].rsplit("/", 1)[1]: one["reason"] for one in document["left_out"]}
    assert reasons["bad.png"].startswith("cannot be read as a picture")
    assert "320x240" in reasons["small.png"]
    assert done.stderr.count("left out:") == 2


def test_a_video(folder):
    frames = [np.roll(cv2.imread(str(folder / "in" / "view2.png")), 10 * i, axis=1) for i in range(4)]
    video = folder / "drive.avi"
    writer = cv2.VideoWriter(str(video), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (640, 480))
    for frame in frames:
        writer.write(frame)
    writer.release()
    done = run(video, "--camera", folder / "camera.yml", "-o", folder / "out")
    assert done.exit_code == 0, done.stderr
    capture = cv2.VideoCapture(str(folder / "out" / "drive.avi"))
    undistorter = Undistorter.of(camera_of("brown5"), view="inside")
    for frame in frames:
        good, straight = capture.read()
        assert good
        difference = straight.astype(float) - undistorter(frame)
        assert np.abs(difference).mean() < 4.0, "but for two compressions"
    assert not capture.read()[0]
    assert capture.get(cv2.CAP_PROP_FPS) == pytest.approx(20.0)


def test_names_that_clash(folder):
    (folder / "more").mkdir()
    picture = cv2.imread(str(folder / "in" / "view0.png"))
    for path in (folder / "more" / "view0.png", folder / "in" / "view0.jpg"):
        cv2.imwrite(str(path), picture)
    sources = folder / "in" / "view0.jpg", folder / "in" / "view0.png", folder / "more" / "view0.png"
    done = run(*sources, "--camera", folder / "camera.yml", "-o", folder / "out", "--json")
    assert [image["file"] for image in json.loads(done.stdout)["images"]] == [
        "view0.png",
        "in_view0.png",
        "more_view0.png",
    ]


def test_a_fold_inside_the_image_is_told(folder):
    write_camera(
        Camera("brown5", (532.8, 531.9, 342.5, 233.9), (-0.28, 0.3, 0, 0, -0.5)), folder / "bad.json"
    )
    arguments = folder / "in", "--camera", folder / "bad.json", "-o", folder / "out"
    done = run(*arguments)
    assert done.exit_code == 0
    assert "warning: the distortion folds" in done.stderr
    assert run(*arguments, "--force", "--check").exit_code == 3


def test_a_file_without_size_takes_that_of_the_pictures(folder):
    text = (folder / "camera.yml").read_text()
    lines = [line for line in text.splitlines() if not line.startswith("image_")]
    (folder / "sizeless.yml").write_text("\n".join(lines) + "\n")
    done = run(folder / "in", "--camera", folder / "sizeless.yml", "-o", folder / "out", "--json")
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["camera"]["size"] == [640, 480]


def test_whatever_is_wrong_is_a_sentence(folder):
    out = folder / "out"
    done = run(folder / "in", "--camera", folder / "gone.yml", "-o", out)
    assert (done.exit_code, done.stderr) == (1, f"error: there is no file {folder / 'gone.yml'}\n")
    done = run(folder / "nowhere", "--camera", folder / "camera.yml", "-o", out)
    assert done.exit_code == 1
    assert "there is no file or folder" in done.stderr
    small = write_camera(camera_of("brown5", (320, 240)), folder / "small.json")
    done = run(folder / "in", "--camera", small, "-o", out)
    assert done.exit_code == 1
    assert "none of the 3 files can be undistorted" in done.stderr
    assert not out.exists(), "nothing half done is left"
    assert run(folder / "in", "--camera", folder / "camera.yml", "-o", out).exit_code == 0
    done = run(folder / "in", "--camera", folder / "camera.yml", "-o", out)
    assert done.exit_code == 1
    assert "already holds files" in done.stderr
    assert run(folder / "in", "-o", out).exit_code == 2


def test_the_left_views_with_opencv_s_calibration(data_dir, tmp_path):
    views = data_dir / "vision" / "opencv"
    done = run(
        views / "left*.jpg", "--camera", views / "left_intrinsics.yml", "-o", tmp_path / "out", "--json"
    )
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert len(document["images"]) == 13
    assert document["seen"] == 1.0
