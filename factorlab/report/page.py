"""The page: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from factorlab.compare import Comparison
from factorlab.compare.bought import sentences
from factorlab.compare.smoothing_text import axis_table, lag_table, unit_of
from factorlab.compare.text import band, cells, figure, headings, headline, tuning_lines
from factorlab.report.axis_figures import axis_envelopes
from factorlab.report.consistency_figures import autocorrelations, innovations_over_time, quantiles
from factorlab.report.cost_figure import cost, lag_sweep
from factorlab.report.motion_figures import envelopes, errors_over_time, sigmas, trajectory
from factorlab.report.style import inline_svg
from factorlab.report.template import fill

__all__ = ["render"]


@dataclass(frozen=True, slots=True)
class Plot:
    """A figure of the page: how it is drawn, and how it is read."""

    key: str
    title: str
    caption: str
    draw: Callable[[Comparison], Figure | None]


PLOTS = (
    Plot(
        "trajectory",
        "Trajectory",
        "Estimates and what they are compared with, same scale on both axes.",
        trajectory,
    ),
    Plot(
        "errors",
        "Error over time",
        "A filter's error grows until the next reading; a smoother has seen that reading already.",
        errors_over_time,
    ),
    Plot(
        "envelopes",
        "Error and stated ±3σ",
        "A consistent estimate leaves the shaded band three times in a thousand.",
        envelopes,
    ),
    Plot(
        "axes",
        "Each axis and its ±3σ",
        "A consistent estimate is inside in 99.7 %; places along the world's axes, turns about the body's.",
        axis_envelopes,
    ),
    Plot(
        "lags",
        "What waiting is worth",
        "A window's newest estimate waits for nothing; what leaves it is as late as the window is long, and "
        "has seen what came since.",
        lag_sweep,
    ),
    Plot(
        "nis",
        "Innovations",
        "Squared innovations in units of their covariance: above the band are surprises.",
        innovations_over_time,
    ),
    Plot(
        "autocorrelation",
        "Whiteness",
        "Bars outside the band: one innovation predicts the next, so the model lacks something.",
        autocorrelations,
    ),
    Plot(
        "quantiles",
        "Normalised errors",
        "Squared errors in units of their own covariance, beside what χ² expects.",
        quantiles,
    ),
    Plot(
        "sigmas",
        "What the future tells",
        "Stated uncertainty of a filter beside a smoother's: how much the later readings add.",
        sigmas,
    ),
    Plot(
        "cost",
        "Accuracy against time",
        "Time of one warm solve over the number of readings, inputs included.",
        cost,
    ),
)


def render(comparisons: tuple[Comparison, ...], document: dict[str, Any]) -> str:
    """The whole page as text."""
    return fill(
        "report.html.j2",
        lang="en",
        figure=figure,
        band=band,
        cells=cells,
        runs=[_run(comparison, index) for index, comparison in enumerate(comparisons)],
        title=", ".join(comparison.name for comparison in comparisons),
        document=document,
        seed=comparisons[0].seed,
    )


def _run(comparison: Comparison, index: int) -> dict[str, Any]:
    """What the template needs of one comparison."""
    tables = [("noise tuned on the readings in use" if comparison.tuned else "", comparison.rows)]
    if comparison.tuned:
        tables.insert(0, ("noise as shipped", comparison.untuned))
    return {
        "comparison": comparison,
        "anchor": f"run{index}",
        "headings": headings(comparison),
        "headline": headline(comparison),
        "tables": tables,
        "tuning": tuning_lines(comparison.tuned) if comparison.tuned else (),
        "axis_table": axis_table(comparison),
        "lag_table": lag_table(comparison),
        "bought": () if comparison.bought is None else sentences(comparison.bought, unit_of(comparison)),
        "why": () if comparison.bought is None else comparison.bought.why,
        "leave_one_out": any(row.nis and row.nis.kind != "filter" for row in comparison.rows),
        "plots": [made for plot in PLOTS if (made := _plot(plot, comparison, index))],
    }


def _plot(plot: Plot, comparison: Comparison, index: int) -> dict[str, Any] | None:
    label = f"{plot.title}, {comparison.dataset.title}. {plot.caption}"
    svg = inline_svg(f"{plot.key}{index}", lambda: plot.draw(comparison), label)
    if svg is None:
        return None
    # the SVG is made here from numbers and names that matplotlib has escaped
    return {"title": plot.title, "caption": plot.caption, "svg": Markup(svg)}  # noqa: S704
