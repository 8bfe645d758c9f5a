"""What a sensor at rest looks like: histogram, drift, spectrum, gain of averaging; and its step response."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from factorlab.characterize.channels import Channel
from factorlab.characterize.engine import Study
from factorlab.characterize.words import group_name, say
from factorlab.report.allan_figure import AllanPanel, accel_panel, allan_figure, gyro_panel
from factorlab.report.style import blank, legend_below, log_axis, thin
from factorlab.report.words import Language
from sequential.sensors import Characteristics, StepResponse

__all__ = ["allan", "drift", "histograms", "oversampling", "spectra", "steps"]

Array = NDArray[np.float64]
COLOURS = ("#D55E00", "#0072B2", "#009E73")
MEANS = 120  # of a recording, over its noise
DENSE = 4000
BANDS = 220


def _decimal(axes: Axes, lang: Language) -> None:
    """Decimal commas on plain axes of a French page."""
    if lang == "fr":
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(FuncFormatter(_with_comma))


def _with_comma(value: float, _: object) -> str:
    return f"{value:.6g}".replace("-", "−").replace(".", ",")


def _grid(study: Study, height: float) -> tuple[Figure, list[tuple[Axes, Characteristics, str]]]:
    """One row a sensor, one column an axis."""
    groups = study.groups()
    columns = max(len(rows) for rows in groups.values())
    figure, axes = blank(height * len(groups) + 0.4, len(groups), columns)
    placed = []
    for row, (_, indices) in enumerate(groups.items()):
        for column in range(columns):
            if column < len(indices):
                k = indices[column]
                placed.append((axes[row, column], study.axes[k], COLOURS[column % 3]))
            else:
                axes[row, column].set_visible(False)
    return figure, placed


def histograms(study: Study, lang: Language) -> Callable[[], Figure]:
    """Deviations from the line beside a normal law of the same σ."""

    def draw() -> Figure:
        figure, placed = _grid(study, 2.3)
        for axes, one, colour in placed:
            seen, sigma = one.distribution, one.noise.sigma.value
            width = np.diff(seen.edges)
            total = max(int(seen.counts.sum()), 1)
            axes.stairs(seen.counts / total / width, seen.edges, fill=True, color=colour, alpha=0.35)
            if sigma > 0.0:
                x = np.linspace(seen.edges[0], seen.edges[-1], 300)
                normal = np.exp(-0.5 * (x / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))
                axes.plot(x, normal, color="black", linewidth=1.1, label=say(lang, "f_normal"))
            axes.set_title(one.name)
            axes.set_xlabel(say(lang, "f_deviation", unit=one.unit))
            axes.set_yticks([])
            axes.xaxis.set_major_locator(MaxNLocator(5))
            _decimal(axes, lang)
        legend_below(figure, placed[0][0])
        return figure

    return draw


def drift(study: Study, lang: Language) -> Callable[[], Figure]:
    """Readings over time, their means, and the straight trend with its interval."""

    def draw() -> Figure:
        figure, placed = _grid(study, 2.3)
        for (axes, one, colour), channel in zip(placed, _in_order(study), strict=True):
            _level(axes, one, channel.values - one.bias.value, colour, lang)
        legend_below(figure, placed[0][0])
        return figure

    return draw


def _in_order(study: Study) -> list[Channel]:
    """Channels as `_grid` places them."""
    return [study.channels[k] for rows in study.groups().values() for k in rows]


def _level(
    axes: Axes, one: Characteristics, values: NDArray[np.float64], colour: str, lang: Language
) -> None:
    known = np.isfinite(one.residual)  # outliers are left out
    t, y = one.t[known], values[known]
    middle = float(t.mean())
    minutes = t[-1] > 240.0
    scale = 1.0 / 60.0 if minutes else 1.0
    shown = thin(len(t), DENSE)
    axes.plot(t[shown] * scale, y[shown], ".", color="#bbbbbb", markersize=1.5, rasterized=True)
    edges = np.linspace(0, len(t), min(MEANS, len(t)) + 1).astype(int)[:-1]
    size = np.diff(np.append(edges, len(t)))
    means, at = (np.add.reduceat(v, edges) / size for v in (y, t))
    label = say(lang, "f_means", seconds=float((t[-1] - t[0]) / len(edges)))
    axes.plot(at * scale, means, color=colour, linewidth=1.2, label=label)
    ends = np.array([t[0], t[-1]])
    axes.plot(ends * scale, one.drift.value * (ends - middle), color="black", label=say(lang, "f_trend"))
    low, high = (slope * (t[shown] - middle) for slope in (one.drift.low, one.drift.high))
    axes.fill_between(t[shown] * scale, low, high, color="black", alpha=0.12, linewidth=0)
    # means and trend are what is to be seen; the readings may be cut off
    reach = 1.3 * max(float(np.abs(means).max()), float(np.abs(low).max()), float(np.abs(high).max()))
    if reach > 0.0:
        axes.set_ylim(-reach, reach)
    axes.set_title(say(lang, "f_bias_moves", axis=one.name, unit=one.unit))
    axes.set_xlabel(say(lang, "f_minutes" if minutes else "f_time"))
    _decimal(axes, lang)


def spectra(study: Study, lang: Language) -> Callable[[], Figure]:
    """Power spectral densities, one panel a sensor."""

    def draw() -> Figure:
        groups = study.groups()
        figure, axes = blank(3.2, 1, len(groups))
        for panel, (group, rows) in zip(axes[0], groups.items(), strict=True):
            for k, colour in zip(rows, _colours(len(rows)), strict=True):
                one = study.axes[k]
                seen = one.spectrum
                hz, density = _in_bands(seen.frequency, seen.density)
                panel.plot(hz, density, color=colour, linewidth=1.1, label=one.name)
                panel.axhline(seen.white, color=colour, linestyle=":", linewidth=1.0)
                for line, _ in seen.lines[:3]:
                    panel.axvline(line, color=colour, linestyle="--", linewidth=0.6)
            log_axis(panel, "x")
            panel.set_yscale("log")
            if lang == "fr":
                panel.xaxis.set_major_formatter(FuncFormatter(_with_comma))
            panel.set_xlabel(say(lang, "f_frequency"))
            unit = study.axes[rows[0]].unit
            panel.set_title(say(lang, "f_psd", group=group_name(group, lang), unit=unit))
            panel.legend(loc="best", ncols=3)
        return figure

    return draw


def _in_bands(hz: Array, density: Array) -> tuple[Array, Array]:
    """Means over bands as wide as a share of their frequency, so that a flat spectrum looks flat."""
    edges = np.unique(np.geomspace(1, len(hz) + 1, BANDS).astype(int)) - 1
    size = np.diff(edges)
    return np.add.reduceat(hz, edges[:-1]) / size, np.add.reduceat(density, edges[:-1]) / size


def _colours(count: int) -> Iterable[str]:
    return (COLOURS[k % 3] for k in range(count))


def allan(study: Study, lang: Language) -> Callable[[], Figure | None]:
    """Allan deviations of every sensor with the slopes read from them."""

    def draw() -> Figure | None:
        panels = []
        for group, rows in study.groups().items():
            if group not in study.slow.deviations:
                continue
            names = [study.channels[k].name for k in rows]
            fits = [study.slow.fits[name] for name in names if name in study.slow.fits]
            fits = fits if len(fits) == len(names) else []
            deviation, title = study.slow.deviations[group], group_name(group, lang)
            unit = study.axes[rows[0]].unit
            if group == "gyro" and unit == "rad/s":
                panels.append(replace(gyro_panel(deviation, fits, title), names=names))
            elif group == "accel" and unit == "m/s²":
                panels.append(replace(accel_panel(deviation, fits, title), names=names))
            else:
                panels.append(AllanPanel(title, deviation, fits, names, unit))
        return allan_figure(panels, lang) if panels else None

    return draw


def oversampling(study: Study, lang: Language) -> Callable[[], Figure]:
    """Bits gained by averaging, beside what white noise would give."""

    def draw() -> Figure:
        groups = study.groups()
        figure, axes = blank(3.0, 1, len(groups), sharey=True)
        for panel, (group, rows) in zip(axes[0], groups.items(), strict=True):
            gains = [study.axes[k].oversampling for k in rows]
            longest = max(gains, key=lambda gain: len(gain.factor))
            panel.plot(longest.factor, longest.expected, color="black", label=say(lang, "f_theory"))
            for k, gain, colour in zip(rows, gains, _colours(len(rows)), strict=True):
                panel.errorbar(
                    gain.factor,
                    gain.bits,
                    1.96 * gain.error,
                    color=colour,
                    marker="o",
                    markersize=4,
                    linewidth=0.9,
                    label=study.axes[k].name,
                )
            log_axis(panel, "x")
            panel.set_xlabel(say(lang, "f_factor"))
            panel.set_title(group_name(group, lang))
            panel.legend(loc="upper left")
            _decimal(panel, lang)
        axes[0, 0].set_ylabel(say(lang, "f_bits"))
        return figure

    return draw


def steps(study: Study, lang: Language) -> Callable[[], Figure]:
    """Readings of a step, the fitted response, and when the input stepped."""

    def draw() -> Figure:
        figure, axes = blank(2.6 * len(study.steps) + 0.4, len(study.steps), 1)
        for panel, channel, one in zip(axes[:, 0], study.channels, study.steps, strict=True):
            panel.plot(
                one.t, channel.values, ".", color="#9a9a9a", markersize=3, label=say(lang, "f_readings")
            )
            panel.plot(one.t, one.fitted, color=COLOURS[0], label=say(lang, "f_fitted", order=one.order))
            if study.step_at is not None:
                panel.axvline(
                    study.step_at, color="black", linestyle="--", linewidth=1.0, label=say(lang, "f_input")
                )
            _near_the_step(panel, one)
            panel.set_ylabel(f"{channel.name}, {channel.unit}".rstrip(", "))
            panel.legend(loc="best")
            _decimal(panel, lang)
        axes[-1, 0].set_xlabel(say(lang, "f_time"))
        return figure

    return draw


def _near_the_step(panel: Axes, one: StepResponse) -> None:
    """Show a stretch around the step that is a few rise times long."""
    reach = max(8.0 * one.rise.value, 10.0 * float(np.median(np.diff(one.t))))
    begin = one.begins.value
    panel.set_xlim(max(begin - 0.5 * reach, one.t[0]), min(begin + reach, one.t[-1]))
