"""Figures of markers: the picture with what was read, and their courses over a video."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.style import WIDTH, blank, legend_below

if TYPE_CHECKING:
    from factorlab.markers.job import MarkersRead

__all__ = ["picture", "tracks"]

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#8A6D00", "#56B4E9", "#E69F00", "#000000")
MOST = 8  # markers in one figure
HIGHEST = 1e6


def picture(drawn: NDArray[np.uint8]) -> Figure:
    """A picture (h, w, 3) BGR as it is."""
    tall = drawn.shape[0] / drawn.shape[1]
    figure, axes = blank(min(8.0, 0.75 * WIDTH * tall))
    axes[0, 0].imshow(drawn[..., ::-1], interpolation="antialiased")
    axes[0, 0].axis("off")
    return figure


def _drawn(odds: float) -> float:
    """Odds as they are drawn: not at all where there is one reading only."""
    return min(odds, HIGHEST) if np.isfinite(odds) else np.nan


def tracks(read: MarkersRead) -> Figure | None:
    """Distance with its 2σ, tilt, and odds of the first markers; dots are single frames."""
    figure, axes = blank(6.4, 3, 1, sharex=True)
    axes[2, 0].set(xlabel="time, s", yscale="log", ylim=(0.7, 2.0 * HIGHEST))
    shown = read.ids[:MOST]
    for number, colour in zip(shown, COLOURS, strict=False):
        rows = [one for one in read.of(number) if one.pose is not None]
        if not rows:
            continue
        t = np.array([one.t_s for one in rows])
        modes = [one.pose.modes[0] for one in rows if one.pose is not None]
        away = np.array([mode.distance_m for mode in modes])
        sigma = np.sqrt([np.trace(mode.cov[3:, 3:]) for mode in modes])
        axes[0, 0].plot(t, away, color=colour, label=str(number))
        axes[0, 0].fill_between(t, away - 2 * sigma, away + 2 * sigma, color=colour, alpha=0.2, linewidth=0)
        axes[1, 0].plot(t, np.degrees([mode.tilt_rad for mode in modes]), color=colour)
        odds = [_drawn(one.pose.odds) for one in rows if one.pose is not None]
        axes[2, 0].plot(t, odds, color=colour)
        alone = [(one.t_s, _drawn(one.alone.odds)) for one in rows if one.alone is not None]
        axes[2, 0].plot(*np.array(alone).T, ".", color=colour, markersize=3.0, alpha=0.6)
    for ax, label in zip(axes[:, 0], ("distance, m", "tilt, °", "odds"), strict=True):
        ax.set_ylabel(label)
    axes[2, 0].axhline(20.0, color="#888888", linestyle="--", linewidth=0.8)
    axes[2, 0].annotate("20: certain", (0.0, 20.0), xytext=(2, 3), textcoords="offset points", fontsize=8)
    legend_below(figure, axes[0, 0], MOST)
    return figure
