"""Calibration as it goes: views where the board rests, each pose once, and a camera that is the true one."""

import json

import cv2
import numpy as np
import pytest
from live_worlds import wait_for

from factorlab.live.camera import TaskSettings, task_choices
from factorlab.live.camera.tasks.board_watch import BoardWatch, motion, quick_corners
from factorlab.live.camera.tasks.calibrate import CalibrateTask
from sequential.errors import DataError
from vision3d.boards import CharucoBoard, Checkerboard, CircleGrid
from vision3d.camera import Camera
from vision3d.frames import Frame
from vision3d.render import board_pixels, board_planes, board_poses, render_planes

CAMERA = Camera("brown4", [330.0, 331.0, 158.0, 121.0], [-0.2, 0.05, 0.001, 0.0], (320, 240))
BOARD = Checkerboard(7, 5, 0.03)
BOARDS = [BOARD, CharucoBoard(6, 5, 0.03, 0.022, "4x4_50"), CircleGrid(7, 5, 0.03)]
POSES = 8


def picture(pose, rng, board=BOARD):
    return render_planes(CAMERA, board_planes(board, pose), rng=rng, supersample=2, noise=1.0)


def frame(k, image):
    return Frame(k, round(k * 1e9 / 25), cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), f"frame {k}")


@pytest.fixture(scope="module")
def held():
    """Poses, and an image of the board in each."""
    rng = np.random.default_rng(11)
    poses = board_poses(CAMERA, BOARD, POSES, rng)
    return poses, [picture(pose, rng) for pose in poses]


@pytest.fixture
def task(tmp_path):
    made = CalibrateTask(BOARD, "brown4", tmp_path, "factorlab live camera")
    yield made
    made.close()


def hold(task, images, each=9):
    """Show each image for a while; the last reading."""
    reading = None
    for k, image in enumerate(image for image in images for _ in range(each)):
        reading = task.read(frame(k, image))
    wait_for(lambda: not task.desk.now.busy)
    return reading


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.kind)
def test_a_board_is_seen_in_milliseconds_to_a_pixel(board, rng):
    pose = board_poses(CAMERA, board, 1, rng, tilt_rad=(0.2, 0.4))[0]
    ids, pixels = quick_corners(picture(pose, rng, board), board)
    truth = board_pixels(CAMERA, board, pose)
    assert len(ids) >= 0.9 * board.count
    every = np.arange(board.count)
    assert motion(every, truth, ids, pixels) < 1.0
    nothing = np.full((240, 320), 128, np.uint8)
    assert len(quick_corners(nothing, board)[0]) == 0


def test_each_pose_is_taken_once_and_the_camera_is_the_true_one(task, held):
    _, images = held
    hold(task, images)
    standing = task.desk.now
    assert len(standing.views) == POSES
    assert len(list(task.desk.folder.glob("pictures/*.png"))) == POSES
    fit = standing.calibration
    off = (fit.camera.intrinsics - CAMERA.intrinsics) / fit.std[:4]
    assert np.abs(off).max() < 4.5
    assert fit.rms_px < 0.2
    hold(task, images[-1:])
    assert len(task.desk.now.views) == POSES


def test_a_board_that_moves_is_not_taken(task, rng):
    pose = board_poses(CAMERA, BOARD, 1, rng, tilt_rad=(0.0, 0.2), fill=(0.4, 0.5))[0]
    for k in range(20):
        image = picture(pose + np.array([0, 0, 0, 0, 0.002 * k, 0, 0]), rng)
        reading = task.read(frame(k, image))
        assert reading.headline in {"hold the board still", "move the board to another pose"}
    assert task.desk.now.views == ()


def test_the_page_hears_where_to_hold_the_board(task, held):
    hold(task, held[1][:5])
    reading = task.read(frame(500, held[1][4]))
    assert any(note.startswith("next: hold the board") for note in reading.notes)
    panel = reading.to_json()["panel"]
    assert len(panel["coverage"]["views"]) == 5
    assert len(panel["coverage"]["next"]) == 4
    assert {one["name"] for one in panel["meters"]} == {
        "image", "corners of the image", "tilts", "distances", "views"
    }  # fmt: skip
    assert [one.name for one in reading.numbers][:3] == ["views", "RMS", "projection, 1 σ"]
    assert reading.rows[0]["views"] == 5


def test_views_are_dropped_and_forgotten(task, held):
    hold(task, held[1][:5])
    task.act("drop")
    wait_for(lambda: not task.desk.now.busy)
    assert len(task.desk.now.views) == 4
    assert len(list(task.desk.folder.glob("pictures/*.png"))) == 4
    hold(task, held[1][4:5])
    assert len(task.desk.now.views) == 5  # the same pose may be taken again
    before = task.desk.folder
    task.act("clear")
    wait_for(lambda: not task.desk.now.busy)
    assert task.desk.now.views == ()
    assert len(list(before.glob("pictures/*.png"))) == 5  # what was captured stays


def test_a_report_is_written_and_offered_and_the_other_tasks_know_the_camera(held, tmp_path):
    settings = TaskSettings(board=BOARD, lens="brown4", folder=tmp_path, height_m=0.2, pitch_deg=40.0)
    tasks = {one.name: one.make() for one in task_choices(settings)}
    task = tasks["calibrate"]
    assert tasks["markers"].actions == ()
    hold(task, held[1])
    task.act("finish")
    task.close()  # which waits for what was asked for
    saved = task.desk.now.saved
    report = json.loads((saved.folder / "report" / "report.json").read_text(encoding="utf-8"))
    assert {"report.html", "report.json", "corners.csv"} <= set(report["files"])
    reading = task.read(frame(900, held[1][0]))
    assert set(reading.panel["files"]) <= set(report["files"])
    for name in reading.panel["files"]:
        assert task.file(name) == (saved.folder / "report" / name).read_bytes()
    assert task.file("../report.json") is None
    assert reading.tables[0].title == "The report's verdicts"
    assert task.summary()["saved"] == str(saved.folder)
    for name in ("markers", "line"):
        tasks[name].restart()  # as a session does where it is chosen
    assert dict(tasks["markers"].actions).keys() == {"forget"}
    assert tasks["line"]._ground.camera.lens == "brown4"


def test_what_cannot_be_done_is_a_sentence(task, held):
    assert dict(task.actions).keys() == {"take"}
    with pytest.raises(DataError, match="no frame yet"):
        task.act("take")
    task.read(frame(0, np.full((240, 320), 90, np.uint8)))
    task.act("take")
    wait_for(lambda: not task.desk.now.busy)
    assert "view was not kept: no " in task.desk.now.fault
    task.act("finish")
    wait_for(lambda: not task.desk.now.busy)
    assert task.desk.now.fault == "a calibration takes 3 views at least"
    with pytest.raises(DataError, match="has no action 'jump'"):
        task.act("jump")


def test_parallel_views_say_which_pose_is_missing(task, rng):
    fronto = [
        picture(np.array([1.0, 0, 0, 0, x, y, z]), rng)
        for x, y, z in ((-0.15, -0.1, 0.45), (-0.05, -0.05, 0.4), (-0.12, 0.0, 0.5))
    ]
    reading = hold(task, fronto)
    reading = task.read(frame(99, fronto[-1]))
    assert "tilt" in " ".join(reading.notes)


def test_a_disk_that_is_full_is_told(task, held, monkeypatch):
    def full(name, picture):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(task.desk, "_write", full)
    hold(task, held[1][:1])
    assert "No space left" in task.desk.now.fault
    assert task.desk.now.views == ()


def test_the_first_frames_of_a_watch_are_not_still(held):
    watch = BoardWatch(BOARD)
    seen = [watch.look(frame(k, held[1][0])) for k in range(10)]
    assert not seen[0].still
    assert seen[0].speed_px_s == np.inf
    assert seen[-1].still
    assert watch.look(frame(11, np.zeros((240, 320), np.uint8))) is None
    assert not watch.look(frame(12, held[1][0])).still


def test_in_the_browser(window, live, held, tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    for k, image in enumerate(image for image in held[1][:4] for _ in range(9)):
        cv2.imwrite(str(folder / f"{k}.png"), image)
    settings = TaskSettings(board=BOARD, lens="brown2", folder=tmp_path / "kept")
    session, server = live(folder, "calibrate", settings=settings)
    window.visit(server.address)
    session.start()
    window.until("document.querySelectorAll('.coverage polygon').length === 5", 30)
    window.until("badge.textContent === 'ended' && !notes.textContent.includes('…')", 30)
    window.click("#actions button:first-child")
    window.until("document.querySelectorAll('.files a').length > 1", 60)
    assert "saved to" in window.run("notes.textContent")
    found = window.run("fetch('/files/report.html').then((answer) => answer.text())")
    assert found.startswith("<!DOCTYPE html>")


@pytest.mark.parametrize("board", BOARDS[1:], ids=lambda board: board.kind)
def test_other_boards_are_taken_as_well(board, tmp_path, rng):
    task = CalibrateTask(board, "brown2", tmp_path)
    try:
        poses = board_poses(CAMERA, board, 5, rng, tilt_rad=(0.3, 0.7), fill=(0.4, 0.85))
        hold(task, [picture(pose, rng, board) for pose in poses])
        standing = task.desk.now
        assert len(standing.views) >= 4, standing.fault
        assert standing.calibration.camera.intrinsics[:2] == pytest.approx(CAMERA.intrinsics[:2], rel=0.03)
    finally:
        task.close()


def test_photographs_of_a_folder_are_views_at_once(live, data_dir, tmp_path):
    """OpenCV's left01-14: every picture is taken, and the camera is that of factorlab calibrate camera."""
    settings = TaskSettings(board=Checkerboard(9, 6, 0.025), lens="brown5", folder=tmp_path)
    pictures = f"{data_dir}/vision/opencv/left*.jpg"
    session, _ = live(pictures, "calibrate", settings=settings)
    session.start()
    wait_for(lambda: session.ended and not session.task.desk.now.busy)
    standing = session.task.desk.now
    assert len(standing.views) == 13
    assert standing.calibration.rms_px < 0.2
    assert standing.calibration.camera.intrinsics[0] == pytest.approx(533, abs=2)
