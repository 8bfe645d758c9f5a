"""Figures of lines: the picture with what was found, offset and heading over time, some frames of a video."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.style import blank, thin

if TYPE_CHECKING:
    from factorlab.lines.job import LineRun

__all__ = ["frames", "over_time", "picture"]

OFFSET, HEADING, LOST = "#0072B2", "#D55E00", "#bbbbbb"


def picture(run: LineRun) -> Figure:
    """The only picture, with the line or the segments drawn in; the ground from above where it is known."""
    from factorlab.lines.files import bird_eye, drawn
    from factorlab.lines.job import has_lane
    from vision3d.lines import draw_segments

    image, read = run.pictures[0], run.reads[0]
    if read.line.found or has_lane(read) or run.scene is None:
        shown = drawn(image, read)
    else:
        shown = draw_segments(image, run.scene.segments, run.scene.points)
    panels = (
        [shown]
        if run.ground is None
        else [shown, bird_eye(run.ground, drawn(image, read), run.job.settings.middle)]
    )
    ratio = max(one.shape[0] / one.shape[1] for one in panels[:1])
    figure, axes = blank(min(8.0, 11.0 / len(panels) * ratio), 1, len(panels))
    for ax, one in zip(axes[0], panels, strict=True):
        _show(ax, one)
    if len(panels) > 1:
        axes[0, 1].set_title("the ground from above", loc="center")
    return figure


def over_time(run: LineRun) -> Figure:
    """Offset and heading of every frame, in metres where the ground is known, and the confidence."""
    t = np.array([one.t_s for one in run.reads])
    nan = float("nan")
    metric = run.ground is not None
    offset, heading, sigma = np.full((3, len(t)), nan)
    turn = np.full(len(t), nan)
    for k, one in enumerate(run.reads):
        if metric and one.metres is not None:
            offset[k], heading[k] = one.metres.offset_m, np.degrees(one.metres.heading_rad)
            sigma[k], turn[k] = np.sqrt(np.diag(one.metres.cov)) * [1.0, np.degrees(1.0)]
        elif not metric and one.line.found:
            offset[k], heading[k] = one.line.offset, np.degrees(one.line.heading_rad)
            sigma[k] = np.sqrt(one.line.cov_px[0, 0]) / (0.5 * run.size[0])
    figure, axes = blank(5.4, 3, 1, sharex=True)
    rows = thin(len(t))
    for ax, values, spread, colour in (
        (axes[0, 0], offset, sigma, OFFSET),
        (axes[1, 0], heading, turn, HEADING),
    ):
        ax.fill_between(
            t[rows], (values - 2 * spread)[rows], (values + 2 * spread)[rows], color=colour, alpha=0.25, lw=0
        )
        ax.plot(t[rows], values[rows], color=colour)
        ax.axhline(0.0, color="black", linewidth=0.6)
    axes[0, 0].set_ylabel("offset (m, left +)" if metric else "offset (right +)")
    axes[1, 0].set_ylabel(f"heading (°, {'left' if metric else 'right'} +)")
    confidence = np.array([one.line.confidence for one in run.reads])
    axes[2, 0].fill_between(t, 0, 1, where=~run.found, color=LOST, step="mid", label="no line")
    axes[2, 0].plot(t[rows], confidence[rows], color="#009E73")
    axes[2, 0].set(ylabel="confidence", xlabel="time (s)", ylim=(0, 1.05))
    return figure


def frames(run: LineRun) -> Figure | None:
    """Frames evenly over the source, with what was found in each."""
    from factorlab.lines.files import drawn

    if not run.pictures:
        return None
    kept = sorted(run.pictures)
    chosen = [kept[k] for k in np.unique(np.linspace(0, len(kept) - 1, 8).round().astype(int))]
    columns = min(4, len(chosen))
    rows = -(-len(chosen) // columns)
    tall = run.size[1] / run.size[0]
    figure, axes = blank((11.0 / columns * tall + 0.3) * rows, rows, columns)
    for ax in axes.ravel():
        ax.axis("off")
    for ax, k in zip(axes.ravel(), chosen, strict=False):
        read = run.reads[k]
        _show(ax, drawn(run.pictures[k], read))
        said = f"{read.line.confidence:.2f}" if read.line.found else "no line"
        ax.set_title(f"{read.t_s:.2f} s: {said}", fontsize=7.5, loc="center")
    return figure


def _show(ax: Axes, image: NDArray[Any]) -> None:
    """A BGR picture, at most as large as a page can show."""
    import cv2

    factor = 900 / max(image.shape[:2])
    small = (
        image if factor >= 1 else cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    )
    ax.imshow(small[..., ::-1], interpolation="nearest" if factor > 3 else "antialiased")
    ax.axis("off")
