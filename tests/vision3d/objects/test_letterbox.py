"""An image on a canvas, and the way back."""

import cv2
import numpy as np
import pytest

from sequential.errors import ShapeError
from vision3d.objects import letterbox


@pytest.mark.parametrize("shape", [(120, 200), (200, 120), (33, 33), (1, 400), (640, 640)])
@pytest.mark.parametrize("keep_shape", [True, False])
def test_letterbox_there_and_back(shape, keep_shape, rng):
    image = rng.integers(0, 256, (*shape, 3), dtype=np.uint8)
    canvas, placement = letterbox(image, (96, 64), keep_shape=keep_shape)
    assert canvas.shape == (64, 96, 3)
    low = rng.random((20, 2)) * np.array(shape[::-1]) * 0.6
    boxes = np.column_stack([low, rng.random((20, 2)) * np.array(shape[::-1]) * 0.4])
    np.testing.assert_allclose(placement.to_image(placement.to_canvas(boxes)), boxes, atol=1e-9)
    rows, columns = placement.crop((96, 64))
    plain = np.ones(canvas.shape[:2], bool)
    plain[rows, columns] = False
    assert np.all(canvas[plain] == 114)
    whole = placement.to_image([[0, 0, 96, 64]])
    np.testing.assert_allclose(whole, [[0, 0, shape[1], shape[0]]], atol=1e-9)


def test_letterbox_takes_grey_and_opacity_and_says_no(rng):
    grey = rng.integers(0, 256, (30, 40), dtype=np.uint8)
    canvas, _ = letterbox(grey, (40, 30))
    np.testing.assert_array_equal(canvas, cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR))
    assert letterbox(np.zeros((5, 5, 4), np.uint8), (8, 8))[0].shape == (8, 8, 3)
    with pytest.raises(ShapeError, match="uint8"):
        letterbox(np.zeros((5, 5)), (8, 8))
