"""Pictures of what the detector did: cut-outs about doubtful corners, and small views of every image."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from factorlab.report.style import blank

if TYPE_CHECKING:
    from factorlab.camera.cutouts import Cutout, Thumbnail

__all__ = ["corner_cutouts", "thumbnails"]

USED, PREDICTED, DOUBTFUL = "#56d364", "#f2cc60", "#ff6b4a"


def corner_cutouts(cutouts: tuple[Cutout, ...]) -> Figure | None:
    """Enlarged pixels about corners: found, predicted, and the window that refined them."""
    if not cutouts:
        return None
    columns = 6
    rows = -(-len(cutouts) // columns)
    figure, axes = blank(2.2 * rows + 0.2, rows, columns)
    for ax in axes.ravel():
        ax.axis("off")
    for ax, one in zip(axes.ravel(), cutouts, strict=False):
        _cutout(ax, one)
    return figure


def _cutout(ax: Axes, one: Cutout) -> None:
    height, width = one.image.shape
    x0, y0 = one.origin
    extent = (x0 - 0.5, x0 + width - 0.5, y0 + height - 0.5, y0 - 0.5)
    ax.imshow(one.image, cmap="gray", extent=extent, interpolation="nearest")
    x, y = one.found
    half = one.window
    if half:
        square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * (half + 0.5) + one.found
        ax.plot(*square.T, color=DOUBTFUL, linewidth=0.9)
    ax.plot(*one.predicted, "x", color=PREDICTED, markersize=9, markeredgewidth=1.6)
    ax.plot(x, y, "+", color=DOUBTFUL if one.doubtful else USED, markersize=11, markeredgewidth=1.6)
    ax.set(xlim=extent[:2], ylim=extent[2:])
    ax.set_title(one.label, fontsize=7.5, loc="center")


def thumbnails(views: tuple[Thumbnail, ...]) -> Figure | None:
    """Every image, small, with its corners; what was not used says why."""
    if not views:
        return None
    columns = min(6, max(3, len(views)))
    rows = -(-len(views) // columns)
    tall = views[0].image.shape[0] / views[0].image.shape[1]
    figure, axes = blank((11.0 / columns * tall + 0.32) * rows, rows, columns)
    for ax in axes.ravel():
        ax.axis("off")
    for ax, one in zip(axes.ravel(), views, strict=False):
        ax.imshow(one.image, cmap="gray", vmin=0, vmax=255)
        if len(one.pixels):
            ax.plot(*one.pixels.T, "-", color=USED, linewidth=0.5, alpha=0.8)
            ax.plot(*one.pixels[:1].T, "o", color=DOUBTFUL, markersize=3)
        ax.set_title(one.label, fontsize=7.5, loc="center", color="#1b1f24" if len(one.pixels) else "#8a1c00")
    return figure
