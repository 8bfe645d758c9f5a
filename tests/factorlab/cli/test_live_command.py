"""`factorlab live camera` as it is typed: how it starts, how it ends, and what it leaves."""

import json
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from live_worlds import CAMERA, FPS, Unplugged, marker_image, write_video

from factorlab.cli import main
from vision3d.camera_files import write_camera
from vision3d.frames import open_frames

COMMAND = [sys.executable, "-m", "factorlab", "live", "camera"]
QUIET = ("--no-browser", "--port", "0")


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    rng = np.random.default_rng(2)
    path = tmp_path_factory.mktemp("video") / "markers.avi"
    return write_video(path, (marker_image(k / FPS, rng) for k in range(20)))


def live(*options):
    return CliRunner().invoke(main, ["live", "camera", *map(str, options)])


def test_a_file_from_its_beginning_to_its_end(video, tmp_path):
    done = live(video, *QUIET, "--exit", "--fast", "--json", "--record", tmp_path / "kept")
    assert done.exit_code == 0, done.output
    summary = json.loads(done.stdout)
    assert (summary["frames"], summary["worked_on"], summary["skipped"]) == (20, 20, 0)
    recorded = summary["recordings"][0]
    assert (recorded["frames"], recorded["readings"], recorded["lost"]) == (20, 20, 0)
    assert recorded["folder"].startswith(str(tmp_path / "kept"))
    assert "live: http://127.0.0.1:" in done.stderr


def test_without_json_it_says_what_it_did(video):
    done = live(video, *QUIET, "--exit", "--fast")
    assert done.exit_code == 0
    assert done.stdout == f"20 frames of {video}, 20 worked on\n"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_recording_properly(video, tmp_path, number):
    process = subprocess.Popen(
        [*COMMAND, str(video), *QUIET, "--loop", "--json", "--record", str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    address = re.search(r"http://\S+", process.stderr.readline())[0]
    for _ in range(200):
        with urllib.request.urlopen(address + "state.json", timeout=10) as answer:  # noqa: S310 - ours
            state = json.load(answer)
        if (state["recording"] or {}).get("seconds", 0) > 1:
            break
        time.sleep(0.05)
    process.send_signal(number)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 0, err
    recorded = json.loads(out)["recordings"][0]
    assert recorded["lost"] == 0
    assert recorded["frames"] > FPS
    (folder,) = tmp_path.iterdir()
    assert sorted(path.name for path in folder.iterdir()) == [
        "frames.csv",
        "markers.csv",
        "readings.jsonl",
        "video.avi",
    ]
    with open_frames(folder / "video.avi") as frames:
        assert sum(1 for _ in frames) == recorded["frames"]


def test_a_camera_that_is_unplugged_ends_in_a_sentence_with_what_was_recorded(tmp_path, monkeypatch):
    monkeypatch.setattr(cv2, "VideoCapture", Unplugged)
    done = live("0", *QUIET, "--exit", "--json", "--record", tmp_path, "--task", "features")
    assert done.exit_code == 1
    assert re.search(r"error: camera 0 stopped giving frames after 40 \(\d", done.stderr)
    assert json.loads(done.stdout)["recordings"][0]["frames"] == 40


def test_a_port_in_use_is_a_sentence(video):
    with socket.create_server(("127.0.0.1", 0)) as busy:
        port = busy.getsockname()[1]
        done = live(video, "--no-browser", "--port", port)
    assert done.exit_code == 1
    assert done.stderr == (
        f"error: port {port} of 127.0.0.1 is in use; close what uses it, or take any free one: --port 0\n"
    )


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("77", "error: there is no camera 77 that can be opened; "),
        ("nothing.avi", "error: there is no file or folder nothing.avi; "),
    ],
)
def test_a_source_that_is_not_there_is_a_sentence(source, words):
    done = live(source, *QUIET)
    assert done.exit_code == 1
    assert done.stderr.startswith(words)
    assert done.stderr.count("\n") == 1


def test_a_folder_that_cannot_be_recorded_to_is_a_sentence(video, tmp_path):
    (tmp_path / "file").write_text("")
    done = live(video, *QUIET, "--exit", "--record", tmp_path / "file" / "in it")
    assert done.exit_code == 1
    assert "cannot be made" in done.stderr


@pytest.mark.parametrize(
    "options", [("--task", "juggle"), ("--port", "99999"), ("--fps", "0"), ("--juggle",)]
)
def test_a_wrong_command_line_is_told_as_such(video, options):
    assert live(video, *options).exit_code == 2


def test_a_camera_model_of_another_size_is_a_sentence(video, data_dir):
    model = data_dir / "vision" / "opencv" / "left_intrinsics.yml"
    done = live(video, *QUIET, "--exit", "--camera", model)
    assert done.exit_code == 1
    assert "is the calibration of images of 640x480 px, these are 320x240" in done.stderr


def test_poses_of_markers_are_recorded(video, tmp_path):
    write_camera(CAMERA, tmp_path / "camera.json", "json")
    done = live(
        video, *QUIET, "--exit", "--fast", "--json", "--record", tmp_path / "kept",
        "--camera", tmp_path / "camera.json", "--size", "60mm", "--dictionary", "4x4_50",
    )  # fmt: skip
    assert done.exit_code == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["tasks"]["markers"] == {"dictionary": "4x4_50", "ids": [3, 7]}
    table = (next((tmp_path / "kept").iterdir()) / "markers.csv").read_text(encoding="utf-8").splitlines()
    rows = [dict(zip(table[0].split(","), line.split(","), strict=True)) for line in table[1:]]
    assert len(rows) == 40
    assert all(0.3 < float(row["z_m"]) < 0.5 and float(row["sigma_z_m"]) > 0 for row in rows)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--height", "20cm"), "takes --height and --pitch together"),
        (("--board", "9"), "columns x rows"),
        (("--size", "50"), "did you mean 50mm?"),
        (("--resolution", "640"), "a resolution is written as 640x480, got '640'"),
    ],
)
def test_options_that_make_no_sense_are_told(video, options, words):
    done = live(video, *QUIET, *options)
    assert done.exit_code == 2
    assert words in " ".join(done.stderr.split())
