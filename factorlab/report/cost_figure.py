"""Accuracy against time: of estimators, and of windows of several lengths."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from factorlab.compare import Comparison, Row
from factorlab.compare.pair import filter_of, smoother_of
from factorlab.compare.smoothing_text import unit_of
from factorlab.report.lag_figure import lag_figure
from factorlab.report.style import LINES, blank, legend_below, log_axis

__all__ = ["cost", "lag_sweep"]


def cost(comparison: Comparison) -> Figure | None:
    """One mark an estimator: time of a reading, and RMSE; hollow before tuning, full after."""
    rows = [row for row in comparison.rows if row.rmse is not None and row.us_per_measurement is not None]
    if not rows:
        return None
    figure, axes = blank(4.0)
    one = axes[0, 0]
    before = {row.name: row for row in comparison.untuned if row.rmse is not None}
    for row in rows:
        if row.name in before:
            _mark(one, before[row.name], hollow=True)
            ends = (before[row.name], row)
            x, y = ([getattr(end, name) or np.nan for end in ends] for name in ("us_per_measurement", "rmse"))
            one.plot(x, y, color=LINES[row.name]["color"], linewidth=0.5, alpha=0.6)
        _mark(one, row, hollow=False)
    log_axis(one, "xy")
    for axis in (one.xaxis, one.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    unit = "m" if rows[0].errors is not None and rows[0].errors.metres else "sensor's unit"
    one.set(xlabel="time for each reading, µs", ylabel=f"RMSE, {unit}")
    one.set_title(
        "hollow: noise as shipped, full: tuned" if before else "lower is more accurate, left is faster"
    )
    legend_below(figure, one)
    return figure


def _mark(axes: Axes, row: Row, *, hollow: bool) -> None:
    look = LINES[row.name]
    axes.plot(
        [row.us_per_measurement or np.nan],
        [row.rmse or np.nan],
        look["marker"],
        color=look["color"],
        markersize=9,
        markerfacecolor="none" if hollow else look["color"],
        label=None if hollow else row.title,
    )


def lag_sweep(comparison: Comparison) -> Figure | None:
    """The lags of a comparison, beside its filter and its smoother."""
    rows = [row for row in (filter_of(comparison.rows), smoother_of(comparison.rows)) if row is not None]
    honest = [
        (
            row.title,
            None
            if row.normalised_error is None
            else row.normalised_error.mean / row.normalised_error.expected,
        )
        for row in rows
    ]
    return lag_figure(
        comparison.lags,
        rmse=[(row.title, row.rmse) for row in rows],
        honesty=honest,
        unit=unit_of(comparison),
    )
