"""Rectified pairs, with lines through the same things in both images."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.camera_figures import frame_axes, height_of
from factorlab.report.style import blank

__all__ = ["draw_rectified", "rectified_pairs"]

Picture = NDArray[np.uint8]
Box = tuple[int, int, int, int]
LINES = 12
COLOURS, VALID = ("#56d364", "#f2cc60"), "#ff6b4a"


def rectified_pairs(pairs: list[tuple[str, Picture, Picture]], axis: int, valid: Box) -> Figure | None:
    """Left and right image of each pair (h, w) side by side; of a vertical rig below each other.

    Parameters
    ----------
    pairs : name, left and right image of each
    axis : along which disparities run, 0 or 1
    valid : first and last column and row that are picture in both
    """
    if not pairs:
        return None
    height, width = pairs[0][1].shape
    rows, columns = (len(pairs), 2) if axis == 0 else (2, len(pairs))
    tall = (
        height_of((width, height)) * len(pairs)
        if axis == 0
        else 2.0 * height_of((width, height), 1 / len(pairs))
    )
    figure, axes = blank(min(tall, 40.0), rows, columns)
    for k, (name, left, right) in enumerate(pairs):
        both = axes[k] if axis == 0 else axes[:, k]
        for ax, image, side in zip(both, (left, right), ("left", "right"), strict=True):
            draw_rectified(ax, image, axis, valid, f"{name}, {side}")
    return figure


def draw_rectified(ax: Axes, image: Picture, axis: int, valid: Box, title: str) -> None:
    """One image with lines along which disparities run, and the part that both cameras fill."""
    height, width = image.shape[:2]
    ax.imshow(image, cmap="gray", vmin=0, vmax=255, interpolation="bilinear")
    for k, at in enumerate(np.linspace(0, (height, width)[axis] - 1, LINES + 2)[1:-1]):
        line = ax.axhline if axis == 0 else ax.axvline
        line(at, color=COLOURS[k % 2], linewidth=0.8)
    x0, y0, x1, y1 = valid
    ax.plot([x0, x1, x1, x0, x0], [y0, y0, y1, y1, y0], color=VALID, linewidth=1.0, linestyle="--")
    frame_axes(ax, (width, height))
    ax.set_title(title)
