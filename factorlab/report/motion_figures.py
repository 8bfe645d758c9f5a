"""Where it went, how far off the estimates are, and how wide they say they are."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.compare import Comparison, Row
from factorlab.compare.accuracy import has_position, scored_sensor
from factorlab.compare.pair import filter_of, smoother_of
from factorlab.compare.text import figure
from factorlab.report.style import blank, broken, legend_below, line_of, log_axis, thin, title_of, widths
from sequential.log import seconds
from sequential.models import Position

__all__ = ["envelopes", "errors_over_time", "sigmas", "trajectory"]

Array = NDArray[np.float64]
ZOOM_S = 9.0
Window = tuple[int, int]
EVERYTHING: Window = (-(2**63), 2**63 - 1)


def trajectory(comparison: Comparison) -> Figure | None:
    """The map, and a closer look at where the filter is farthest off."""
    if not has_position(comparison.dataset):
        return None
    worst = _worst(comparison)
    drawing, axes = blank(6.2, 1, 1 if worst is None else 2)
    whole = axes[0, 0]
    _paths(whole, comparison, 1.5)
    whole.set_title("whole trajectory")
    if worst is not None:
        _zoom(axes[0, 1], comparison, *worst)
    whole.set_aspect("equal", adjustable="datalim")
    for one in axes.ravel():
        one.set(xlabel="x, m", ylabel="y, m")
    legend_below(drawing, whole)
    return drawing


def _paths(axes: Axes, comparison: Comparison, dot: float, window: Window = EVERYTHING) -> None:
    """Truth, estimates and readings between two times (ns)."""
    dataset = comparison.dataset
    if dataset.truth is not None:
        place = dataset.truth.position[_inside(dataset.truth.t, window)]
        axes.plot(*place[thin(len(place)), :2].T, color="#888888", linewidth=2.5, alpha=0.6, label="truth")
    for row, width in zip(comparison.rows, widths(len(comparison.rows)), strict=True):
        if row.run is not None:
            near = _inside(row.run.t, window)
            path = _line(dataset.positions(row.run)[near, :2], seconds(row.run.t[near]))
            axes.plot(*path.T, linewidth=width, label=row.title, **line_of(row.name))
    name = scored_sensor(comparison.model)
    if isinstance(comparison.model.sensors[name], Position):
        if dataset.held_out is not None:
            held = dataset.held_out.values[_inside(dataset.held_out.t, window)]
            look: dict[str, Any] = {"color": "#666666", "fillstyle": "none", "markersize": dot, "zorder": 5}
            axes.plot(*held[thin(len(held)), :2].T, "o", label="held out", **look)
        used = dataset.log[name].values[_inside(dataset.log[name].t, window)]
        axes.plot(*used[thin(len(used)), :2].T, "+", color="#444444", markersize=7, label="used")


def _inside(t: NDArray[np.int64], window: Window) -> NDArray[np.bool_]:
    return (t >= window[0]) & (t <= window[1])


def _line(values: Array, t: Array) -> Array:
    """A path thinned to what can be seen, with a break (NaN) where nothing was estimated for long."""
    if not len(values):
        return values
    rows = thin(len(values))
    cut = broken(t, rows)
    return np.insert(values[rows], np.flatnonzero(cut), np.nan, axis=0)


def _worst(comparison: Comparison) -> tuple[Row, int] | None:
    """The filter's row, and the time (ns) of its largest error."""
    row = filter_of(comparison.rows)
    if row is None or row.errors is None or not len(row.errors):
        return None
    return row, int(row.errors.t[np.argmax(np.linalg.norm(row.errors.error, axis=1))])


def _zoom(axes: Axes, comparison: Comparison, row: Row, t: int) -> None:
    assert row.run is not None and row.errors is not None  # noqa: S101, PT018 - _worst has looked
    half = int(ZOOM_S * 1e9)
    _paths(axes, comparison, 5.0, (t - half, t + half))
    path = comparison.dataset.positions(row.run)[_inside(row.run.t, (t - half, t + half)), :2]
    middle = 0.5 * (path.max(axis=0) + path.min(axis=0))
    reach = 0.6 * max(float(np.ptp(path, axis=0).max()), 4 * row.errors.rmse())
    axes.set_xlim(middle[0] - reach, middle[0] + reach)
    axes.set_ylim(middle[1] - reach, middle[1] + reach)
    axes.set_aspect("equal", adjustable="box")
    when = seconds(np.array(t), int(row.run.t[0]))
    axes.set_title(f"{2 * ZOOM_S:.0f} s around t = {when:.0f} s, where {row.title} is farthest off")


def errors_over_time(comparison: Comparison) -> Figure | None:
    """Length of the error of every estimator."""
    rows = [row for row in comparison.rows if row.errors is not None]
    if not rows:
        return None
    drawing, axes = blank(3.6)
    one = axes[0, 0]
    for row, width in zip(rows, widths(len(rows)), strict=True):
        t, errors = _times(row), row.errors
        length = np.maximum(np.linalg.norm(errors.error, axis=1), 1e-4)  # type: ignore[union-attr]
        one.plot(
            *_line(np.column_stack([t, length]), t).T,
            linewidth=width,
            label=f"{title_of(row.name)}: {figure(row.rmse)}",
            **line_of(row.name),
        )
    log_axis(one)
    first = rows[0].errors
    unit = "m" if first is not None and first.metres else "sensor's unit"
    one.set(xlabel="time since the start, s", ylabel=f"error, {unit}")
    one.set_title("length of the error; the legend gives the RMSE")
    legend_below(drawing, one, 5)
    return drawing


def _times(row: Row) -> Array:
    assert row.run is not None and row.errors is not None  # noqa: S101, PT018 - rows with errors have a run
    return seconds(row.errors.t, int(row.run.t[0]))


def envelopes(comparison: Comparison) -> Figure | None:
    """Error of each axis within ±3σ, a filter beside a smoother."""
    chosen = [filter_of(comparison.rows), smoother_of(comparison.rows)]
    rows = [row for row in chosen if row is not None and row.errors is not None]
    if not rows or (rows[0].axes is not None and rows[0].axes.turns):
        return None  # `axis_envelopes` shows these axes and the rotation's
    count = min(3, rows[0].errors.error.shape[1])  # type: ignore[union-attr]
    drawing, axes = blank(1.9 * count + 0.6, count, len(rows), sharex=True)
    for column, row in enumerate(rows):
        for k in range(count):
            _envelope(axes[k, column], row, k)
    for one in axes[-1]:
        one.set_xlabel("time since the start, s")
    return drawing


def _envelope(axes: Axes, row: Row, k: int) -> None:
    assert row.errors is not None  # noqa: S101 - the caller has looked
    t, e = _times(row), row.errors.error[:, k]
    three = 3 * np.sqrt(row.errors.cov[:, k, k])
    inside = 100 * float(np.mean(np.abs(e) <= three))
    kept = thin(len(t))
    color = line_of(row.name)["color"]
    axes.fill_between(t[kept], -three[kept], three[kept], color=color, alpha=0.18, linewidth=0)
    axes.plot(t[kept], e[kept], color=color, linewidth=0.9)
    # the first seconds may be far wider than all the rest: let the rest decide
    reach = 1.15 * max(float(np.abs(e).max()), float(np.quantile(three, 0.9)))
    axes.set_ylim(-reach, reach)
    name = "xyz"[k] if row.errors.metres else f"component {k + 1}"
    axes.set_ylabel(f"{name}, m" if row.errors.metres else name)
    axes.set_title(f"{row.title}, {name}: {inside:.1f} % inside ±3σ (99.7 % expected)")


def sigmas(comparison: Comparison) -> Figure | None:
    """Stated σ of the position: filter, smoother, and what the later readings bought."""
    before, after = filter_of(comparison.rows), smoother_of(comparison.rows)
    if before is None or after is None or not has_position(comparison.dataset):
        return None
    drawing, axes = blank(3.2, 1, 2, sharex=True)
    assert before.run is not None  # noqa: S101 - filter_of returns a solved row
    stated = []
    t = seconds(before.run.t, int(before.run.t[0]))
    kept = thin(len(t))
    for row in (before, after):
        assert row.run is not None  # noqa: S101 - filter_of and smoother_of return solved rows
        cov = comparison.dataset.position_cov(row.run)
        width = np.sqrt(np.trace(cov, axis1=1, axis2=2))
        axes[0, 0].plot(t[kept], width[kept], label=row.title, **line_of(row.name))
        stated.append(width)
    log_axis(axes[0, 0])
    axes[0, 0].set(ylabel="σ of the position, m", xlabel="time since the start, s")
    axes[0, 0].set_title("stated uncertainty")
    axes[0, 0].legend()
    ratio = stated[0] / stated[1]
    axes[0, 1].plot(t[kept], ratio[kept], color="#444444", linewidth=0.9)
    axes[0, 1].axhline(1.0, color="#999999", linewidth=0.8)
    log_axis(axes[0, 1])
    axes[0, 1].set(ylabel="ratio", xlabel="time since the start, s")
    axes[0, 1].set_title(
        f"σ of {before.title} over σ of {after.title}: median {figure(float(np.median(ratio)))}"
    )
    return drawing
