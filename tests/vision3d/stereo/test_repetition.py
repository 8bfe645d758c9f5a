"""Pictures that look the same a little farther along their rows."""

import cv2
import numpy as np
import pytest
from stereo_worlds import rough_texture

from vision3d.stereo.repetition import repetition


@pytest.mark.parametrize("period", [24, 40])
def test_the_period_of_tiles(period, rng):
    tile = rough_texture(rng, 128, 2.0)[:period, :period]
    wall = np.tile(tile, (200 // period + 1, 320 // period + 1))[:200, :320]
    noisy = np.clip(wall + 2.0 * rng.standard_normal(wall.shape), 0, 255).astype(np.uint8)
    found = repetition(noisy, 100)
    assert found.share > 0.6
    assert found.period_px == pytest.approx(period, abs=1)
    assert repetition(noisy, period - 6).share < 0.05


def test_what_never_comes_again(rng):
    assert repetition(rough_texture(rng, 320), 100).share < 0.02


def test_level_edges_and_nothing():
    level = np.repeat(np.linspace(0, 255, 100, dtype=np.uint8)[:, None], 200, axis=1)
    assert repetition(level, 60).share == 0.0
    assert repetition(np.zeros((60, 80, 3), np.uint8), 40) == (0.0, pytest.approx(np.nan, nan_ok=True), 0)


def test_real_pictures(data_dir):
    folder = data_dir / "vision"
    assert repetition(cv2.imread(str(folder / "motorcycle/motorcycle_left.png")), 70).share < 0.1
    assert repetition(cv2.imread(str(folder / "opencv/left01.jpg")), 120).share > 0.2  # a chessboard
