"""The film of a drive."""

import cv2
import numpy as np
import pytest
from PIL import Image

from factorlab.l19.follower import FollowerSettings, simulate, write_film
from factorlab.l19.follower.film import frames
from sequential.errors import DataError


@pytest.fixture(scope="module")
def filmed():
    return simulate(FollowerSettings(noise=20.0), 12, keep_images=True)


def test_frames_show_map_and_camera(filmed):
    shown = list(frames(filmed, 4))
    assert [frame.shape for frame in shown] == [(360, 1020, 3)] * 3
    camera = shown[1][40:, 480:]
    grey = np.repeat(np.repeat(filmed.images[4], 9, axis=0), 9, axis=1)[40:]
    assert np.mean(camera == grey[..., None]) > 0.95, "all but two circles"


@pytest.mark.parametrize("ending", [".avi", ".gif"])
def test_files_hold_every_frame(filmed, ending, tmp_path):
    path = write_film(tmp_path / f"film{ending}", filmed, 3, faster=2.0)
    if ending == ".gif":
        with Image.open(path) as film:
            assert film.n_frames == 4
            assert film.info["duration"] in (70, 75, 80)  # ms; a GIF counts hundredths of a second
    else:
        film = cv2.VideoCapture(str(path))
        assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 4
        assert film.get(cv2.CAP_PROP_FPS) == pytest.approx(2.0 / 0.15, rel=1e-3)


def test_refuses_other_endings_and_drives_without_images(filmed, tmp_path):
    with pytest.raises(DataError, match="written as"):
        write_film(tmp_path / "film.mkv", filmed)
    with pytest.raises(DataError, match="keep_images"):
        list(frames(simulate(steps=3)))
