"""Figures of a calibration: constants, residuals of dwells and moves, dwells on the timeline, directions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from factorlab.report.style import blank, legend_below, thin

if TYPE_CHECKING:
    from factorlab.calibration.job import Calibrated
    from factorlab.calibration.parameters import Parameter

__all__ = ["coverage", "dwell_residuals", "intervals", "move_residuals", "timeline", "verification"]

BEFORE, AFTER, LEFT_OUT = "#999999", "#0072B2", "#D55E00"
AXES = ("#D55E00", "#009E73", "#0072B2")


def intervals(parameters: tuple[Parameter, ...]) -> Figure | None:
    """Constants less their nominal values, a panel a kind; those without one less their mean."""
    groups: dict[tuple[str, str], list[Parameter]] = {}
    for one in parameters:
        if one.interval is not None:
            groups.setdefault((one.sensor, one.name.split(" ")[0]), []).append(one)
    if not groups:
        return None
    columns = min(3, len(groups))
    rows = -(-len(groups) // columns)
    figure, axes = blank(0.6 + 1.9 * rows, rows, columns)
    for ax in axes.ravel()[len(groups) :]:
        ax.set_visible(False)
    for ax, ((sensor, kind), members) in zip(axes.ravel(), groups.items(), strict=False):
        _interval_panel(ax, sensor, kind, members)
    return figure


def _interval_panel(ax: Axes, sensor: str, kind: str, members: list[Parameter]) -> None:
    relative = members[0].nominal is None
    for k, one in enumerate(members):
        assert one.interval is not None  # noqa: S101 - the caller has chosen
        centre = float(np.mean([m.value for m in members])) if relative else one.nominal
        off = one.value - (centre or 0.0)
        scale = 100.0 / centre if relative and centre and kind == "gain" else 1.0
        half = (one.interval[1] - one.interval[0]) / 2
        look: dict[str, Any] = {
            "fmt": "o" if one.observed else "x",
            "color": AFTER,
            "capsize": 3,
            "markersize": 4,
        }
        ax.errorbar(off * scale, k, xerr=half * abs(scale), **look)
    ax.axvline(0.0, color="black", linewidth=0.8, linestyle="--")
    ax.set_yticks(range(len(members)), [m.name.split(" ")[1] for m in members])
    ax.set_ylim(len(members) - 0.5, -0.5)
    what = "% of the mean gain" if relative and kind == "gain" else members[0].unit or "nominal is 1"
    ax.set_xlabel(f"less {'the mean' if relative else 'nominal'}, {what}")
    ax.set_title(f"{sensor}: {kind}")


def dwell_residuals(done: Calibrated) -> Figure | None:
    """|mean| - g of every dwell before and after, and without itself."""
    fit = done.accel
    if fit is None:
        return None
    figure, axes = blank(3.4, 1, 2, gridspec_kw={"width_ratios": (1, 1.6)})
    k = np.arange(1, len(fit.before) + 1)
    left, right = axes[0]
    left.bar(k, fit.before, color=BEFORE)
    left.set(title="before", xlabel="dwell", ylabel="|mean| − g, m/s²")
    right.bar(k - 0.2, fit.after, 0.4, color=AFTER, label="fitted")
    shown = np.where(fit.used, fit.left_out, np.nan)
    right.errorbar(
        k + 0.2, shown, 2 * fit.sigmas, fmt="o", color=LEFT_OUT, markersize=3.5, capsize=2, linewidth=0.9,
        label="fitted without it, ± 2σ expected",
    )  # fmt: skip
    right.axhline(0.0, color="black", linewidth=0.6)
    for bad in np.flatnonzero(~fit.used):
        right.axvspan(bad + 0.5, bad + 1.5, color="#eeeeee", hatch="//", zorder=0)
    limit = 1.15 * float(np.nanmax(np.abs(shown) + 2 * fit.sigmas))
    right.set(title="after", xlabel="dwell", ylim=(-limit, limit))
    legend_below(figure, right)
    return figure


def move_residuals(done: Calibrated) -> Figure | None:
    """Angle of every move before and after, and without itself."""
    fit = done.gyro
    if fit is None:
        return None
    figure, axes = blank(3.2)
    ax = axes[0, 0]
    k = np.arange(1, len(fit.before) + 1)
    ax.semilogy(k, np.degrees(fit.before), "s", color=BEFORE, label="before", markersize=4)
    ax.semilogy(k, np.degrees(fit.after), "o", color=AFTER, label="fitted", markersize=4)
    ax.semilogy(k, np.degrees(fit.left_out), "x", color=LEFT_OUT, label="fitted without it", markersize=5)
    for one in np.flatnonzero(~fit.whole):
        ax.axvspan(one + 0.6, one + 1.4, color="#f3e3d3", zorder=0, label="range reached, or gap")
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.set(xlabel="move", ylabel="gravity arrives off by, °")
    legend_below(figure, ax)
    return figure


def timeline(done: Calibrated) -> Figure | None:
    """Readings with the still parts shaded, and the variance that told them apart."""
    recording = done.recording
    shown = [name for name in ("accel", "gyro") if getattr(recording, name) is not None]
    figure, axes = blank(0.8 + 1.7 * (len(shown) + 1), len(shown) + 1, 1, sharex=True)
    t = recording.seconds
    rows = thin(len(t), 4000)
    for ax, name in zip(axes[:, 0], shown, strict=False):
        values, unit = getattr(recording, name), getattr(recording, f"{name}_unit")
        if unit == "rad/s":
            values, unit = np.degrees(values), "°/s"
        for k in range(3):
            ax.plot(t[rows], values[rows, k], color=AXES[k], linewidth=0.7, label="xyz"[k])
        ax.set_ylabel(f"{name}, {unit.replace('^2', '²')}")
        _shade(ax, done)
    variance, rest, threshold = done.detector.levels(recording)
    last = axes[-1, 0]
    last.semilogy(t[rows], np.maximum(variance[rows] / rest, 1e-2), color="#444444", linewidth=0.7)
    last.axhline(threshold / rest, color=LEFT_OUT, linestyle="--", linewidth=0.8)
    last.set(ylabel="variance / rest", xlabel="time, s")
    _shade(last, done)
    legend_below(figure, axes[0, 0])
    return figure


def _shade(ax: Axes, done: Calibrated) -> None:
    used = done.accel.used if done.accel is not None else np.ones(len(done.dwells), dtype=bool)
    for (start, stop), good in zip(done.dwells.seconds, used, strict=True):
        look: dict[str, Any] = {"color": "#dcebf5"} if good else {"facecolor": "#eeeeee", "hatch": "//"}
        ax.axvspan(start, stop, zorder=0, linewidth=0, **look)


def coverage(done: Calibrated, up: NDArray[np.float64]) -> Figure | None:
    """Both halves of the sphere of directions, seen along z, areas kept (Lambert)."""
    from sequential.sensors import best_next_direction

    if done.accel is None or done.dwells.accel is None:
        return None
    following, _ = best_next_direction(up)
    figure, axes = blank(4.0, 1, 2)
    for ax, sign in zip(axes[0], (1.0, -1.0), strict=True):
        ax.set_aspect("equal")
        ax.axis("off")
        for degrees in (30, 60, 90):
            radius = np.sqrt(1 - np.cos(np.radians(degrees)))
            angle = np.linspace(0, 2 * np.pi, 120)
            ax.plot(radius * np.cos(angle), radius * np.sin(angle), color="#cccccc", linewidth=0.6)
        for name, x, y in (("+x", 1.06, 0), ("−x", -1.06, 0), ("+y", 0, 1.06), ("−y", 0, -1.06)):
            ax.text(x, y, name, ha="center", va="center", color="#555555")
        _dots(ax, up[up[:, 2] * sign >= 0], sign, marker="o", color=AFTER, markersize=5)
        if following[2] * sign >= 0:
            _dots(ax, following[None], sign, marker="x", color=LEFT_OUT, markersize=9, markeredgewidth=2)
        ax.set_title(f"z axis {'up' if sign > 0 else 'down'}", loc="center")
        ax.set(xlim=(-1.15, 1.15), ylim=(-1.15, 1.15))
    return figure


def _dots(ax: Axes, up: NDArray[np.float64], sign: float, **look: Any) -> None:
    plane = up[:, :2] / np.sqrt(1 + np.abs(up[:, 2:]))
    ax.plot(plane[:, 0], plane[:, 1], linestyle="none", **look)


def verification(done: Calibrated) -> Figure | None:
    """|mean| - g of the other recording's dwells."""
    trial = done.verification
    if trial is None or trial.after is None:
        return None
    figure, axes = blank(2.8)
    ax = axes[0, 0]
    k = np.arange(1, len(trial.after) + 1)
    if trial.before is not None:
        ax.bar(k - 0.2, trial.before, 0.4, color=BEFORE, label="before")
    ax.bar(k + 0.2, trial.after, 0.4, color=AFTER, label="after")
    ax.axhline(0.0, color="black", linewidth=0.6)
    ax.set(xlabel="dwell", ylabel="|mean| − g, m/s²", xticks=k if len(k) < 30 else k[::5])
    legend_below(figure, ax)
    return figure
