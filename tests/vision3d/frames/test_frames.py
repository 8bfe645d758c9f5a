"""Cameras, videos and folders give the same kind of frames, and end in a sentence where they break off."""

import cv2
import numpy as np
import pytest

from sequential.errors import DataError, FileFormatError
from vision3d.frames import CameraLostError, open_frames

SIZE = (96, 64)


def picture(k):
    """A frame that says which it is by its brightness, which JPEG keeps."""
    return np.full((SIZE[1], SIZE[0], 3), 10 * (k + 1), np.uint8)


def number(frame):
    return round(frame.image.mean() / 10) - 1


def write_video(path, images):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 25.0, SIZE)
    for image in images:
        writer.write(image)
    writer.release()
    return path


@pytest.fixture
def video(tmp_path):
    return write_video(tmp_path / "drive.avi", map(picture, range(12)))


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "frames"
    place.mkdir()
    for k in range(12):
        cv2.imwrite(str(place / f"frame{k}.png"), picture(k))
    return place


@pytest.mark.parametrize("source", ["video", "folder"])
def test_frames_come_in_order_once(source, request):
    with open_frames(request.getfixturevalue(source)) as frames:
        assert (frames.size, frames.count, frames.live) == (SIZE, 12, False)
        taken = list(frames)
    assert [number(frame) for frame in taken] == list(range(12))
    assert [frame.index for frame in taken] == list(range(12))
    assert np.diff([frame.t_ns for frame in taken]) == pytest.approx(1e9 / frames.fps, abs=1e6)
    assert all(not frame.image.flags.writeable and frame.grey.shape == SIZE[::-1] for frame in taken)
    assert frames.fault == ""


@pytest.mark.parametrize("source", ["video", "folder"])
def test_a_loop_goes_on_in_time(source, request):
    with open_frames(request.getfixturevalue(source), loop=True) as frames:
        taken = [frame for frame, _ in zip(frames, range(30), strict=False)]
    assert [number(frame) for frame in taken] == [k % 12 for k in range(30)]
    assert [frame.index for frame in taken] == list(range(30))
    assert np.diff([frame.t_ns for frame in taken]) == pytest.approx(1e9 / frames.fps, abs=1e6)


def test_names_of_files_may_be_their_times(tmp_path):
    for stamp in ("1403636579763555584", "1403636579813555456", "1403636579863555584"):
        cv2.imwrite(str(tmp_path / f"{stamp}.png"), picture(1))
    frames = open_frames(tmp_path)
    assert [frame.t_ns for frame in frames] == [0, 49_999_872, 100_000_000]
    assert frames.fps == pytest.approx(20.0)


def test_a_pattern_takes_what_it_matches(folder):
    assert [number(frame) for frame in open_frames(f"{folder}/frame1*.png")] == [1, 10, 11]
    assert [number(frame) for frame in open_frames(f"{folder.parent}/*/frame[23].png")] == [2, 3]


def test_one_image_is_a_short_video(folder):
    assert [number(frame) for frame in open_frames(folder / "frame7.png")] == [7]


def test_grey_sixteen_bits_and_alpha_become_colour(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), np.full((64, 96), 257 * 40, np.uint16))
    cv2.imwrite(str(tmp_path / "b.png"), np.full((64, 96, 4), 40, np.uint8))
    cv2.imwrite(str(tmp_path / "c.png"), np.full((64, 96), 40, np.uint8))
    for frame in open_frames(tmp_path):
        assert (frame.image == np.full((64, 96, 3), 40, np.uint8)).all()


def test_a_bad_image_is_named_and_left_out(folder):
    (folder / "frame3.png").write_bytes(b"no image")
    cv2.imwrite(str(folder / "frame5.png"), np.zeros((10, 20, 3), np.uint8))
    frames = open_frames(folder)
    assert [number(frame) for frame in frames] == [0, 1, 2, 4, 6, 7, 8, 9, 10, 11]
    assert [("frame3" in one, "frame5" in one) for one in frames.left_out] == [(True, False), (False, True)]
    assert "20x10" in frames.left_out[1]


def test_a_video_that_was_cut_says_so(tmp_path, rng):
    noise = rng.integers(0, 255, (60, SIZE[1], SIZE[0], 3), dtype=np.uint8)
    whole = write_video(tmp_path / "whole.avi", noise)
    cut = tmp_path / "cut.avi"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    frames = open_frames(cut)
    taken = list(frames)
    assert 20 < len(taken) < 40
    assert f"ends after {len(taken)} of 60 frames" in frames.fault


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda p: p / "drvie.avi", DataError, "did you mean"),
        (lambda p: p / "empty", DataError, "no image in the folder"),
        (lambda p: f"{p}/left*.jpg", DataError, "no image matches"),
        (lambda p: p / "text.avi", FileFormatError, "no frame of a video"),
        (lambda p: p / "bad", FileFormatError, "none of the 1 images"),
        (lambda _: "77", CameraLostError, "there is no camera 77"),
    ],
)
def test_bad_sources_are_sentences(tmp_path, make, error, words):
    write_video(tmp_path / "drive.avi", map(picture, range(2)))
    for name in ("empty", "bad"):
        (tmp_path / name).mkdir()
    (tmp_path / "bad" / "x.png").write_text("no image")
    (tmp_path / "text.avi").write_text("no video\n" * 100)
    with pytest.raises(error, match=words):
        open_frames(make(tmp_path))


class Unplugged:
    """A camera of OpenCV that gives some frames and then no more."""

    frames = 7

    def __init__(self, index):
        self.left, self.open = self.frames, True

    def isOpened(self):  # noqa: N802 - OpenCV's name
        return self.open

    def read(self):
        self.left -= 1
        return (True, picture(3)) if self.left >= 0 else (False, None)

    def get(self, what):
        return 0.0

    def set(self, what, value):
        return False

    def release(self):
        self.open = False


def test_a_camera_that_is_unplugged_ends_with_a_sentence(monkeypatch):
    monkeypatch.setattr(cv2, "VideoCapture", Unplugged)
    with open_frames("0") as frames:
        assert (frames.live, frames.size, frames.fps) == (True, SIZE, 30.0)
        taken = list(frames)
    assert len(taken) == 7
    assert frames.fault.startswith("camera 0 stopped giving frames after 7 (")
    assert (np.diff([frame.t_ns for frame in taken]) > 0).all()


def test_a_camera_that_is_let_go_has_no_fault(monkeypatch):
    monkeypatch.setattr(cv2, "VideoCapture", Unplugged)
    with open_frames("0") as frames:
        for frame in frames:
            if frame.index == 3:
                break
    assert frames.fault == ""


def test_a_camera_without_frames_is_not_opened(monkeypatch):
    monkeypatch.setattr(cv2, "VideoCapture", Unplugged)
    monkeypatch.setattr(Unplugged, "frames", 0)
    with pytest.raises(CameraLostError, match="camera 0 is there but gives no frame"):
        open_frames("0")


def test_photographs_are_told_from_frames(video, folder, tmp_path):
    assert all(frame.still for frame in open_frames(folder))
    assert not any(frame.still for frame in open_frames(video))
    for stamp in ("1305031102.175304", "1305031102.211214"):
        cv2.imwrite(str(tmp_path / f"{stamp}.png"), picture(1))
    assert not any(frame.still for frame in open_frames(f"{tmp_path}/*.png"))
