"""`image_sol`: the compiled view's image, from a curve given as a function or as points."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from factorlab.l19.follower import track
from factorlab.l19.follower.robot import view
from vision3d.render import GroundLine

COURSE = Path(__file__).resolve().parents[2] / "examples" / "l19"


@pytest.fixture(scope="module")
def image_sol():
    spec = importlib.util.spec_from_file_location("l19_d2", COURSE / "52_d2_suiveur.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.image_sol


@pytest.mark.parametrize("curve", ["sinus", "circuit"])
def test_is_what_the_compiled_view_shows(image_sol, curve, rng):
    line = track(curve)
    for s in (0.8, 2.1, 3.3):
        pose = line.at(s) + rng.normal(0.0, [0.02, 0.02, 0.15])
        ours, compiled = image_sol(pose, line.points), view().image(line.line, pose)
        off = np.abs(ours.astype(int) - compiled)
        assert ours.shape == (40, 60)
        assert ours.dtype == np.uint8
        assert off.mean() < 1.5, "of 136 grey levels between line and ground"
        assert np.percentile(off, 99) < 20


def test_takes_a_function_and_a_width(image_sol):
    pose = np.array([1.0, 0.02, 0.1])
    x = np.arange(0.0, 2.0, 0.01)
    points = np.column_stack([x, 0.1 * np.sin(x)])
    by_function = image_sol(pose, lambda x: 0.1 * np.sin(x)).astype(int)
    assert np.abs(by_function - image_sol(pose, points)).max() <= 2
    wide = image_sol(pose, points, largeur=0.04)
    assert (wide < 90).sum() > 1.6 * (by_function < 90).sum()
    compiled = view().image(GroundLine(points, 0.04), pose)
    assert np.abs(wide.astype(int) - compiled).mean() < 1.5


def test_a_line_on_the_left_is_on_the_left(image_sol):
    image = image_sol((0.0, 0.0, 0.0), lambda x: 0.05 + 0.0 * x)
    dark = np.flatnonzero(image[37] < 90)
    assert dark.max() < 29


def test_noise_is_as_strong_as_said(image_sol):
    image = image_sol((0.0, 5.0, 0.0), lambda x: 0.0 * x, bruit=10.0, rng=np.random.default_rng(0))
    assert image.std() == pytest.approx(10.0, rel=0.05)
