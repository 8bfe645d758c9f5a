"""Other boards than the checkerboard, and videos, through the command."""

import re

import cv2
import numpy as np
import pytest
from camera_photos import OPTIONS, TRUTH, answer, photographed, run

from factorlab.camera import held_pictures, open_pictures
from sequential.errors import DataError
from vision3d.boards import CharucoBoard, CircleGrid, MarkerBoard

CHARUCO = ("--board", "8x6", "--kind", "charuco", "--square", "30mm", "--marker", "22mm")
BOARDS = {
    "charuco": (CharucoBoard(8, 6, 0.030, 0.022), CHARUCO),
    "legacy": (CharucoBoard(8, 6, 0.030, 0.022, legacy=True), CHARUCO),
    "circles": (CircleGrid(9, 7, 0.030), ("--board", "9x7", "--kind", "circles", "--square", "30mm")),
    "markers": (
        MarkerBoard.grid(5, 4, 0.035, 0.010, "4x4_50"),
        ("--board", "5x4", "--kind", "markers", "--square", "35mm", "--marker", "10mm"),
    ),
    "acircles": (
        CircleGrid(4, 11, 0.020, asymmetric=True),
        ("--board", "4x11", "--kind", "acircles", "--square", "20mm"),
    ),
}


@pytest.mark.parametrize("name", BOARDS)
def test_every_kind_of_board_finds_the_camera(name, tmp_path):
    board, options = BOARDS[name]
    photos = photographed(tmp_path, 6, seed=3, board=board)
    found = answer(*photos.paths, *options, "--lens", "brown5", "--no-next-pose")
    assert found["views"]["used"] == 6
    assert found["rms_px"] < 0.05
    for key, truth in zip(("fx", "fy", "cx", "cy"), TRUTH.intrinsics, strict=True):
        assert abs(found["camera"]["parameters"][key] - truth) < 5.0 * found["camera"]["std"][key], key


def test_a_mirrored_charuco_board_is_told(tmp_path):
    board, options = BOARDS["charuco"]
    photos = photographed(tmp_path, 4, seed=3, board=board)
    for path in photos.paths:
        cv2.imwrite(str(path), cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)[:, ::-1])
    done = run(*photos.paths, *options, "--lens", "brown2", "--no-next-pose")
    assert "mirror" in done.stdout + done.stderr


@pytest.fixture(scope="module")
def video(photos, tmp_path_factory):
    """The photographs as a video: each three times, twice of it out of focus."""
    path = tmp_path_factory.mktemp("video") / "board.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, TRUTH.size)
    for image in photos.rendered.images:
        soft = cv2.GaussianBlur(np.array(image), (0, 0), 3.0)
        for one in (soft, np.array(image), soft):
            writer.write(cv2.cvtColor(one, cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


def test_the_sharpest_frames_of_a_video_are_taken(video):
    pictures = open_pictures([str(video)], frames=10)
    assert [name for name, _ in pictures] == [f"board.avi frame {3 * k + 1}" for k in range(10)]
    assert pictures.size == TRUTH.size


def test_a_video_is_a_set_of_pictures(video):
    found = answer(video, *OPTIONS, "--frames", "10", "--lens", "brown5", "--no-next-pose")
    assert found["views"]["used"] == 10
    assert abs(found["camera"]["parameters"]["fx"] - TRUTH.intrinsics[0]) < 1.0


def test_a_video_of_another_size_is_no_part_of_the_set(photos, video, tmp_path):
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), np.zeros((240, 320), np.uint8))
    with pytest.raises(DataError, match=re.escape("320x240 and 640x480")):
        open_pictures([str(small), str(video)])
    assert len(open_pictures([str(photos.paths[0]), str(video)], frames=10)) == 11


def test_held_pictures_have_one_size():
    black = np.zeros((48, 64), np.uint8)
    assert held_pictures([("a", black), ("b", black)]).size == (64, 48)
    with pytest.raises(DataError, match="one size, got 32x24, 64x48"):
        held_pictures([("a", black), ("b", black[::2, ::2])])
    with pytest.raises(DataError, match="got none"):
        held_pictures([])
