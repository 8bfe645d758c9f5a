"""Are the stated covariances true?  Innovations and errors beside what χ² expects of them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from factorlab.compare import Comparison, Row
from factorlab.compare.pair import filter_of, smoother_of
from factorlab.report.style import blank, legend_below, line_of, log_axis, thin, widths
from sequential.errors import ShapeError
from sequential.evaluate import whiteness
from sequential.evaluate.consistency import chi2_quantile, whole_nis
from sequential.history import Innovations
from sequential.log import seconds

__all__ = ["autocorrelations", "innovations_over_time", "quantiles"]

DENSE = 3000  # more dots than this become a picture inside the figure
SMALLEST = 1e-3
SURE = 0.001  # as in the verdict: several axes are tested at once


def innovations_over_time(comparison: Comparison) -> Figure | None:
    """NIS of each reading with the band of a single value, a filter beside a smoother."""
    chosen = [filter_of(comparison.rows), smoother_of(comparison.rows)]
    rows = [row for row in chosen if row is not None and row.run is not None and row.run.innovations]
    if not rows:
        return None
    sensors = list(rows[0].run.innovations)[:3]  # type: ignore[union-attr]
    figure, axes = blank(2.6 * len(sensors) + 0.5, len(sensors), len(rows), sharex=True, sharey="row")
    for column, row in enumerate(rows):
        for k, sensor in enumerate(sensors):
            _dots(axes[k, column], row, sensor)
    for one in axes[-1]:
        one.set_xlabel("time since the start, s")
    legend_below(figure, axes[0, 0])
    return figure


def _dots(axes: Axes, row: Row, sensor: str) -> None:
    assert row.run is not None  # noqa: S101 - the caller has looked
    taken = row.run.innovations[sensor]
    t, nis, m = (
        seconds(taken.t, int(row.run.t[0])),
        np.maximum(whole_nis(taken), SMALLEST),
        taken.residual.shape[1],
    )
    low, high = chi2_quantile(0.025, m), chi2_quantile(0.975, m)
    axes.axhspan(low, high, color="#009E73", alpha=0.18, linewidth=0, label=f"95 % of χ² with {m} d.o.f.")
    axes.axhline(m, color="#009E73", linewidth=1.0, label="expected mean")
    color = line_of(row.name)["color"]
    dense = len(t) > DENSE
    axes.plot(t, nis, ".", color=color, markersize=2 if dense else 4, rasterized=dense)
    if not taken.accepted.all():
        axes.plot(
            t[~taken.accepted], nis[~taken.accepted], "x", color="#888888", markersize=4, label="rejected"
        )
    inside = 100 * float(np.mean((nis >= low) & (nis <= high)))
    log_axis(axes)
    axes.set_ylabel(f"NIS of {sensor}")
    kind = "" if taken.kind == "filter" else f", {taken.kind}"
    axes.set_title(f"{row.title}{kind}: mean {nis.mean():.3g}, {inside:.0f} % inside (95 % exp.)")


def autocorrelations(comparison: Comparison) -> Figure | None:
    """Autocorrelation of the filter's innovations: whether one predicts the next."""
    row = filter_of(comparison.rows)
    if row is None or row.run is None:
        return None
    sensors = {name: taken for name, taken in row.run.innovations.items() if taken.accepted.sum() >= 10}
    if not sensors:
        return None
    figure, axes = blank(2.9, 1, min(3, len(sensors)), sharey=True)
    for one, (name, taken) in zip(axes[0], sensors.items(), strict=False):
        _correlation(one, row, name, taken)
    axes[0, 0].set_ylabel("autocorrelation")
    legend_below(figure, axes[0, 0])
    return figure


def _correlation(axes: Axes, row: Row, name: str, taken: Innovations) -> None:
    try:
        found = whiteness(taken, level=SURE)
    except ShapeError:
        return
    lags, m = found.correlation.shape
    axes.axhspan(-found.bound, found.bound, color="#009E73", alpha=0.18, linewidth=0, label="95 % if white")
    axes.axhline(0.0, color="#999999", linewidth=0.8)
    for k in range(m):
        shift = 0.16 * (k - (m - 1) / 2)
        color = ("#D55E00", "#0072B2", "#000000", "#CC79A7")[k % 4]
        axes.vlines(
            np.arange(1, lags + 1) + shift,
            0.0,
            found.correlation[:, k],
            color=color,
            linewidth=2.2,
            label=f"component {k + 1}",
        )
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("lag, readings")
    axes.set_title(
        f"{row.title}, {name}: {100 * found.share_outside:.0f} % outside (5 % expected), {found.verdict}"
    )


def quantiles(comparison: Comparison) -> Figure | None:
    """Normalised errors, sorted, against the quantiles of χ²; a consistent estimate follows the diagonal."""
    rows = [row for row in comparison.rows if row.normalised_error is not None and row.errors is not None]
    if not rows:
        return None
    figure, axes = blank(4.4, 1, 2)
    m = rows[0].errors.error.shape[1]  # type: ignore[union-attr]
    for row, width in zip(rows, widths(len(rows)), strict=True):
        values = np.sort(row.errors.normalised())  # type: ignore[union-attr]
        p = (np.arange(len(values)) + 0.5) / len(values)
        kept = thin(len(values), 300)
        expected = np.array([chi2_quantile(x, m) for x in p[kept]])
        axes[0, 0].plot(
            expected,
            np.maximum(values[kept], SMALLEST),
            linewidth=width,
            label=row.title,
            **line_of(row.name),
        )
    limits = [chi2_quantile(0.005, m), chi2_quantile(0.999, m)]
    axes[0, 0].plot(limits, limits, color="#009E73", linewidth=2.5, alpha=0.5, label="consistent")
    log_axis(axes[0, 0], "xy")
    axes[0, 0].set(xlabel=f"quantile of χ² with {m} d.o.f.", ylabel="normalised error")
    axes[0, 0].set_title("above the diagonal: larger errors than stated")
    _histogram(
        axes[0, 1], [r for r in (filter_of(comparison.rows), smoother_of(comparison.rows)) if r in rows], m
    )
    legend_below(figure, axes[0, 0])
    return figure


def _histogram(axes: Axes, rows: list[Row], m: int) -> None:
    edges = np.geomspace(1e-2, 1e3, 41)
    for row in rows:
        values = np.clip(row.errors.normalised(), edges[0], edges[-1])  # type: ignore[union-attr]
        share = np.histogram(values, edges)[0] / len(values)
        axes.stairs(100 * share, edges, color=line_of(row.name)["color"], linewidth=1.4, label=row.title)
    from scipy.special import chdtr

    expected = np.diff(chdtr(m, edges))
    axes.stairs(100 * expected, edges, color="#009E73", fill=True, alpha=0.25, label="consistent")
    log_axis(axes, "x")
    axes.set(xlabel="normalised error", ylabel="share, %")
    axes.set_title("histogram")
