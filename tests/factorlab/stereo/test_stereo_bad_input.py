"""Bad input of the stereo commands: a sentence each, and nothing lost of what is good."""

import re
import shutil

import cv2
import numpy as np
import pytest
from stereo_photos import LEFT, OPTIONS, TRUTH, answer, calibrate, rectify

from vision3d.camera_files import write_camera
from vision3d.stereo import write_rig


def refused(pattern, done, code=1):
    """The command has stopped with one sentence that matches, and nothing on stdout."""
    __tracebackhide__ = True
    assert done.exit_code == code, (done.stdout, done.stderr)
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert re.search(pattern, done.stderr, re.DOTALL), done.stderr
    if code == 1:
        assert re.search(pattern, done.stderr.strip().splitlines()[-1]), done.stderr


@pytest.fixture
def copies(pairs, tmp_path):
    """Four pairs in a folder of the test's own: patterns of the left and of the right pictures."""
    for path in (*pairs.left[:4], *pairs.right[:4]):
        shutil.copy(path, tmp_path / path.name)
    return tmp_path / "left*.png", tmp_path / "right*.png"


def test_nothing_to_read(tmp_path, copies):
    refused("no image matches", calibrate(tmp_path / "nothing*.png", copies[1], *OPTIONS))
    refused("only one was given", calibrate(copies[0], *OPTIONS), code=2)
    refused(
        "no board|expected|COLSxROWS|9by6", calibrate(*copies, "--board", "9by6", "--square", "25mm"), code=2
    )


def test_the_same_pictures_twice(copies, tmp_path):
    refused("is among the left and among the right", calibrate(copies[0], copies[0], *OPTIONS))
    for path in tmp_path.glob("left*.png"):
        shutil.copy(path, path.with_name(path.name.replace("left", "right")))
    refused("left and right pictures are the same", calibrate(*copies, *OPTIONS))


def test_numbers_of_pictures_that_do_not_tell(tmp_path, pairs):
    for k, name in enumerate(("a", "b", "c")):
        shutil.copy(pairs.left[k], tmp_path / f"one_{name}.png")
    for k, name in enumerate(("x", "y")):
        shutil.copy(pairs.right[k], tmp_path / f"two_{name}.png")
    refused(
        "3 left and 2 right pictures, and their names",
        calibrate(tmp_path / "one*.png", tmp_path / "two*.png", *OPTIONS),
    )


def test_a_board_on_one_side_only(copies, tmp_path):
    blank = np.full((480, 640), 120, np.uint8)
    for k, path in enumerate(sorted(tmp_path.glob("right*.png"))):
        blank[0, k] = 0
        cv2.imwrite(str(path), blank)
    refused("none of the 4 right pictures shows a 9x6", calibrate(*copies, *OPTIONS))


def test_boards_never_seen_by_both(pairs, tmp_path):
    blank = np.full((480, 640), 120, np.uint8)
    for k in range(8):
        shutil.copy(pairs.left[k], tmp_path / f"left{k}.png")
        shutil.copy(pairs.right[k], tmp_path / f"right{k}.png")
        blank[0, k] = 0
        cv2.imwrite(str(tmp_path / f"{'left' if k % 2 else 'right'}{k}.png"), blank)
    done = calibrate(tmp_path / "left*.png", tmp_path / "right*.png", *OPTIONS, "--lens", "brown2")
    refused("both show the board, got 0 of 8", done)


def test_too_few_pairs(pairs, tmp_path):
    for path in (*pairs.left[:2], *pairs.right[:2]):
        shutil.copy(path, tmp_path / path.name)
    done = calibrate(tmp_path / "left*.png", tmp_path / "right*.png", *OPTIONS)
    refused("at least 3 views of the board, got 2", done)


def test_a_damaged_picture_costs_its_pair_alone(pairs, tmp_path):
    for path in (*pairs.left[:6], *pairs.right[:6]):
        shutil.copy(path, tmp_path / path.name)
    (tmp_path / "right03.png").write_bytes(b"no picture")
    done = calibrate(tmp_path / "left*.png", tmp_path / "right*.png", *OPTIONS, "--lens", "brown2", "--json")
    assert answer(done)["pairs"]["used"] == 5
    assert "right03.png: cannot be read as a picture" in done.stderr


def test_pairs_of_different_moments(pairs, tmp_path):
    for k in range(8):
        shutil.copy(pairs.left[k], tmp_path / f"left{k}.png")
        shutil.copy(pairs.right[(k + 3) % 8], tmp_path / f"right{k}.png")
    done = calibrate(tmp_path / "left*.png", tmp_path / "right*.png", *OPTIONS, "--lens", "brown4")
    refused("the 8 pairs do not belong together", done)


def test_a_video_and_pictures(copies, tmp_path):
    (tmp_path / "film.avi").write_bytes(b"RIFF")
    refused("one side is a video", calibrate(tmp_path / "film.avi", copies[1], *OPTIONS))


def test_a_camera_of_another_size(copies, tmp_path):
    path = write_camera(LEFT.resized((320, 240)), tmp_path / "small.json")
    refused("camera of 320x240 pixels", calibrate(*copies, *OPTIONS, "--left-camera", path))


def test_what_rectify_refuses(copies, tmp_path):
    out = tmp_path / "out"
    rig = write_rig(tmp_path / "rig.json", TRUTH)
    refused("there is no file", rectify(*copies, "--calib", tmp_path / "no.json", "-o", out))
    refused("is no stereo rig", rectify(*copies, "--calib", _written(tmp_path / "x.yaml", "a: 1"), "-o", out))
    refused("is no size", rectify(*copies, "--calib", rig, "--size", "big", "-o", out), code=2)
    out.mkdir()
    (out / "mine.txt").write_text("mine")
    refused("already holds files", rectify(*copies, "--calib", rig, "-o", out))
    cut = write_rig(tmp_path / "cut.json", TRUTH.resized((640, 400)))
    refused("they were cut, or are another camera", rectify(*copies, "--calib", cut, "-o", tmp_path / "new"))


def _written(path, text):
    path.write_text(text)
    return path


def test_a_damaged_picture_costs_its_rectified_pair_alone(copies, tmp_path):
    (tmp_path / "left01.png").write_bytes(b"no picture")
    cv2.imwrite(str(tmp_path / "right03.png"), np.zeros((1, 1), np.uint8))
    rig = write_rig(tmp_path / "rig.json", TRUTH)
    done = rectify(*copies, "--calib", rig, "-o", tmp_path / "out", "--json")
    assert [one["name"] for one in answer(done)["pairs"]] == ["left02.png", "left04.png"]
    assert "left01.png" in done.stderr
    assert "the right image is 1x1 px" in done.stderr
    (tmp_path / "left02.png").write_bytes(b"")
    (tmp_path / "left04.png").unlink()
    (tmp_path / "left03.png").write_bytes(b"")
    refused("cannot be read as a picture", rectify(*copies, "--calib", rig, "-o", tmp_path / "other"))
