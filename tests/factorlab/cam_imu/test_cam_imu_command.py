"""`factorlab calibrate cam-imu` from pixels and a log to files, against the rendered truth."""

import json
import shutil

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from factorlab.cam_imu.files import read_mounting
from factorlab.cli import main
from sequential.manifold import SE3
from vision3d.camera_files import read_camera


def run(*arguments):
    return CliRunner().invoke(main, ["calibrate", "cam-imu", *map(str, arguments)])


def answered(*arguments):
    done = run(*arguments, "--json")
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


def near_truth(found, demo):
    pose = np.array(found["camera_T_imu"]["qw_qx_qy_qz_px_py_pz"])
    error = SE3().local(demo.rig.camera_T_imu, pose)
    assert np.degrees(np.linalg.norm(error[:3])) < 0.03
    assert np.linalg.norm(error[3:]) < 2e-3
    assert abs(found["time_offset_s"] - demo.rig.time_offset_s) < 1e-4


@pytest.fixture(scope="session")
def calibrated(on_disk):
    out = on_disk.folder / "out"
    return answered(on_disk.folder / "frames", on_disk.folder / "imu.csv", *on_disk.options, "-o", out), out


def verdict(found, metric):
    return next(one for one in found["verdicts"] if one["metric"].startswith(metric))


def test_frames_named_by_their_time(calibrated, on_disk):
    found, _ = calibrated
    near_truth(found, on_disk.demo)
    for metric in ("clocks matched", "σ of the rotation", "σ of the translation", "σ of the time offset"):
        assert verdict(found, metric)["verdict"] == "PASS", metric
    assert verdict(found, "board, measured by the IMU")["value"] == pytest.approx(35.0, abs=0.1)
    assert found["frames"]["stamps"] == "the names of the files"


def test_files_for_others(calibrated, on_disk):
    found, out = calibrated
    assert {"report.html", "report.json", "calibration.json", "imu.yaml", "trajectory.tum", "frames.csv"} <= {
        path.name for path in out.iterdir()
    }
    chain = yaml.safe_load((out / "camchain-imucam.yaml").read_text())
    np.testing.assert_allclose(chain["cam0"]["T_cam_imu"], found["camera_T_imu"]["matrix"], atol=1e-12)
    assert chain["cam0"]["timeshift_cam_imu"] == found["time_offset_s"]
    camera = on_disk.demo.rig.camera
    assert read_camera(out / "camchain-imucam.yaml") == camera
    assert read_camera(out / "calibration.json") == camera
    own, theirs = read_mounting(out), read_mounting(out / "camchain-imucam.yaml")
    np.testing.assert_allclose(own.camera_T_imu, theirs.camera_T_imu, atol=1e-9)
    assert own.time_offset_s == theirs.time_offset_s
    assert own.cov is not None
    assert theirs.cov is None
    page = (out / "report.html").read_text()
    assert page.count("<svg") == 5
    assert len((out / "frames.csv").read_text().splitlines()) == 1 + found["frames"]["with_board"]


def test_a_video_with_a_table_of_stamps_and_another_calibration(calibrated, on_disk):
    _, out = calibrated
    film, log = on_disk.folder / "film" / "video.avi", on_disk.folder / "imu.csv"
    found = answered(film, log, *on_disk.options, "--no-checks", "--compare", out)
    near_truth(found, on_disk.demo)
    assert found["frames"]["stamps"] == "frames.csv"
    assert verdict(found, "difference from out")["verdict"] == "PASS"


def test_a_video_whose_clock_is_its_own(on_disk, tmp_path):
    film = shutil.copy(on_disk.folder / "film" / "video.avi", tmp_path / "film.avi")
    found = answered(film, on_disk.folder / "imu.csv", *on_disk.options, "--no-checks")
    first = 1e-9 * int(on_disk.demo.stamps_ns[0])
    assert found["time_offset_s"] - first == pytest.approx(on_disk.demo.rig.time_offset_s, abs=1e-3)
    later = run(film, on_disk.folder / "imu.csv", *on_disk.options, "--clocks", "same")
    assert later.exit_code == 1
    assert "do not overlap in time" in later.stderr


def test_what_is_missing_is_usage(on_disk, tmp_path):
    frames, log = on_disk.folder / "frames", on_disk.folder / "imu.csv"
    for arguments, words in (
        ((frames,), "give FRAMES"),
        ((frames, log, "--board", "9x6", "--square", "35mm"), "--camera is missing"),
        ((frames, log, "--camera", on_disk.folder / "camera.json"), "--board is missing"),
        (("--demo", frames), "leave out FRAMES"),
    ):
        done = run(*arguments)
        assert done.exit_code == 2
        assert words in done.stderr


def test_wrong_data_is_one_sentence(on_disk, tmp_path):
    frames, log = on_disk.folder / "frames", on_disk.folder / "imu.csv"
    camera = on_disk.folder / "camera.json"
    few = tmp_path / "few"
    few.mkdir()
    for path in sorted(frames.iterdir())[:12]:
        shutil.copy(path, few)
    plain = tmp_path / "plain"
    plain.mkdir()
    shutil.copy(next(frames.iterdir()), plain / "a.png")
    for arguments, words in (
        ((few, log, *on_disk.options), "frames; at least 20 are needed"),
        ((plain, log, *on_disk.options), "say nothing of when they were taken"),
        ((few, log, "--camera", camera, "--board", "8x5", "--square", "35mm"), "none of the 12 frames shows"),
        ((tmp_path / "nothing", log, *on_disk.options), "there is no file or folder"),
    ):
        done = run(*arguments)
        assert done.exit_code == 1, done.output
        assert words in done.stderr
        assert "Traceback" not in done.stderr


def test_a_gyro_in_degrees_is_told(on_disk, tmp_path):
    text = (on_disk.folder / "imu.csv").read_text().splitlines()
    head, rows = text[0], [line.split(",") for line in text[1:]]
    gyro = [k for k, name in enumerate(head.split(",")) if name.startswith("g")]
    for row in rows:
        for k in gyro:
            row[k] = repr(float(row[k]) * 57.29578)
    log = tmp_path / "degrees.csv"
    log.write_text("\n".join([head, *map(",".join, rows)]) + "\n")
    done = run(on_disk.folder / "frames", log, *on_disk.options)
    assert done.exit_code == 1
    assert "deg/s" in done.stderr
    mended = answered(
        on_disk.folder / "frames", log, *on_disk.options, "--no-checks",
        "--units", "gyro=deg/s,accel=m/s^2,t=s",
    )  # fmt: skip
    near_truth(mended, on_disk.demo)
