"""Asked for one kind of board and shown another: the first image says which."""

import numpy as np
import pytest

from vision3d.boards import CharucoBoard, Checkerboard, CircleGrid, MarkerBoard
from vision3d.calibrate.detection import detect_views
from vision3d.camera import Camera
from vision3d.render import render_set

CAMERA = Camera(
    "brown5",
    np.array([533.0, 533.0, 342.0, 234.0]),
    np.array([-0.28, 0.02, 0.0012, -0.0001, 0.16]),
    (640, 480),
)
CHECKERS, CHARUCO = Checkerboard(9, 6, 0.025), CharucoBoard(7, 5, 0.03, 0.022)
CIRCLES, ASYMMETRIC = CircleGrid(7, 5, 0.03), CircleGrid(4, 11, 0.02, asymmetric=True)


@pytest.mark.parametrize(
    ("shown", "asked", "said"),
    [
        (CHECKERS, CIRCLES, "a checkerboard: try --kind checkerboard --board 9x6"),
        (CHECKERS, CHARUCO, "a checkerboard: try --kind checkerboard --board 9x6"),
        (CHARUCO, CIRCLES, "markers of 4x4_50: a ChArUco board?"),
        (CIRCLES, ASYMMETRIC, "a grid of circles: try --kind circles --board 7x5"),
        (ASYMMETRIC, CIRCLES, "an asymmetric grid of circles: try --kind acircles --board 4x11"),
        (CIRCLES, MarkerBoard.grid(3, 3, 0.03, 0.01), "a grid of circles: try --kind circles --board 7x5"),
    ],
    ids=lambda value: value if isinstance(value, str) else value.kind,
)
def test_the_kind_of_board_is_told(shown, asked, said):
    rendered = render_set(CAMERA, shown, 1, np.random.default_rng(4))
    detections = detect_views(rendered.named(), asked)
    assert detections.views == ()
    assert said in detections.findings[0]
