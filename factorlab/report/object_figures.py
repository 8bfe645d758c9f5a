"""A picture with what was found in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib import patheffects
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from factorlab.report.style import blank

if TYPE_CHECKING:
    from factorlab.objects import Found

__all__ = ["picture_with_objects"]

# Okabe and Ito's colours
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
LARGEST = 1000  # px of the picture on the page
NUMBERED = 60


def picture_with_objects(found: Found) -> Figure:
    """Boxes, crosses and numbers over the picture; the mask beside it where a colour or a map decided."""
    image = found.image[:, :, ::-1]
    height, width = image.shape[:2]
    step = max(1, -(-max(height, width) // LARGEST))
    columns = 1 if found.mask is None else 2
    names = list(dict.fromkeys(one.name for one in found.items))
    tall = min(11.0 / columns * height / width + (1.0 if len(names) > 1 else 0.6), 8.5)
    figure, axes = blank(tall, 1, columns)
    extent = (-0.5, width - 0.5, height - 0.5, -0.5)
    first = axes[0, 0]
    first.imshow(image[::step, ::step], extent=extent)
    paints = _paints(found, names)
    edge = [patheffects.withStroke(linewidth=3.0, foreground="white")]
    for k, one in enumerate(found.items, 1):
        colour = paints[one.name]
        left, top, wide, high = one.box
        first.add_patch(
            Rectangle(
                (left - 0.5, top - 0.5), wide, high, fill=False, edgecolor=colour, linewidth=1.6,
                path_effects=edge,
            )
        )  # fmt: skip
        if k <= NUMBERED:
            first.plot(*one.centre, "+", color=colour, markersize=8, markeredgewidth=1.6, path_effects=edge)
            first.annotate(
                str(k), (left - 0.5, top - 0.5), xytext=(2, 2), textcoords="offset points", color=colour,
                fontsize=10, fontweight="bold", path_effects=edge, annotation_clip=True,
            )  # fmt: skip
    first.set(xlim=extent[:2], ylim=extent[2:], title="picture", xlabel="x, px", ylabel="y, px")
    if len(names) > 1:
        handles = [Rectangle((0, 0), 1, 1, color=paints[name]) for name in names[:6]]
        figure.legend(handles, names[:6], loc="outside lower center", ncols=6)
    if found.mask is not None:
        second = axes[0, 1]
        drawn = found.mask[::step, ::step]
        if found.way != "map":
            second.imshow(drawn, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="nearest")
            second.set(
                title="pixels of the colour, cleaned" if found.way == "colour" else "pixels of objects"
            )
        else:
            masked = np.ma.masked_less(np.where(drawn > 0, (drawn.astype(int) - 1) % len(COLOURS), -1), 0)
            paint = ListedColormap(COLOURS)
            second.imshow(masked, cmap=paint, vmin=0, vmax=5, extent=extent, interpolation="nearest")
            second.set(title="classes of pixels, background white")
        second.set(xlabel="x, px")
        second.grid(visible=False)
    first.grid(visible=False)
    return figure


def _paints(found: Found, names: list[str]) -> dict[str, str]:
    """A colour for each name, that of its class's number where the mask is drawn by numbers."""
    numbers = found.facts.get("numbers", {})
    return {
        name: COLOURS[(numbers[name] - 1 if name in numbers else k) % len(COLOURS)]
        for k, name in enumerate(names)
    }
