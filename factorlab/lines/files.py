"""Files beside the report: a table of every frame, pictures with what was found drawn into them."""

from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factorlab.lines.job import LineRun, Read
from factorlab.lines.numbers import COLUMNS, row_of
from vision3d.images import png_bytes
from vision3d.lines import GroundHomography, draw_lane, draw_line, draw_segments

__all__ = ["bird_eye", "drawn", "line_files"]

Picture = NDArray[np.uint8]
NEAREST, FARTHEST = 0.05, 3.0  # m, of the ground that is shown from above
TALL = 600  # px


def line_files(run: LineRun) -> dict[str, str | bytes]:
    """`frames.csv`, and for a single picture `line.png`, `ground.png` and `segments.png`."""
    files: dict[str, str | bytes] = {"frames.csv": frames_csv(run)}
    if run.is_picture:
        image, read = run.pictures[0], run.reads[0]
        files["line.png"] = png_bytes(drawn(image, read))
        if run.scene is not None and not read.line.found:
            files["segments.png"] = png_bytes(draw_segments(image, run.scene.segments, run.scene.points))
        if run.ground is not None:
            files["ground.png"] = png_bytes(bird_eye(run.ground, drawn(image, read), run.job.settings.middle))
    return files


def frames_csv(run: LineRun) -> str:
    """One row a frame."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for read in run.reads:
        writer.writerow({key: _cell(value) for key, value in row_of(read).items()})
    return text.getvalue()


def _cell(value: Any) -> Any:
    if value is None:
        return ""
    if isinstance(value, bool):
        return int(value)
    return f"{value:.6g}" if isinstance(value, float) else value


def drawn(image: Picture, read: Read) -> Picture:
    """The picture with the line, and with the lane where one was asked for."""
    shown = image if read.lane is None else draw_lane(image, read.lane)
    return draw_line(shown, read.line)


def bird_eye(ground: GroundHomography, image: Picture, middle: float = 0.5) -> Picture:
    """The ground from above, as far as the row that looks ahead."""
    height, width = image.shape[:2]
    below = ground.to_ground(
        [[x, y] for x in (0.0, 0.5 * width, width - 1.0) for y in (height - 1.0, middle * height)]
    )
    xy = below.xy[np.isfinite(below.xy).all(axis=1)]
    if not len(xy):
        return np.zeros((8, 8, 3), np.uint8)
    near, far = max(NEAREST, float(xy[:, 0].min())), min(FARTHEST, float(xy[:, 0].max()))
    far = max(far, near + 0.1)
    side = min(float(np.abs(xy[:, 1]).max()), far)
    scale = TALL / (far - near)
    return ground.bird_eye(image, x_m=(near, far), y_m=(-side, side), px_per_m=min(scale, 2 * TALL / side))
