"""What the views cover, and what to add."""

import numpy as np
import pytest
from calibration_worlds import board, world

from sequential.manifold.quaternion import quaternion_exp, rotate
from vision3d.calibrate import calibrate, coverage
from vision3d.views import View

MIDDLE = board().mean(axis=0)


def view_of(camera, tilt, centre, name="view"):
    """The exact view of a board turned by a rotation vector about its middle, and its pose's name."""
    turn = quaternion_exp(np.asarray(tilt, float))
    pixels = camera.project(rotate(turn, board() - MIDDLE) + np.asarray(centre, float))
    noise = 0.05 * np.random.default_rng(int(1e3 * abs(centre[0]) + 1e6 * centre[2])).standard_normal(
        pixels.shape
    )
    return View(name, camera.size, board(), pixels + noise, np.arange(54), 0.05)


def covered(camera, *held):
    return coverage(calibrate([view_of(camera, *one) for one in held], "brown2"))


# a turn about +y takes the right side nearer (z is away from the camera): R (1, 0, 0) = (cos, 0, -sin)
TURNS = {
    "left": (0.0, 0.6, 0.0),
    "right": (0.0, -0.6, 0.0),
    "top": (-0.6, 0.0, 0.0),
    "bottom": (0.6, 0.0, 0.0),
}


@pytest.mark.parametrize("side", TURNS)
def test_the_side_that_lies_farther_away_is_named(side):
    camera = world("brown2").camera
    corners = rotate(quaternion_exp(np.array(TURNS[side])), board() - MIDDLE)
    ends = {"left": corners[0::9], "right": corners[8::9], "top": corners[:9], "bottom": corners[45:]}
    assert max(ends, key=lambda name: ends[name][:, 2].mean()) == side
    others = [(turn, (0.01 * i, 0.0, 0.5)) for i, turn in enumerate(TURNS.values())]
    found = covered(camera, (TURNS[side], (0.0, 0.0, 0.45)), *others)
    assert found.away[0] == side
    assert found.tilt_rad[0] == pytest.approx(0.6, abs=0.02)


def test_a_full_round_leaves_nothing_to_say():
    camera = world("brown2").camera
    corners = [((0.1, 0.1, 0.0), (x, y, 0.3)) for x in (-0.08, 0.08) for y in (-0.06, 0.06)]
    depths = (0.35, 0.45, 0.55, 0.6)
    sides = [(turn, (0.0, 0.0, depth)) for turn, depth in zip(TURNS.values(), depths, strict=True)]
    found = covered(camera, *corners, *sides, *sides)
    assert found.advice == ()
    assert min(found.bars.values()) > 0.79
    assert 12 * 50 < found.counts.sum() <= 12 * 54


def test_what_is_missing_is_said():
    camera = world("brown2").camera
    found = covered(camera, *[((0.0, 0.5, 0.0), (0.05 * i, 0.04, 0.5 + 0.01 * i)) for i in range(4)])
    told = " | ".join(found.advice)
    assert "right, top and bottom side is farther away" in told
    assert "top left" in told
    assert "vary the distance" in told
    assert "take more views: 4 so far" in told
    assert found.tilts == 0.25
    assert found.views == 0.4


def test_boards_held_parallel_want_tilting_first():
    camera = world("brown2").camera
    held = [
        ((0.2 * np.sin(i), 0.2 * np.cos(i), 0.0), (0.03 * i - 0.1, 0.0, 0.4 + 0.05 * i)) for i in range(7)
    ]
    assert "tilt the board by 30-45°" in covered(camera, *held).advice[0]
