"""The picture of matches: both images in it, lines where they belong, nothing outside."""

import numpy as np
import pytest

from vision3d.features.drawing import GAP_PX, RIGHT, draw_matches

A, B = np.full((60, 80), 40, np.uint8), np.full((50, 100, 3), 90, np.uint8)


def is_right(pixel):
    """The colour of an inlier, smoothed at the edge of its line."""
    return np.abs(pixel.astype(int) - RIGHT).max() < 25


def test_pictures_of_any_two_sizes_lie_side_by_side():
    drawn = draw_matches(A, B, np.empty((0, 2)), np.empty((0, 2)))
    assert drawn.shape == (60, 80 + GAP_PX + 100, 3)
    assert (drawn[:, :80] == 40).all()
    assert (drawn[:50, 80 + GAP_PX :] == 90).all()
    assert (drawn[50:, 80:] == 255).all()


def test_a_match_is_a_line_between_its_ends():
    drawn = draw_matches(A, B, [[10.0, 20.0]], [[30.0, 20.0]])
    for x in (10, 50, 80 + GAP_PX + 30):
        assert is_right(drawn[20, x])
    assert (drawn[40] == draw_matches(A, B, [], [])[40]).all()


def test_outliers_are_faint_and_inliers_above_them():
    points_a, points_b = [[10.0, 20.0], [10.0, 20.0]], [[30.0, 20.0], [30.0, 20.0]]
    drawn = draw_matches(A, B, points_a, points_b, [False, True])
    assert is_right(drawn[20, 50])
    faint = draw_matches(A, B, points_a, points_b, [False, False])[20, 50]
    assert np.abs(faint.astype(int) - 40).max() > 20
    assert not is_right(faint)


def test_at_most_so_many_lines():
    many = np.column_stack([np.full(50, 5.0), np.arange(50.0)])
    drawn = draw_matches(A, B, many, many, most=2)
    coloured = (drawn[:, 60] != 40).any(axis=1).sum()
    assert 2 <= coloured <= 6


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e9])
def test_an_outline_beyond_the_horizon_is_left_out(bad):
    plain = draw_matches(A, B, [], [])
    outline = [[5.0, 5.0], [bad, 5.0], [30.0, 30.0]]
    assert (draw_matches(A, B, [], [], outline=outline) == plain).all()
    inside = draw_matches(A, B, [], [], outline=[[5.0, 5.0], [300.0, 5.0], [30.0, 30.0]])
    assert (inside[:, :80] == plain[:, :80]).all()
    assert (inside != plain).any()
