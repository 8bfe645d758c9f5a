"""Recordings: every frame, true times, whole lines, and nothing lost when something breaks."""

import csv
import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from live_worlds import wait_for

from factorlab.live.camera.reader import Captured
from factorlab.live.camera.reading import Number, Reading, Table
from factorlab.live.camera.recording import Recording
from sequential.errors import DataError
from vision3d.frames import Frame, open_frames


def frame(k):
    return Captured(
        Frame(k, 40_000_000 * k, np.full((64, 96, 3), 5 * k % 250, np.uint8), f"frame {k}"), 10**9 + k
    )


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_what_is_recorded_is_read_back(tmp_path):
    recording = Recording(tmp_path / "a", (96, 64), 25.0, wait=True)
    for k in range(30):
        recording.add_frame(frame(k))
        reading = Reading("two", rows=({"id": 3, "x": 0.1 * k}, {"id": 4, "x": None, "word": 'a "b", c'}))
        recording.add_reading(frame(k), "markers", ("id", "x", "word"), reading)
    recorded = recording.close()
    assert (recorded.frames, recorded.readings, recorded.lost, recorded.fault) == (30, 30, 0, "")
    assert recorded.duration_s == pytest.approx(29 / 25)
    images = list(open_frames(tmp_path / "a" / "video.avi"))
    assert [round(one.image.mean() / 5) for one in images] == list(range(30))
    assert [float(row["t_s"]) for row in rows_of(tmp_path / "a" / "frames.csv")] == pytest.approx(
        np.arange(30) / 25
    )
    rows = rows_of(tmp_path / "a" / "markers.csv")
    assert len(rows) == 60
    assert rows[10] == {"frame": "5", "t_s": "0.2", "id": "3", "x": "0.5", "word": ""}
    assert rows[11] == {"frame": "5", "t_s": "0.2", "id": "4", "x": "", "word": 'a "b", c'}
    lines = (tmp_path / "a" / "readings.jsonl").read_text(encoding="utf-8").splitlines()
    assert [json.loads(line)["frame"] for line in lines] == list(range(30))
    assert recording.close() == recorded
    assert not list((tmp_path / "a").glob("*.part"))


def test_a_reading_of_anything_is_strict_json(tmp_path):
    recording = Recording(tmp_path / "a", (96, 64), 25.0)
    reading = Reading(
        "odd",
        numbers=(Number("x", float("nan")), Number("n", np.float64(2.0), sigma=float("inf"))),
        tables=(Table("t", (), ((np.int64(3), np.float32(0.5), None, "word"),)),),
        traces={"a": np.nan, "b": np.float32(1.0)},
        panel={"points": np.arange(4.0).reshape(2, 2)},
    )
    recording.add_reading(frame(0), "odd", (), reading)
    recording.close()

    def refuse(name):
        raise ValueError(name)

    line = json.loads((tmp_path / "a" / "readings.jsonl").read_text(encoding="utf-8"), parse_constant=refuse)
    assert line["numbers"][0]["value"] is None
    assert line["panel"]["points"] == [[0.0, 1.0], [2.0, 3.0]]
    assert line["tables"][0]["rows"] == [[3, 0.5, None, "word"]]


def test_a_disk_that_is_too_slow_loses_frames_and_says_how_many(tmp_path, monkeypatch):
    recording = Recording(tmp_path / "a", (96, 64), 25.0)
    write = recording._write_frame
    monkeypatch.setattr(recording, "_write_frame", lambda one: (time.sleep(0.005), write(one)))
    for k in range(150):
        recording.add_frame(frame(k))
    recorded = recording.close()
    assert recorded.lost > 0
    assert recorded.frames + recorded.lost == 150


def test_a_disk_that_is_full_ends_the_recording_with_a_sentence(tmp_path, monkeypatch):
    recording = Recording(tmp_path / "a", (96, 64), 25.0, wait=True)
    write = recording._write_frame

    def full(one):
        if one.frame.index == 7:
            raise OSError(28, "No space left on device")
        write(one)

    monkeypatch.setattr(recording, "_write_frame", full)
    for k in range(200):  # more than the queue holds: nobody may wait for ever
        recording.add_frame(frame(k))
    recorded = recording.close()
    assert recorded.frames == 7
    assert "ended early" in recorded.fault
    assert "No space left" in recorded.fault
    assert len(rows_of(tmp_path / "a" / "frames.csv")) == 7


def test_a_folder_that_is_there_is_not_touched(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(DataError, match="there already"):
        Recording(tmp_path / "a", (96, 64), 25.0)
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot be made"):
        Recording(tmp_path / "file" / "a", (96, 64), 25.0)


def test_recordings_of_one_second_get_names_of_their_own(live, marker_video):
    session, _ = live(marker_video, loop=True)
    session.start()
    for count in range(1, 4):
        session.start_recording()
        assert session.start_recording() == session.recording.folder  # the same one
        time.sleep(0.1)
        session.stop_recording()
        assert len({one.folder for one in session.recorded}) == count
    assert all(one.frames for one in session.recorded)


KILLED = """
import sys, time
from pathlib import Path
import numpy as np
from factorlab.live.camera.reader import Captured
from factorlab.live.camera.reading import Reading
from factorlab.live.camera.recording import Recording
from vision3d.frames import Frame
recording = Recording(Path(sys.argv[1]), (96, 64), 25.0)
rng = np.random.default_rng(0)
for k in range(10**6):
    image = rng.integers(0, 255, (64, 96, 3), dtype=np.uint8)
    captured = Captured(Frame(k, 40_000_000 * k, image, ""), time.monotonic_ns())
    recording.add_frame(captured)
    recording.add_reading(captured, "markers", ("id",), Reading("", rows=({"id": k},)))
    time.sleep(0.01)
"""


def test_a_program_that_is_killed_leaves_what_came_before(tmp_path):
    folder = tmp_path / "a"
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(folder)])
    wait_for((folder / "markers.csv.part").exists, 30)
    time.sleep(2.5)
    process.send_signal(signal.SIGKILL)
    process.wait()
    for name in ("frames.csv.part", "markers.csv.part", "readings.jsonl.part"):
        text = (folder / name).read_text(encoding="utf-8")
        assert text.endswith("\n")
        assert len(text.splitlines()) > 80
    assert len(list(open_frames(folder / "video.avi"))) > 80
