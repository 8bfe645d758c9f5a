"""Bad input of `factorlab calibrate camera`: a sentence each, and nothing lost of what is good."""

import json
import re
import shutil

import cv2
import numpy as np
import pytest
from camera_photos import OPTIONS, TRUTH, photographed, run

from vision3d.boards import Checkerboard
from vision3d.render import board_poses


def refused(pattern, *arguments, code=1):
    """The command stops with one sentence that matches, and writes nothing on stdout."""
    __tracebackhide__ = True
    done = run(*arguments)
    assert done.exit_code == code, (done.stdout, done.stderr)
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert re.search(pattern, done.stderr, re.DOTALL), done.stderr
    if code == 1:
        last = done.stderr.strip().splitlines()[-1]
        assert last.startswith("error: ")
        assert re.search(pattern, last), last


def used(*arguments):
    """What the command says when it ends well, and its stderr."""
    __tracebackhide__ = True
    done = run(*arguments, *OPTIONS, "--json")
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout), done.stderr


@pytest.fixture
def copies(photos, tmp_path):
    """The photographs in a folder of the test's own."""
    folder = tmp_path / "own"
    folder.mkdir()
    return [shutil.copy(path, folder / path.name) for path in photos.paths]


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("nothing.png", "there is no file.*nothing.png"),
        ("nothing*.png", r"no image matches .*nothing\*.png"),
        ("empty", "no image in the folder"),
        ("notes.txt", "picture"),
        ("movie.avi", "movie.avi"),
    ],
)
def test_nothing_to_read(tmp_path, source, said):
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").write_text("not a picture", encoding="utf-8")
    (tmp_path / "movie.avi").write_bytes(b"RIFF, but no more than that")
    refused(said, tmp_path / source, *OPTIONS)


def test_a_bad_file_is_named_and_the_others_count(copies):
    copies[0].write_bytes(b"")
    copies[1].write_bytes(copies[1].read_bytes()[:2000])
    copies[2].write_text("not a picture", encoding="utf-8")
    found, said = used(*copies)
    assert found["views"]["used"] == 7
    for path in copies[:3]:
        assert path.name in said
        assert path.name in found["views"]["left_out"]


def test_a_picture_of_another_size_is_named(copies):
    for path, change in ((copies[0], lambda image: image[::2, ::2]), (copies[1], lambda image: image.T)):
        cv2.imwrite(str(path), np.ascontiguousarray(change(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))))
    found, said = used(*copies)
    assert found["views"]["used"] == 8
    assert re.search(r"view01.png.*320x240.*640x480", said)
    assert re.search(r"view02.png.*480x640.*turned", said)


def test_two_cameras_are_not_one(copies):
    for path in copies[:5]:
        cv2.imwrite(str(path), cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)[:400])
    refused("different sizes.*640x4[08]0.*640x4[08]0", *copies, *OPTIONS)


def test_the_same_picture_counts_once(copies):
    shutil.copy(copies[3], copies[3].with_name("again.png"))
    found, said = used(copies[0].parent)
    assert found["views"]["used"] == 10
    assert "same picture" in said


def test_no_board_at_all(tmp_path, rng):
    for k in range(4):
        cv2.imwrite(str(tmp_path / f"{k}.png"), rng.integers(0, 255, (120, 160), dtype=np.uint8))
    refused("none of 4 pictures.*9x6", tmp_path, *OPTIONS)


def test_a_picture_without_board_is_named(copies):
    blank = np.full((480, 640), 128, np.uint8)
    cv2.imwrite(str(copies[4]), blank)
    found, said = used(*copies)
    assert found["views"]["used"] == 9
    assert copies[4].name in said
    assert copies[4].name in found["views"]["left_out"]


@pytest.mark.parametrize("wrong", ["8x6", "9x7", "10x7"])
def test_the_wrong_board_is_told_from_what_is_seen(photos, wrong):
    refused("9x6", *photos.paths[:2], "--board", wrong, "--square", "25mm")


def test_too_few_views(photos):
    refused(r"at least 3.*got 2", *photos.paths[:2], *OPTIONS)


def test_views_that_are_all_parallel_say_what_is_missing(tmp_path, rng):
    poses = board_poses(TRUTH, Checkerboard(9, 6, 0.025), 5, rng, tilt_rad=(0.0, 0.001))
    poses[:, :4] = (1.0, 0.0, 0.0, 0.0)
    parallel = photographed(tmp_path, 5, poses=poses)
    refused("focal length.*tilted", *parallel.paths, *OPTIONS)


def test_pictures_that_are_mirrored_against_the_others_are_told(tmp_path):
    odd = photographed(tmp_path, 8, seed=5, board=Checkerboard(7, 5, 0.03))
    for path in odd.paths[:3]:
        cv2.imwrite(str(path), cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)[:, ::-1])
    done = run(*odd.paths, "--board", "7x5", "--square", "30mm", "--no-next-pose")
    assert done.exit_code == 0
    assert "view01.png, view02.png, view03.png are mirrored" in done.stderr
    assert "mirrored" in done.stdout


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--board", "nine by six", "--square", "25mm"), "columns x rows"),
        (("--board", "9x6", "--square", "25"), "25mm"),
        (("--board", "9x1", "--square", "25mm"), "at least 2"),
        (("--board", "9x6", "--square", "25mm", "--marker", "18mm"), "goes with --kind charuco"),
        (("--board", "9x6", "--square", "25mm", "--lens", "brown6"), "brown6"),
        (("--board", "9x6"), "--square"),
        (("--board", "5x7", "--kind", "charuco", "--square", "30mm", "--marker", "40mm"), "does not fit"),
    ],
)
def test_a_wrong_command_line(photos, options, said):
    refused(said, photos.folder, *options, code=2)


@pytest.mark.parametrize("content", [None, "", "camera: yes", '{"schema": 1}'])
def test_a_file_to_compare_with_is_looked_at_first(photos, tmp_path, content):
    other = tmp_path / "other.yaml"
    if content is not None:
        other.write_text(content, encoding="utf-8")
    refused("other.yaml", photos.folder, *OPTIONS, "--compare", other)
