"""Error of each axis of a pose within ±3σ: filter, window and batch side by side."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from factorlab.compare import Comparison
from factorlab.compare.axes import AxisErrors
from factorlab.compare.pair import filter_of, smoother_of
from factorlab.report.style import blank, broken, line_of, thin
from sequential.log import seconds

__all__ = ["axis_envelopes"]

Column = tuple[str, str, AxisErrors]  # title, colour, errors


def axis_envelopes(comparison: Comparison) -> Figure | None:
    """One row an axis, one column an estimator; None where the truth has no rotation."""
    columns = _columns(comparison)
    if not columns or not columns[0][2].turns:
        return None
    names = columns[0][2].names
    drawing, axes = blank(1.55 * len(names) + 0.5, len(names), len(columns), sharex=True, sharey="row")
    start = int(columns[0][2].t[0])
    for column, (title, color, told) in enumerate(columns):
        for k in range(len(names)):
            _panel(axes[k, column], told, k, color, start, title if k == 0 else "")
    for k, name in enumerate(names):
        unit = "mm" if columns[0][2].units[k] == "m" else "°"
        axes[k, 0].set_ylabel(f"{name}, {unit}")
        reach = max(_reach(told, k) for _, _, told in columns)
        axes[k, 0].set_ylim(-reach, reach)
    for one in axes[-1]:
        one.set_xlabel("time since the start, s")
    return drawing


def _columns(comparison: Comparison) -> list[Column]:
    before, after = filter_of(comparison.rows), smoother_of(comparison.rows)
    windows = [lag for lag in comparison.lags if lag.lag_s > 0 and lag.axes is not None]
    found: list[Column] = []
    if before is not None and before.axes is not None:
        found.append((before.title, line_of(before.name)["color"], before.axes))
    if windows:
        middle = windows[len(windows) // 2]
        assert middle.axes is not None  # noqa: S101 - chosen for having them
        found.append((f"window of {middle.lag_s:g} s, that much later", "#0072B2", middle.axes))
    if after is not None and after.axes is not None:
        found.append((after.title, line_of(after.name)["color"], after.axes))
    return found


def _scaled(told: AxisErrors, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Error and 3σ in mm, or in degrees."""
    factor = 1e3 if told.units[k] == "m" else 180.0 / np.pi
    return factor * told.error[:, k], 3.0 * factor * told.sigma[:, k]


def _reach(told: AxisErrors, k: int) -> float:
    """Seconds without a reading may be far wider than all the rest: let the rest decide."""
    error, three = _scaled(told, k)
    return 1.15 * max(float(np.abs(error).max()), float(np.quantile(three, 0.9)))


def _panel(axes: Axes, told: AxisErrors, k: int, color: str, start: int, title: str) -> None:
    t, (error, three) = seconds(told.t, start), _scaled(told, k)
    kept = thin(len(t), 700)
    pauses = np.flatnonzero(broken(t, kept))  # nothing is drawn across a time without estimates
    x, y, band = (np.insert(values[kept], pauses, np.nan) for values in (t, error, three))
    axes.fill_between(x, -band, band, color=color, alpha=0.18, linewidth=0)
    axes.plot(x, y, color=color, linewidth=0.8)
    inside = f"{100 * float(told.inside()[k]):.1f} % inside ±3σ"
    axes.set_title(f"{title}\n{inside}" if title else inside)
