"""Images of a pixel or a few hold no board, and are told so rather than crash."""

import numpy as np
import pytest

from vision3d.boards import board_from_text
from vision3d.calibrate.detection import detect_views


@pytest.mark.parametrize("kind", ["checkerboard", "charuco", "circles", "markers"])
@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (15, 15), (16, 16)])
def test_tiny_images_show_no_board(kind, shape):
    board = board_from_text("5x4", kind=kind, square="20mm")
    found = detect_views([("tiny", np.zeros(shape, np.uint8))], board)
    assert not found.views
    assert found.missed[0].name == "tiny"
    if min(shape) < 16:
        assert "px are too few to show a" in found.missed[0].reason
