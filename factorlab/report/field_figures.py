"""Figures of the calibration of magnetometers and distance sensors, and of a Ferraris session."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.style import blank, legend_below, log_axis, thin
from sequential.sensors import FieldCheck, ImuRecording, MagnetometerFit, RangeFit
from sequential.sensors.direction_cells import BANDS, SECTORS

__all__ = ["cell_map", "norm_histogram", "projections", "range_curve", "range_sigma", "session"]

Array = NDArray[np.float64]
BEFORE, AFTER, OUT, LINE = "#9a9a9a", "#0072B2", "#D55E00", "#000000"
AXES = ("#D55E00", "#009E73", "#0072B2")
PLANES = ((0, 1), (0, 2), (1, 2))
MOST = 3000


def projections(fit: MagnetometerFit) -> Figure:
    """Readings seen along each axis, raw above, calibrated below, with the ellipsoid and the sphere."""
    figure, axes = blank(7.6, 2, 3)
    points, vectors, kept = fit.readings.points, fit.check.vectors, ~fit.outliers
    rows = thin(len(points), MOST)
    shape = np.linalg.inv(fit.calibration.matrix) * fit.field  # unit sphere to raw
    turn = np.linspace(0, 2 * np.pi, 200)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    for column, (i, j) in enumerate(PLANES):
        above, below = axes[0, column], axes[1, column]
        for one, values in ((above, points), (below, vectors)):
            colour = BEFORE if one is above else AFTER
            inside, outside = rows[kept[rows]], rows[~kept[rows]]
            one.plot(values[inside, i], values[inside, j], ".", color=colour, markersize=1.6, rasterized=True)
            one.plot(values[outside, i], values[outside, j], "x", color=OUT, markersize=3)
            one.set_aspect("equal", adjustable="datalim")
            one.set(xlabel="xyz"[i], ylabel="xyz"[j])
        if not fit.planar:
            # the outline of an ellipsoid seen along an axis: the same rows of its shape, squared
            outline = _root(shape[[i, j]] @ shape[[i, j]].T) @ circle
            above.plot(*(fit.calibration.offset[[i, j], None] + outline), color=LINE, linewidth=1.0)
        above.plot(*fit.calibration.offset[[i, j]], "+", color=LINE, markersize=9)
        below.plot(*circle, color=LINE, linewidth=1.0)
    axes[0, 0].set_title(f"raw, {fit.calibration.unit_in}; + is the hard iron")
    axes[1, 0].set_title("calibrated, of the field")
    return figure


def _root(matrix: Array) -> Array:
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.sqrt(values)) @ vectors.T)


def norm_histogram(fit: MagnetometerFit, other: FieldCheck | None = None) -> Figure:
    """Norms of single readings before and after, beside what the noise alone would make of them."""
    figure, axes = blank(3.2)
    one = axes[0, 0]
    raw = np.linalg.norm(fit.readings.points - fit.calibration.offset, axis=1)
    norms = fit.check.norms
    low, high = np.quantile(np.concatenate([raw / raw.mean(), norms]), (0.002, 0.998))
    edges = np.linspace(low, high, 90)
    one.hist(raw / raw.mean(), edges, density=True, color=BEFORE, alpha=0.7, label="hard iron taken off only")
    one.hist(norms, edges, density=True, histtype="step", color=AFTER, linewidth=1.6, label="calibrated")
    if other is not None:
        one.hist(other.norms, edges, density=True, histtype="step", color=OUT, linewidth=1.4,
                 label="calibrated, the other recording")  # fmt: skip
    share = max(fit.check.noise_share, 1e-9)
    grid = np.linspace(low, high, 400)
    law = np.exp(-0.5 * ((grid - 1) / share) ** 2) / (share * np.sqrt(2 * np.pi))
    one.plot(grid, law, color=LINE, linestyle="--", linewidth=1.0, label="the noise of a reading alone")
    one.set(xlabel="norm over its mean", yticks=[])
    legend_below(figure, one, 4)
    return figure


def cell_map(check: FieldCheck) -> Figure:
    """Mean norm over the 24 cells of direction, in % of their mean, with the number of readings."""
    figure, axes = blank(3.3, 1, 2)
    for ax, cells, title in ((axes[0, 0], check.raw, "raw"), (axes[0, 1], check.calibrated, "calibrated")):
        off = 100 * (cells.mean / np.nanmean(cells.mean) - 1).reshape(BANDS, SECTORS)
        most = max(float(np.nanmax(np.abs(off))), 1e-9)
        ax.imshow(off, cmap="PuOr", vmin=-most, vmax=most, aspect="auto", origin="lower")
        for band in range(BANDS):
            for sector in range(SECTORS):
                _cell(ax, sector, band, off[band, sector], int(cells.count[band * SECTORS + sector]), most)
        ax.set_xticks(np.arange(SECTORS + 1) - 0.5, [f"{-180 + 60 * k}°" for k in range(SECTORS + 1)])
        ends = np.degrees(np.arcsin(np.linspace(-1, 1, BANDS + 1)))
        ax.set_yticks(np.arange(BANDS + 1) - 0.5, [f"{end:.0f}°" for end in ends])
        ax.grid(visible=False)
        ax.set(xlabel="azimuth", ylabel="elevation")
        ax.set_title(f"{title}: spread {100 * cells.spread:.2g} %")
    return figure


def _cell(ax: Axes, x: int, y: int, off: float, count: int, most: float) -> None:
    text = f"{off:+.1f} %\n{count}" if np.isfinite(off) else f"–\n{count}"
    dark = np.isfinite(off) and abs(off) > 0.6 * most
    ax.text(x, y, text, ha="center", va="center", fontsize=7, color="white" if dark else "black")


def range_curve(fit: RangeFit, unit: str, reading_unit: str) -> Figure:
    """Table and curve, and what is left between them."""
    figure, axes = blank(3.8, 1, 2)
    left, right = axes[0]
    low, high = fit.span
    grid = np.linspace(low, high, 400)
    used = fit.used
    left.plot(fit.distances[used], fit.readings[used], ".", color=BEFORE, label="table")
    left.plot(fit.distances[~used], fit.readings[~used], "x", color=OUT, label="left out")
    left.plot(grid, fit.reading(grid), color=AFTER, label="v = a/(d+b) + c")
    left.set(xlabel=_with("distance", unit), ylabel=_with("reading", reading_unit))
    right.axhspan(-2 * fit.sigma, 2 * fit.sigma, color="#e6eef5", label="± 2σ of a reading")
    right.axhline(0, color=LINE, linewidth=0.8)
    right.plot(fit.distances[used], fit.residuals[used], ".", color=AFTER)
    right.set(xlabel=_with("distance", unit), ylabel=_with("table less curve", reading_unit))
    right.legend(loc="upper right")
    left.legend(loc="upper right")
    return figure


def range_sigma(fit: RangeFit, unit: str, limit: float | None, relative: float) -> Figure:
    """Standard deviation of the distance against distance, the limit asked for, and the useful range."""
    figure, axes = blank(3.4)
    one = axes[0, 0]
    low, high = fit.span
    grid = np.linspace(low, high, 400)
    useful = fit.useful_range(limit, relative=relative)
    if useful is not None:
        one.axvspan(*useful, color="#d6ebe3", label="useful range", zorder=0)
    one.plot(grid, fit.sigma_at(grid), color=AFTER, label="from one reading")
    one.plot(grid, fit.sigma_at(grid, samples=16), color="#009E73", label="from the mean of 16")
    one.plot(grid, fit.sigma_at(grid, sigma=0.0), color=OUT, linestyle="--", label="the constants' share")
    asked = relative * grid if limit is None else np.full_like(grid, limit)
    one.plot(grid, asked, color=LINE, linewidth=0.9, linestyle=":", label="limit")
    log_axis(one)
    one.set(xlabel=_with("distance", unit), ylabel=_with("σ of the distance", unit))
    legend_below(figure, one, 5)
    return figure


def _with(what: str, unit: str) -> str:
    return f"{what}, {unit}" if unit else what


def session(recording: ImuRecording, sections: dict[str, NDArray[np.int64]]) -> Figure:
    """Both sensors over time, with the nine sections shaded and named."""
    figure, axes = blank(4.2, 2, 1, sharex=True)
    rows = thin(len(recording))
    for one, sensor in zip(axes[:, 0], ("accel", "gyro"), strict=True):
        values = getattr(recording, sensor)
        for k, axis in enumerate("xyz"):
            one.plot(recording.seconds[rows], values[rows, k], color=AXES[k], linewidth=0.8, label=axis)
        one.set_ylabel(f"{sensor}, {getattr(recording, f'{sensor}_unit')}")
        for name, part in sections.items():
            start, stop = recording.seconds[part[0]], recording.seconds[part[-1]]
            one.axvspan(start, stop, color="#e6eef5" if name.endswith("rot") else "#eeeeee", zorder=0)
            if sensor == "accel":
                one.text((start + stop) / 2, 1.01, name, transform=one.get_xaxis_transform(), ha="center",
                         fontsize=7.5)  # fmt: skip
    axes[1, 0].set_xlabel("time, s")
    legend_below(figure, axes[0, 0], 3)
    return figure
