"""Edges of a stripe where brightness is half-way between both their sides."""

import numpy as np
import pytest

from vision3d.camera import Camera
from vision3d.lines.curve import fit_curve, refine_curve
from vision3d.lines.sharpening import sharpened
from vision3d.lines.stripes import Stripe
from vision3d.render import Plane, cells, render_planes

ROWS, COLUMNS = 80, 160


def stripe(left, right):
    edges = (np.full(ROWS, left), np.full(ROWS, right))
    return Stripe(*edges, True, right - left, 1.0, 1.0, np.zeros(ROWS, np.bool_), COLUMNS)


@pytest.mark.parametrize("blur_px", [0.7, 1.5])
@pytest.mark.parametrize("floors", [(0.8, 0.8), (0.9, 0.4)])
def test_edges_move_to_where_they_are(floors, blur_px):
    camera = Camera("pinhole", (100.0, 100.0, 0.0, 0.0), (), (COLUMNS, ROWS))
    texture = cells([-1.0, 0.6023, 0.8071, 3.0], [-1.0, 2.0], [[floors[0], 0.1, floors[1]]])
    pose = np.array([1.0, 0, 0, 0, 0, 0, 1.0])
    image = render_planes(camera, [Plane(pose, texture)], blur_px=blur_px, vignetting=0.0)
    found = sharpened(image, stripe(61.4, 79.6))
    np.testing.assert_allclose(found.left, 60.23, atol=0.06)
    np.testing.assert_allclose(found.right, 80.71, atol=0.06)
    # both err alike, and the middle less
    np.testing.assert_allclose(0.5 * (found.left + found.right), 70.47, atol=0.03)


def test_where_no_edge_is_the_stripe_stays_as_it_was(rng):
    flat = np.full((ROWS, COLUMNS), 120, np.uint8)
    rough = rng.integers(0, 256, (ROWS, COLUMNS), dtype=np.uint8)
    given = stripe(60.0, 80.0)
    assert sharpened(flat, given) is given
    found = sharpened(rough, given)
    first = fit_curve(given, ROWS - 1.0, 40.0)
    assert np.isfinite(refine_curve(found, ROWS - 1.0, 40.0, first).bottom)
