"""Pairs of photographs of a board by a rig that is known, as files, for the tests of the stereo commands."""

import json
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from click.testing import CliRunner
from rig_worlds import rig_of

from factorlab.cli import main
from vision3d.boards import Checkerboard
from vision3d.camera import Camera
from vision3d.render.rig_set import RenderedPairs, render_board_pairs

LEFT = Camera("brown5", (532.8, 533.1, 332.5, 238.9), (-0.28, 0.09, 0.0008, -0.0006, -0.02), (640, 480))
RIGHT = Camera("brown5", (536.2, 535.8, 327.1, 243.3), (-0.27, 0.08, 0.0003, -0.0009, 0.01), (640, 480))
TRUTH = rig_of((0.01, 0.02, -0.006), (-0.083, 0.0011, 0.0007), LEFT, RIGHT)
BOARD = Checkerboard(9, 6, 0.025)
OPTIONS = ("--board", "9x6", "--square", "25mm")


class Pairs(NamedTuple):
    """A folder of pairs, and what is true of them."""

    folder: Path
    left: list[Path]
    right: list[Path]
    rendered: RenderedPairs

    @property
    def patterns(self):
        """What is typed on a command line."""
        return str(self.folder / "left*.png"), str(self.folder / "right*.png")


def photographed_pairs(folder, count, seed=1, rig=TRUTH, **settings) -> Pairs:
    """Render pairs into a folder as PNG files left01.png, right01.png …"""
    rendered = render_board_pairs(rig, BOARD, count, np.random.default_rng(seed), **settings)
    sides = []
    for side, images in (("left", rendered.left), ("right", rendered.right)):
        paths = [folder / f"{side}{k + 1:02d}.png" for k in range(count)]
        for path, image in zip(paths, images, strict=True):
            cv2.imwrite(str(path), image)
        sides.append(paths)
    return Pairs(folder, sides[0], sides[1], rendered)


def calibrate(*arguments):
    """`factorlab calibrate stereo …`."""
    return CliRunner().invoke(main, ["calibrate", "stereo", *map(str, arguments)])


def rectify(*arguments):
    """`factorlab stereo rectify …`."""
    return CliRunner().invoke(main, ["stereo", "rectify", *map(str, arguments)])


def answer(done):
    """The document of `--json`."""
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


def verdict(document, metric):
    """The verdict on a metric."""
    return next(one for one in document["verdicts"] if one["metric"].startswith(metric))
