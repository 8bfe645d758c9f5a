"""How figures look, and how they become inline SVG; pyplot and its state are not used."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

from factorlab.compare import KINDS

__all__ = [
    "LINES",
    "blank",
    "broken",
    "inline_svg",
    "legend_below",
    "line_of",
    "log_axis",
    "styled",
    "thin",
    "title_of",
    "widths",
]

# Okabe and Ito's colours, which colour-blind readers can tell apart, and dashes for printing without colour.
LINES: dict[str, dict[str, Any]] = {
    "ekf": {"color": "#D55E00", "linestyle": "-", "marker": "o"},
    "kf": {"color": "#D55E00", "linestyle": "--", "marker": "P"},
    "kf_rts": {"color": "#0072B2", "linestyle": "--", "marker": "d"},
    "iekf": {"color": "#E69F00", "linestyle": "--", "marker": "s"},
    "ukf": {"color": "#CC79A7", "linestyle": "-.", "marker": "^"},
    "ekf_rts": {"color": "#0072B2", "linestyle": "-", "marker": "v"},
    "ieks": {"color": "#56B4E9", "linestyle": "--", "marker": "D"},
    "fixed_lag": {"color": "#8A6D00", "linestyle": "-.", "marker": "<"},
    "isam2": {"color": "#009E73", "linestyle": "-", "marker": ">"},
    "isam2_final": {"color": "#00543D", "linestyle": ":", "marker": "X"},
    "batch": {"color": "#000000", "linestyle": "-", "marker": "*"},
    "ekf_slam": {"color": "#D55E00", "linestyle": ":", "marker": "p"},
    "batch_robust": {"color": "#0072B2", "linestyle": ":", "marker": "h"},
    "gnc": {"color": "#CC79A7", "linestyle": "--", "marker": "8"},
}
WIDTH = 11.0  # inches, which the page shows at its full width
MOST_POINTS = 1500
PAUSE_S, PAUSE_FACTOR = 2.0, 20.0

RC = {
    "svg.fonttype": "none",  # letters stay text: small, and they can be searched
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial"],
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "axes.axisbelow": True,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "path.simplify": True,
}


@contextmanager
def styled(name: str) -> Iterator[None]:
    """Draw with this module's settings; `name` makes ids that do not change from run to run."""
    settings: dict[Any, Any] = {**RC, "svg.hashsalt": name}
    with mpl.rc_context(settings):
        yield


def blank(height: float, rows: int = 1, columns: int = 1, **grid: Any) -> tuple[Figure, NDArray[Any]]:
    """A figure of the page's width with axes (rows, columns)."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, np.atleast_2d(figure.subplots(rows, columns, squeeze=False, **grid))


def title_of(name: str) -> str:
    """The estimator's name in a legend."""
    return KINDS[name].title


def line_of(name: str) -> dict[str, Any]:
    """Colour and dashes of an estimator, the same in every figure."""
    return {"color": LINES[name]["color"], "linestyle": LINES[name]["linestyle"]}


def widths(count: int) -> list[float]:
    """Line widths from thick to thin, so that lines that coincide can all be seen."""
    return np.linspace(2.8, 1.0, count).tolist() if count > 1 else [1.2]


def log_axis(axes: Axes, which: str = "y") -> None:
    """Logarithmic, with plain numbers at the decades."""
    for name, axis, scale in (("x", axes.xaxis, axes.set_xscale), ("y", axes.yaxis, axes.set_yscale)):
        if name in which:
            scale("log")
            axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
            axis.set_minor_formatter(NullFormatter())


def legend_below(figure: Figure, axes: Axes, columns: int = 6) -> None:
    """One legend under the whole figure, each label once."""
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    if unique:
        figure.legend(unique.values(), unique.keys(), loc="outside lower center", ncols=columns)


def broken(t: NDArray[np.float64], rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Where a line over times t (s), drawn at `rows`, is to be broken: after an unusual pause."""
    steps = np.diff(t)
    usual = float(np.median(steps)) if len(steps) else 0.0
    gap = np.concatenate([[False], steps > max(PAUSE_S, PAUSE_FACTOR * usual)])
    count = np.cumsum(gap)[rows]  # pauses so far
    return np.diff(count, prepend=count[:1]) > 0


def _shorter(tag: re.Match[str]) -> str:
    """A tag whose coordinates have three decimals: a thousandth of a point is enough."""
    return re.sub(r"(\.\d{3})\d+", r"\1", tag.group())


def thin(count: int, most: int = MOST_POINTS) -> NDArray[np.int64]:
    """Rows of a long line that are enough to draw it."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(np.int64))


def inline_svg(name: str, draw: Callable[[], Figure | None], label: str) -> str | None:
    """A figure as an `<svg>` element for an HTML page; None where there is nothing to draw.

    Ids get the figure's name in front, since a page holds many figures; sizes in points are dropped, so that
    the page decides about the width.
    """
    with styled(name):
        figure = draw()
        if figure is None:
            return None
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'<svg ([^>]*?)width="[^"]*"', r"<svg \1", text, count=1)
    text = re.sub(r'<svg ([^>]*?)height="[^"]*"', r"<svg \1", text, count=1)
    text = re.sub(r'(id="|url\(#|href="#)', rf"\g<1>{name}-", text)
    text = re.sub(r"<[^>]*>", _shorter, text)
    text = re.sub(r"\n\s*", "\n", text)
    escaped = label.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    return text.replace("<svg ", f'<svg role="img" aria-label="{escaped}" ', 1)
