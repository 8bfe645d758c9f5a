"""The log-log plot of Allan deviations, with the slopes that are read from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from factorlab.report.style import blank
from factorlab.report.words import Language
from sequential.sensors import AllanDeviation, NoiseFit
from sequential.sensors.noise_fit import TERMS, Term, curve
from sequential.sensors.noise_words import coefficient_unit

__all__ = ["AllanPanel", "accel_panel", "allan_figure", "gyro_panel"]

Array = NDArray[np.float64]
# Okabe and Ito's colours, dark enough for thin lines
COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#8A6D00", "#56B4E9")
STROKES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)))
READ_AT: dict[Term, float] = {"N": 1.0, "K": 3.0}  # s, where a line has its coefficient's value
MARKS: dict[Term, str] = {"N": "o", "B": "s", "K": "D"}
ROOM = 1.5  # decades that a reading may lie outside the curves and still be shown
SAID = {
    "en": {"tau": "averaging time τ, s", "deviation": "Allan deviation", "bound": "<: 95 % upper bound"},
    "fr": {
        "tau": "durée de moyenne τ, s",
        "deviation": "écart-type d'Allan",
        "bound": "<\u202f: borne à 95 %",
    },
}


@dataclass(frozen=True, slots=True, eq=False)
class AllanPanel:
    """What one panel shows.

    Parameters
    ----------
    title : above it
    deviation : of one axis (T,), or of several (T, k)
    fits : one an axis, or none where nothing is to be read
    names : of the axes
    unit : SI unit of the samples, shown on the right
    shown_unit, factor : unit on the left, and how many of it make one SI unit
    """

    title: str
    deviation: AllanDeviation
    fits: Sequence[NoiseFit] = ()
    names: Sequence[str] = ("x", "y", "z")
    unit: str = ""
    shown_unit: str = ""
    factor: float = 1.0


def gyro_panel(deviation: AllanDeviation, fits: Sequence[NoiseFit] = (), title: str = "gyro") -> AllanPanel:
    """A gyro's deviation, rad/s, shown in degrees a second."""
    return AllanPanel(title, deviation, fits, unit="rad/s", shown_unit="deg/s", factor=float(np.degrees(1.0)))


def accel_panel(
    deviation: AllanDeviation, fits: Sequence[NoiseFit] = (), title: str = "accelerometer"
) -> AllanPanel:
    """An accelerometer's deviation, m/s², shown in thousandths of g."""
    return AllanPanel(title, deviation, fits, unit="m/s²", shown_unit="mg", factor=1e3 / 9.80665)


def allan_figure(panels: Sequence[AllanPanel], lang: Language = "en") -> Figure:
    """Panels side by side: deviations with 95 % intervals, slopes, and the readings of N, B and K.

    A circle at τ = 1 s is N, a square on the flat part 0.664 B, a diamond at τ = 3 s is K; dotted lines are
    the terms that a fit sees.
    """
    figure, grid = blank(5.6, 1, len(panels))
    for axes, panel in zip(grid[0], panels, strict=True):
        _draw(axes, panel, lang)
    return figure


def _draw(axes: Axes, panel: AllanPanel, lang: Language) -> None:
    of, scale = panel.deviation, panel.factor
    columns = [np.atleast_2d(values.T) * scale for values in (of.deviation, of.low, of.high)]
    for k, (middle, low, high) in enumerate(zip(*columns, strict=True)):
        colour = COLOURS[k % len(COLOURS)]
        axes.fill_between(of.tau, low, high, color=colour, alpha=0.14, linewidth=0)
        axes.plot(of.tau, middle, color=colour, linestyle=STROKES[k % len(STROKES)], label=_label(panel, k))
    floor, ceiling = _range(columns)
    axes.set_ylim(floor, ceiling)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for k, fit in enumerate(panel.fits):
        floor, ceiling = _read(axes, panel, fit, COLOURS[k % len(COLOURS)], (floor, ceiling))
    axes.set_ylim(floor / 1.5, ceiling * 1.6)
    _slopes(axes)
    _label_axes(axes, panel, lang)


def _range(columns: Sequence[Array]) -> tuple[float, float]:
    middle, low, high = (values[np.isfinite(values) & (values > 0)] for values in columns)
    if not len(middle):  # a stuck axis deviates by nothing
        return 1e-3, 1.0
    # intervals of the longest times may be an order of magnitude wide, and are cut
    return max(low.min(), middle.min() / 4), min(high.max(), middle.max() * 4)


def _read(
    axes: Axes, panel: AllanPanel, fit: NoiseFit, colour: str, span: tuple[float, float]
) -> tuple[float, float]:
    """Lines and marks of the terms that are visible; the range of the plot with the marks in it."""
    floor, ceiling = span
    tau = np.geomspace(min(panel.deviation.tau[0], 1.0), max(panel.deviation.tau[-1], 3.0), 200)
    total = fit.deviation(tau)
    for term in TERMS:
        if not fit[term].visible:
            continue
        line = curve(term, fit[term].value, tau)
        shown = line > 0.25 * total  # where the term has a part in the whole
        at = READ_AT.get(term, _flat(tau, line, total))
        value = float(curve(term, fit[term].value, np.array([at]))[0]) * panel.factor
        if term in MARKS and floor / 10**ROOM < value < ceiling * 10**ROOM:
            # up to the place where it is read
            near = tau[shown] if shown.any() else np.array([at])
            shown |= (tau >= min(at, near.min())) & (tau <= max(at, near.max()))
            axes.plot(at, value, MARKS[term], color=colour, markersize=6, markerfacecolor="white", zorder=5)
            floor, ceiling = min(floor, value), max(ceiling, value)
        axes.plot(
            tau, np.where(shown, line * panel.factor, np.nan), color=colour, linestyle=":", linewidth=0.9
        )
    return floor, ceiling


def _flat(tau: Array, line: Array, total: Array) -> float:
    """Where the whole is lowest; where it only falls, the middle of what is nearly flat."""
    lowest = int(np.argmin(total))
    if 0 < lowest < len(tau) - 1:
        return float(tau[lowest])
    flat = tau[line > 0.8 * total]
    return float(np.sqrt(flat[0] * flat[-1])) if len(flat) else float(tau[lowest])


def _slopes(axes: Axes) -> None:
    """A key in the upper right corner: what slopes of -1/2, 0 and +1/2 look like on these scales."""
    (left, right), (bottom, top) = np.log10(axes.get_xlim()), np.log10(axes.get_ylim())
    tilt = (right - left) / (top - bottom)
    width = 0.08
    for k, (slope, name) in enumerate(((-0.5, "−½  N"), (0.0, "0  B"), (0.5, "+½  K"))):
        x, rise, middle = 0.56 + 0.15 * k, slope * width * tilt, 0.97 - 0.25 * width * tilt
        ends = ([x, x + width], [middle - rise / 2, middle + rise / 2])
        axes.plot(*ends, transform=axes.transAxes, color="#666666", linewidth=1.4)
        place = (x + width / 2, 0.94 - 0.5 * width * tilt)
        axes.text(*place, name, transform=axes.transAxes, color="#444444", fontsize=8, ha="center", va="top")


def _label_axes(axes: Axes, panel: AllanPanel, lang: Language) -> None:
    said = SAID[lang]
    shown = panel.shown_unit or panel.unit
    axes.set_xlabel(said["tau"])
    axes.set_ylabel(f"{said['deviation']}, {shown}" if shown else said["deviation"])
    axes.set_title(panel.title)
    axes.grid(visible=True, which="major", color="#cccccc", linewidth=0.6)
    axes.grid(visible=True, which="minor", color="#e9e9e9", linewidth=0.4)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(LogLocator(subs=tuple(range(2, 10)), numticks=100))
        axis.set_minor_formatter(NullFormatter())
    if panel.factor != 1.0:
        scale = np.float64(panel.factor)
        there_and_back = (lambda v: np.divide(v, scale), lambda v: np.multiply(v, scale))
        right = axes.secondary_yaxis("right", functions=there_and_back)
        right.set_ylabel(panel.unit)
        right.yaxis.set_minor_formatter(NullFormatter())
    head = None
    if panel.fits:
        units = ", ".join(f"{term} {_shown_unit(term, panel)}" for term in ("N", "B", "K"))
        head = f"{units} ({said['bound']})"
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.11), title=head, title_fontsize=8.5, handlelength=3
    )


def _shown_unit(term: Term, panel: AllanPanel) -> str:
    return coefficient_unit(term, panel.shown_unit or panel.unit)


def _label(panel: AllanPanel, axis: int) -> str:
    """The name of an axis, and its readings in the shown unit."""
    name = panel.names[axis] if axis < len(panel.names) else str(axis)
    if axis >= len(panel.fits):
        return name
    fit = panel.fits[axis]
    said = []
    for term in TERMS:
        one = fit[term]
        if one.visible:
            said.append(f"{term} {panel.factor * one.value:#.3g}")
        elif term in {"N", "B", "K"}:
            said.append(f"{term} < {panel.factor * one.high:#.2g}")
    return f"{name}: " + ", ".join(said)
