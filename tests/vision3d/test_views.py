"""Views: arrays that go together, read-only, and sentences where they do not."""

import numpy as np
import pytest

from sequential.errors import NotFiniteError, ShapeError
from vision3d.boards import Checkerboard
from vision3d.views import View

BOARD = Checkerboard(4, 3, 0.02)


def made(**changes):
    given = {
        "name": "a.png", "size": (640, 480), "points": BOARD.points, "pixels": BOARD.points[:, :2] * 1e4,
        "ids": np.arange(12), "sigma_px": 0.05,
    }  # fmt: skip
    return View(**(given | changes))


def test_a_view_keeps_copies_that_nobody_changes():
    pixels = BOARD.points[:, :2] * 1e4
    view = made(pixels=pixels)
    pixels[0] = -1.0
    assert view.pixels[0, 0] == 0.0
    assert view.sigma_px.shape == (12,)
    with pytest.raises(ValueError, match="read-only"):
        view.sigma_px[0] = 1.0


def test_a_subset_keeps_rows_together():
    part = made(findings=("one",)).subset(np.array([2, 5]))
    assert (len(part), part.ids.tolist(), part.findings) == (2, [2, 5], ("one",))
    np.testing.assert_array_equal(part.points, BOARD.points[[2, 5]])


@pytest.mark.parametrize(
    ("changes", "error", "said"),
    [
        ({"ids": np.arange(11)}, ShapeError, "ids of 12 points"),
        ({"points": np.zeros((12, 2))}, ShapeError, "points of 12 points"),
        ({"pixels": np.full((12, 2), np.nan)}, NotFiniteError, "finite"),
        ({"sigma_px": 0.0}, NotFiniteError, "positive number of pixels"),
    ],
)
def test_arrays_that_do_not_go_together_are_said(changes, error, said):
    with pytest.raises(error, match=said):
        made(**changes)
