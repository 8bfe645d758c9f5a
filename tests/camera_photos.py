"""Photographs of boards whose camera is known, as files, for the tests of the calibration command."""

import json
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from click.testing import CliRunner

from factorlab.cli import main
from vision3d.boards import Board, Checkerboard
from vision3d.camera import Camera
from vision3d.render import RenderedSet, render_set

TRUTH = Camera("brown5", (532.8, 533.1, 332.5, 238.9), (-0.28, 0.09, 0.0008, -0.0006, -0.02), (640, 480))
BOARD = Checkerboard(9, 6, 0.025)
OPTIONS = ("--board", "9x6", "--square", "25mm")


class Photos(NamedTuple):
    """A folder of photographs, and what is true of them."""

    folder: Path
    paths: list[Path]
    rendered: RenderedSet


def photographed(folder, count, seed=1, board: Board = BOARD, camera: Camera = TRUTH, **settings) -> Photos:
    """Render photographs into a folder as PNG files."""
    rendered = render_set(camera, board, count, np.random.default_rng(seed), **settings)
    paths = [folder / f"{name}.png" for name, _ in rendered.named()]
    for path, image in zip(paths, rendered.images, strict=True):
        cv2.imwrite(str(path), image)
    return Photos(folder, paths, rendered)


def run(*arguments):
    """`factorlab calibrate camera …`."""
    return CliRunner().invoke(main, ["calibrate", "camera", *map(str, arguments)])


def answer(*arguments):
    """The document of `--json`."""
    done = run(*arguments, "--json")
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)
