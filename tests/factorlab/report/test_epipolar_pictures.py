"""Epipolar curves over two pictures: what is drawn, and when nothing is."""

import numpy as np
from two_view_worlds import distorted, world

from factorlab.report.epipolar_pictures import epipolar_curves, spread_choice
from vision3d.two_view import estimate_two_view

GREY = np.full((480, 640), 128, dtype=np.uint8)


def drawn(it, view, **options):
    return epipolar_curves((GREY, GREY), (it.camera, it.camera), (it.pixels_a, it.pixels_b), view, **options)


def test_curves_pass_near_the_matches_of_their_colour(rng):
    it = world(rng, camera=distorted, baseline=0.4)
    view = estimate_two_view(it.camera, it.camera, it.pixels_a, it.pixels_b)
    figure = drawn(it, view, count=6)
    for ax in figure.axes:
        curves = [line for line in ax.lines if len(line.get_xdata()) > 1]
        points = [line for line in ax.lines if line.get_marker() == "o"]
        assert len(curves) == len(points) == 6
        for curve, point in zip(curves, points, strict=True):
            assert curve.get_color() == point.get_color()
            steps = np.column_stack(curve.get_data()) - np.ravel(point.get_data())
            assert np.linalg.norm(steps, axis=1).min() < 5.0


def test_nothing_is_drawn_of_a_turn_or_of_nothing(rng):
    for it in (world(rng, shape="turn"), world(rng, wrong=1.0)):
        assert drawn(it, estimate_two_view(it.camera, it.camera, it.pixels_a, it.pixels_b)) is None


def test_chosen_matches_lie_apart(rng):
    pixels, inliers = rng.uniform(0, 640, (500, 2)), rng.random(500) < 0.5
    chosen = spread_choice(pixels, inliers, 8)
    assert inliers[chosen].all()
    apart = np.linalg.norm(pixels[chosen][:, None] - pixels[chosen], axis=2) + 1e9 * np.eye(8)
    assert apart.min() > 150.0
    assert len(spread_choice(pixels, np.arange(500) < 3, 8)) == 3
