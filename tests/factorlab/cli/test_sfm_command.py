"""What `factorlab sfm` writes, prints and returns."""

import json
import signal
import subprocess
import sys
import time

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from sfm_worlds import SMALL, rendered

from factorlab.cli import main
from vision3d.camera_files import read_camera, write_camera
from vision3d.cloud import read_ply
from vision3d.sfm import from_pycolmap
from vision3d.sfm.library import colmap

FILES = {
    "report.html", "report.json", "cloud.ply", "camera.json", "poses.csv", "poses_tum.txt",
    "cameras_kalibr.yaml", "bundler/bundle.out", "bundler/list.txt",
    "colmap/text/cameras.txt", "colmap/text/images.txt",
    "colmap/text/points3D.txt", "colmap/sparse/0/cameras.bin", "colmap/sparse/0/points3D.bin",
}  # fmt: skip


def run(*arguments):
    return CliRunner().invoke(main, ["sfm", *map(str, arguments)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Five pictures of a desk, one that is cut off, and the camera that took them."""
    place = tmp_path_factory.mktemp("sfm")
    (place / "photos").mkdir()
    for name, image in rendered("desk")[0].items():
        cv2.imwrite(str(place / "photos" / name), image)
    cv2.imwrite(str(place / "photos" / "cut.jpg"), rendered("desk")[0]["desk0.png"])
    content = (place / "photos" / "cut.jpg").read_bytes()
    (place / "photos" / "cut.jpg").write_bytes(content[:4000])
    write_camera(SMALL, place / "camera.json", "json")
    return place


@pytest.fixture(scope="module")
def done(folder):
    return run(folder / "photos", "--camera", folder / "camera.json", "--json", "-o", folder / "out")


def test_it_tells_and_writes_everything(done, folder):
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["registered"] == 5
    assert document["given"] == 6
    assert document["missing"][0]["name"] == "cut.jpg"
    assert "cut off" in document["missing"][0]["reason"]
    assert document["mean_reprojection_error_px"] < 0.3
    assert document["loops"]["median_deg"] < 1.0
    by_metric = {one["metric"]: one for one in document["verdicts"]}
    assert by_metric["pictures with a place"]["verdict"] == "WARN"
    assert by_metric["our adjustment"]["verdict"] == "PASS"
    assert by_metric["focal length"]["value"] == pytest.approx(330.0)
    written = {
        str(path.relative_to(folder / "out")) for path in (folder / "out").rglob("*") if path.is_file()
    }
    assert written >= FILES
    assert not (folder / "out.work").exists()


def test_the_files_say_the_same_model(done, folder):
    """COLMAP's both, Bundler's, the camera's and the cloud's: poses, points and pixels agree."""
    out = folder / "out"
    theirs = [
        from_pycolmap(colmap().Reconstruction(out / part)) for part in ("colmap/text", "colmap/sparse/0")
    ]
    document = json.loads((out / "report.json").read_text())
    for model in theirs:
        assert len(model) == 5
        assert model.mean_error_px == pytest.approx(document["mean_reprojection_error_px"], rel=1e-6)
        poses = [picture["camera_T_world"] for picture in document["pictures"]]
        np.testing.assert_allclose(model.cameras_T_world, poses, atol=1e-9)
    cloud = read_ply(out / "cloud.ply")
    assert len(cloud.points) == len(theirs[0].points) + 5 * 5
    assert read_camera(out / "camera.json") == SMALL
    assert read_camera(out / "cameras_kalibr.yaml").intrinsics == pytest.approx(SMALL.intrinsics)
    from vision3d.sfm.bundler import read_bundler

    names = (out / "bundler" / "list.txt").read_text().split()
    back = read_bundler(out / "bundler" / "bundle.out", images=names, size=SMALL.size)
    assert back.mean_error_px == pytest.approx(document["mean_reprojection_error_px"], abs=1e-3)
    trajectory = np.loadtxt(out / "poses_tum.txt")
    np.testing.assert_allclose(trajectory[:, 1:4], [one["centre"] for one in document["pictures"]], atol=1e-6)


def test_it_does_not_write_over_a_report(done, folder):
    again = run(folder / "photos", "-o", folder / "out")
    assert again.exit_code == 1
    assert "already holds files" in again.stderr


def test_a_model_that_is_none_is_reported_and_fails(tmp_path):
    for name, image in rendered("turned")[0].items():
        cv2.imwrite(str(tmp_path / name), image)
    none = run(tmp_path, "--max-features", 1500, "--json", "-o", tmp_path / "out")
    assert none.exit_code == 1
    document = json.loads(none.stdout)
    assert document["registered"] == 0
    assert document["verdicts"][0]["verdict"] == "FAIL"
    assert "only turned" in document["verdicts"][0]["meaning"]
    assert {pair["kind"] for pair in document["pairs"] if pair["inliers"]} == {"pure rotation"}
    assert (tmp_path / "out" / "report.html").is_file()
    assert not (tmp_path / "out" / "cloud.ply").exists()


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["nowhere"], 1, "there is no file or folder nowhere"),
        (["photos/desk0.png"], 1, "two pictures or more"),
        (["photos", "--camera", "photos/desk0.png"], 1, "desk0.png"),
        (["photos", "--lens", "thin12"], 2, "thin12"),
        ([], 2, "IMAGES"),
    ],
)
def test_bad_command_lines(folder, monkeypatch, arguments, code, words):
    monkeypatch.chdir(folder)
    told = run(*arguments)
    assert told.exit_code == code
    assert words in told.stderr
    assert told.stderr.count("\n") <= 5


def test_an_interruption_keeps_the_features(folder, tmp_path):
    """Ctrl-C while it works: features are kept beside the folder, and the same command goes on."""
    command = [sys.executable, "-m", "factorlab", "sfm", folder / "photos", "-o", tmp_path / "out"]
    job = subprocess.Popen([*command, "--no-refine"], stderr=subprocess.PIPE, text=True)
    kept = tmp_path / "out.work" / "features"
    until = time.monotonic() + 60.0
    while time.monotonic() < until and not (kept.is_dir() and any(kept.iterdir())):
        time.sleep(0.02)
    job.send_signal(signal.SIGINT)
    _, told = job.communicate(timeout=60)
    assert job.returncode == 130, told
    assert "the same command goes on" in told
    assert list(kept.glob("*.npz"))
    assert not (tmp_path / "out").exists()
    again = run(folder / "photos", "-o", tmp_path / "out", "--no-refine")
    assert again.exit_code == 0, again.stderr
    assert not (tmp_path / "out.work").exists()


def test_two_pictures_get_standard_deviations(folder):
    """Their centres hold no gauge of their own; that of the points does."""
    pair = run(
        folder / "photos/desk1.png", folder / "photos/desk3.png", "--camera", folder / "camera.json", "--json"
    )
    assert pair.exit_code == 0, pair.stderr
    document = json.loads(pair.stdout)
    assert document["adjustment"]["gauge"] == "points"
    assert min(document["adjustment"]["sigma_place"]) > 0.0


def test_a_slide_does_not_tell_the_focal_length(folder, tmp_path):
    """Parallel cameras: the residuals are small at any focal length, and the band says so."""
    from vision3d.render import desk, render_scene

    rng = np.random.default_rng(6)
    scene = desk(rng)
    for k in range(4):
        pose = np.array([1.0, 0.0, 0.0, 0.0, -0.08 * k, 0.0, 0.0])
        cv2.imwrite(str(tmp_path / f"slide{k}.png"), render_scene(SMALL, pose, scene, rng=rng).image)
    slide = run(tmp_path, "--lens", "pinhole", "--json")
    document = json.loads(slide.stdout)
    told = next(one for one in document["verdicts"] if one["metric"] == "focal length")
    assert told["verdict"] in {"WARN", "FAIL"}
    assert "give --camera" in told["action"]
