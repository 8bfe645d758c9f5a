"""From rendered images to a camera: the error is what the standard deviations say, detection included."""

import numpy as np
import pytest

from vision3d.boards import Checkerboard
from vision3d.calibrate import calibrate
from vision3d.calibrate.detection import detect_views
from vision3d.camera import Camera
from vision3d.render import render_set

CAMERA = Camera("brown5", (533.0, 533.0, 342.0, 234.0), (-0.28, 0.02, 0.0012, -0.0001, 0.16), (640, 480))
BOARD = Checkerboard(9, 6, square_m=0.025)


@pytest.mark.slow
def test_rendered_sets_give_the_camera_back_as_surely_as_stated(seeds):
    z = []
    for seed in range(len(seeds) // 5):
        rendered = render_set(CAMERA, BOARD, 13, np.random.default_rng(seed))
        found = calibrate(detect_views(rendered.named(), BOARD).views)
        assert len(found.views) == 13
        z.append((found.camera.parameters - CAMERA.parameters) / found.std)
    # χ² of nine correlated parameters over four sets and more
    assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.3
