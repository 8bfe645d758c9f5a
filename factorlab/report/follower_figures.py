"""The figure of a line follower's drive: the way from above, the lateral error, and the command."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from factorlab.report.style import blank, thin

__all__ = ["journey_figure"]

Array = NDArray[np.float64]
TRACK, TRUTH, GUESS, ODOMETRY, AIM = "#b8bec4", "#0072B2", "#D55E00", "#666666", "#009E73"
AIM_CM = 2.0
LONG_M, SPACE_M = 4.0, 0.5  # of a line; of it before and behind the way
TALLEST, FLATTEST = 0.45, 0.12  # height of the map, as shares of its width


def journey_figure(table: Mapping[str, Array], line: Array) -> Figure:
    """Draw one drive.

    Parameters
    ----------
    table : columns (N,) named as in `factorlab.live.follower.journey.COLUMNS`
    line : (M, 2) m
    """
    line = _near(line, table)
    x = np.concatenate([line[:, 0], table["x_m"]])
    y = np.concatenate([line[:, 1], table["y_m"], table["y_odo_m"]])
    share = min(max(float(np.ptp(y) / max(np.ptp(x), 1e-3)), FLATTEST), TALLEST)
    figure, axes = blank(2.0 + 11.0 * share + 2.8, 3, 1, height_ratios=[1.0 + 11.0 * share, 1.6, 1.6])
    rows = thin(len(table["t_s"]))
    seen = {name: column[rows] for name, column in table.items()}
    above, offset, command = axes[:, 0]
    above.plot(*line.T, color=TRACK, lw=5, solid_capstyle="round", label="ligne")
    above.plot(seen["x_odo_m"], seen["y_odo_m"], ":", color=ODOMETRY, label="roues et gyromètre seuls")
    above.plot(seen["x_m"], seen["y_m"], color=TRUTH, lw=1.8, label="vrai")
    above.plot(seen["x_est_m"], seen["y_est_m"], "--", color=GUESS, label="estimé (EKF)")
    above.set_aspect("equal", adjustable="datalim")
    above.set(xlabel="x (m)", ylabel="y (m)")
    above.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4)
    offset.axhspan(-AIM_CM, AIM_CM, color=AIM, alpha=0.15, lw=0)
    offset.plot(seen["t_s"], 100 * seen["offset_m"], color=TRUTH)
    offset.set(ylabel="écart latéral (cm)")
    command.plot(seen["t_s"], seen["w_rad_s"], color=GUESS)
    command.set(xlabel="temps (s)", ylabel="commande (rad/s)")
    for ax in axes[:, 0]:
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}".replace(".", ",").replace("-", "−")))
    for ax in (offset, command):
        _shade_lost(ax, table)
        ax.set_xlim(float(table["t_s"][0]), max(float(table["t_s"][-1]), 0.1))
    return figure


def _near(line: Array, table: Mapping[str, Array]) -> Array:
    """Of a long line the part along which the robot drove."""
    if np.ptp(line[:, 0]) < LONG_M:
        return line
    low, high = table["x_m"].min() - SPACE_M, table["x_m"].max() + SPACE_M
    inside: Array = line[(line[:, 0] >= low) & (line[:, 0] <= high)]
    return inside


def _shade_lost(axes: Axes, table: Mapping[str, Array]) -> None:
    """Grey where the line was lost."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0.0], table["lost"], [0.0]])))
    times = np.append(table["t_s"], table["t_s"][-1])
    for k, (begin, end) in enumerate(edges.reshape(-1, 2)):
        axes.axvspan(
            times[begin], times[end], color="#888888", alpha=0.25, lw=0, label="" if k else "ligne perdue"
        )
    if len(edges):
        axes.legend(loc="upper right")
