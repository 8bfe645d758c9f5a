"""OpenCV's images of its own board: all found, and the window of its tutorial is told to be too large."""

import cv2
import pytest

from vision3d.boards import Checkerboard
from vision3d.calibrate import calibrate
from vision3d.calibrate.detection import detect_views

BOARD = Checkerboard(9, 6, 0.025)


def images(data_dir, side):
    files = sorted((data_dir / "vision" / "opencv").glob(f"{side}??.jpg"))
    return [(file.name, cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)) for file in files]


@pytest.mark.parametrize("side", ["left", "right"])
def test_all_views_are_found_and_fit_a_camera(data_dir, side):
    detections = detect_views(images(data_dir, side), BOARD)
    assert (len(detections.views), detections.missed) == (13, ())
    assert calibrate(detections.views, "brown5").rms_px < 0.17


def test_the_window_of_the_tutorial_is_flagged(data_dir):
    detections = detect_views(images(data_dir, "left"), BOARD, window=11)
    audits = {audit.name: audit for audit in detections.audits}
    assert audits["left02.jpg"].window_too_large
    assert len(audits["left02.jpg"].moved) >= 5
    assert audits["left02.jpg"].moved[0][1] > 4.0
    assert "too large in" in detections.findings[0]
    assert 0.38 < calibrate(detections.views, "brown5", robust=False).rms_px < 0.43
